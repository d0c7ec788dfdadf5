"""What a robot did: the recorded motion of one robot, full-order or reduced."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from pneumorph.base.artefact import load_artefact, reading, save_artefact
from pneumorph.base.heading import heading_deg, last_known
from pneumorph.base.notebook import ShownInNotebooks
from pneumorph.base.numbering import check_within
from pneumorph.geometry.robot_shape import RobotShape

FORMAT_VERSION = 3
_OF_A_LEVEL_FLOOR = 2
"""Of files without the ground's normals, which are those of a plane."""
_WITHOUT_SHAPE = 1
"""Format version of files that do not say what the robot looks like."""


def check_record_every(record_every: int) -> None:
    """Refuse a number of steps between frames that is none.

    Raises:
        ValueError: It is less than 1.
    """
    if record_every < 1:
        raise ValueError(
            f"record_every is {record_every}, expected the number of steps between two frames, at "
            "least 1"
        )


@dataclass(frozen=True, eq=False)
class Trajectory(ShownInNotebooks):
    """Recorded motion of one robot. Axes: frame, leg, node, regulator.

    The hub's frame is the robot's frame at rest: a point r of it is at hub_position +
    hub_rotation r in the world.
    """

    time_s: Float[np.ndarray, " frame"]
    """Time of each frame since the start of the recording [s]."""
    hub_position_mm: Float[np.ndarray, "frame 3"]
    """World position of the hub frame's origin [mm]."""
    hub_rotation: Float[np.ndarray, "frame 3 3"]
    """Hub frame to world."""
    tracked_point_mm: Float[np.ndarray, "frame 3"]
    """World position of the point whose travel is rewarded [mm]."""
    commanded_kPa: Float[np.ndarray, "frame regulator"]
    """Real pressure asked for in the step before the frame [kPa]."""
    regulated_kPa: Float[np.ndarray, "frame regulator"]
    """Real pressure that the regulators have reached [kPa]."""
    contact_count: np.ndarray
    """Contact points that took part in the contact solve, (frame,)."""
    node_positions_mm: Float[np.ndarray, "frame leg node 3"] | None = None
    """World positions of every leg's nodes [mm], in single precision, where recorded; of a leg with
    fewer nodes than others the last one is repeated."""
    skin_triangles: np.ndarray | None = None
    """Outer triangles of a leg, indices of its nodes, (triangle, 3), for drawing; of all different
    parts, one after the other, where there are several: see `RobotShape.skin_part`."""
    cavity_volume_mm3: Float[np.ndarray, "frame leg"] | None = None
    """Volume of each leg's cavity [mm^3], of full-order robots."""
    pressure_work_mJ: Float[np.ndarray, "frame leg"] | None = None
    """Work of the pressure in each leg since the robot was at rest [mJ], of
    full-order robots."""
    contact_force_mN: Float[np.ndarray, "frame leg point 3"] | None = None
    """Force of the floor on each leg's contact points in the step before the frame, world axes
    [mN], in single precision; recorded with the nodes; zero beyond a leg's points."""
    contact_velocity_mm_per_s: Float[np.ndarray, "frame leg point 3"] | None = None
    """Velocities of these points in that step, as the law of contact speaks of them: zero, to the
    solver's tolerance, of points that stick, and zero where there is no force [mm/s], in single
    precision; recorded with the nodes. In the first frame of a reduced robot those by its modes
    alone."""
    contact_normal: Float[np.ndarray, "frame leg point 3"] | None = None
    """Which way the ground faces below these points, unit vectors in single precision; None where
    it is a level plane, where that is up."""
    shape: RobotShape | None = None
    """What the robot looks like: its hub, and the part, place and regulators of each leg; None in
    files of earlier versions."""
    status: str = "completed"
    """How the rollout ended: `completed`, or why it stopped early."""
    metadata: dict[str, Any] = field(default_factory=dict)
    """Model, design and settings; JSON-serialisable."""

    def __post_init__(self) -> None:
        frame, regulator = np.shape(self.commanded_kPa)
        if frame == 0:
            raise ValueError("a trajectory has 0 frames, expected at least one")
        shapes = {
            "time_s": (frame,),
            "hub_position_mm": (frame, 3),
            "hub_rotation": (frame, 3, 3),
            "tracked_point_mm": (frame, 3),
            "regulated_kPa": (frame, regulator),
            "contact_count": (frame,),
        }
        for name, shape in shapes.items():
            if np.shape(getattr(self, name)) != shape:
                raise ValueError(
                    f"{name} must have shape {shape}, got {np.shape(getattr(self, name))}"
                )
        nodes = self.node_positions_mm
        if nodes is not None and (nodes.ndim != 4 or nodes.shape[::3] != (frame, 3)):
            raise ValueError(
                f"node_positions_mm must have shape ({frame}, leg, node, 3), got {nodes.shape}"
            )
        self._check_values()
        if self.shape is None:
            return
        if nodes is not None and nodes.shape[1] != len(self.shape.leg_part):
            raise ValueError(
                f"shape has {len(self.shape.leg_part)} legs, expected {nodes.shape[1]} as "
                "node_positions_mm has"
            )
        if self.skin_triangles is not None:
            triangles = len(self.skin_triangles)
            if len(self.shape.skin_part) != triangles:
                raise ValueError(
                    f"shape.skin_part has {len(self.shape.skin_part)} entries, expected one for "
                    f"each of the {triangles} skin triangles"
                )

    def _check_values(self) -> None:
        for name, values in self.arrays().items():
            if not np.issubdtype(values.dtype, np.number) or np.iscomplexobj(values):
                raise ValueError(f"{name} holds {values.dtype} values, expected numbers")
            # A robot that diverged may end with frames that are none.
            if self.status == "completed" and not np.isfinite(values).all():
                raise ValueError(
                    f"{name} holds a value that is not finite, expected none of a robot that "
                    "completed its walk"
                )
        if not (np.diff(self.time_s) > 0.0).all():
            raise ValueError("time_s must rise from frame to frame")
        nodes, skin = self.node_positions_mm, self.skin_triangles
        if nodes is None or skin is None:
            return
        if skin.ndim != 2 or skin.shape[1] != 3:
            raise ValueError(f"skin_triangles must have shape (triangle, 3), got {skin.shape}")
        check_within("skin_triangles", skin, nodes.shape[2], "nodes")

    def __repr__(self) -> str:
        whose = self.metadata.get("design") or "robot"
        ratio = self.metadata.get("range_ratio")
        reached = "" if ratio is None else f", {ratio:.2g} times as far as its legs' snapshots"
        return (
            f"Trajectory({whose}: {self.status}, {self.time_s[-1]:g} s in {len(self.time_s)} "
            f"frames, {self.forward_distance_cm:.2f} cm forward{reached})"
        )

    @property
    def forward_distance_cm(self) -> float:
        """Forward (x) travel of the tracked point from first to last frame [cm]."""
        return float(self.tracked_point_mm[-1, 0] - self.tracked_point_mm[0, 0]) / 10.0

    @property
    def distance_cm(self) -> float | None:
        """Forward travel of the whole walk [cm]; None of one that did not come to its end."""
        return self.forward_distance_cm if self.status == "completed" else None

    @property
    def forward_cm(self) -> Float[np.ndarray, " frame"]:
        """Forward travel of the tracked point since the first frame [cm]."""
        forward: np.ndarray = (self.tracked_point_mm[:, 0] - self.tracked_point_mm[0, 0]) / 10.0
        return forward

    @property
    def left_cm(self) -> Float[np.ndarray, " frame"]:
        """Travel of the tracked point to the left since the first frame [cm]."""
        left: np.ndarray = (self.tracked_point_mm[:, 1] - self.tracked_point_mm[0, 1]) / 10.0
        return left

    @property
    def turned_deg(self) -> Float[np.ndarray, " frame"]:
        """Turn of the hub to the left since the first frame, whole circles counted [degrees]; it
        turns by less than half a circle from frame to frame, and not at all while it is tipped
        over, see `pneumorph.base.heading`; of one that starts so, since it first faces anywhere."""
        heading = heading_deg(self.hub_rotation)
        faced = heading[np.isfinite(heading)]
        heading = last_known(heading, start=faced[0] if len(faced) > 0 else 0.0)
        turned: np.ndarray = np.unwrap(heading, period=360.0) - heading[0]
        return turned

    @property
    def tilt_deg(self) -> tuple[np.ndarray, np.ndarray]:
        """Roll (left side up) and pitch (front down) of the hub [degrees], (frame,) each.

        Its own left and forward axes against the horizontal, so heading does not count; both are 0
        of one on its back.
        """
        left, forward = self.hub_rotation[:, 2, 1], -self.hub_rotation[:, 2, 0]
        roll, pitch = (np.degrees(np.arcsin(np.clip(up, -1.0, 1.0))) for up in (left, forward))
        return roll, pitch

    @property
    def lean_deg(self) -> Float[np.ndarray, " frame"]:
        """Angle between the hub's upward axis and the floor's normal [degrees], 0 to 180: above 90
        it lies on its back."""
        lean: np.ndarray = np.degrees(np.arccos(np.clip(self.hub_rotation[:, 2, 2], -1.0, 1.0)))
        return lean

    def with_skin_only(self) -> Trajectory:
        """The same with the nodes of the skin alone, numbered anew: a third of the nodes.

        A trajectory without nodes or skin is returned as it is.
        """
        nodes, skin = self.node_positions_mm, self.skin_triangles
        if nodes is None or skin is None:
            return self
        kept, renumbered = np.unique(skin, return_inverse=True)
        return replace(
            self,
            node_positions_mm=np.ascontiguousarray(nodes[:, :, kept]),
            skin_triangles=renumbered.reshape(skin.shape).astype(np.int32),
        )

    def arrays(self) -> dict[str, np.ndarray]:
        """Every array that was recorded, by name."""
        names = (*_REQUIRED, *_OPTIONAL)
        return {name: getattr(self, name) for name in names if getattr(self, name) is not None}

    def save(self, path: Path | str) -> Path:
        """Write the trajectory as one npz file."""
        header = {"status": self.status, "description": self.metadata}
        shape = {} if self.shape is None else self.shape.arrays()
        version = _OF_A_LEVEL_FLOOR if shape else _WITHOUT_SHAPE
        if self.contact_normal is not None:
            version = FORMAT_VERSION
        return save_artefact(path, "Trajectory", version, {**self.arrays(), **shape}, header)

    @classmethod
    def load(cls, path: Path | str) -> Trajectory:
        """Read a trajectory.

        Raises:
            FileNotFoundError: No such file.
            ArtefactError: Truncated, of another kind or of another format version.
        """
        known = (_WITHOUT_SHAPE, _OF_A_LEVEL_FLOOR, FORMAT_VERSION)
        arrays, header = load_artefact(path, "Trajectory", *known)
        with reading(path, "Trajectory"):
            shape = RobotShape.taken_from(arrays)
            recorded = {k: v for k, v in arrays.items() if ":" not in k}
            return cls(
                **recorded, shape=shape, status=header["status"], metadata=header["description"]
            )


_REQUIRED = ("time_s", "hub_position_mm", "hub_rotation", "tracked_point_mm", "commanded_kPa",
             "regulated_kPa", "contact_count")  # fmt: skip
_OPTIONAL = ("node_positions_mm", "skin_triangles", "cavity_volume_mm3", "pressure_work_mJ",
             "contact_force_mN", "contact_velocity_mm_per_s", "contact_normal")  # fmt: skip
