"""What a replay page is told: every robot's motion as JSON with arrays in base64.

The player (`player/` beside this file) reads it. Arrays are little-endian; all positions are in mm,
pressures in real kPa, times in s. docs/file_formats.md lists the fields.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pneumorph.base.checked import Checked, NotNegative, Positive
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.replay.leg_modes import LegModes, leg_modes
from pneumorph.report.scene import Actor
from pneumorph.robot.design import Design

FORMAT = "pneumorph replay"
FORMAT_VERSION = 1


@dataclass(frozen=True)
class ReplaySettings(Checked):
    """How exact, and so how large, a replay is."""

    tolerance_mm: Positive = 0.01
    """How far a leg's node may be off in each coordinate [mm]. Reduced robots are exact to single
    precision, because their own modes are found; the replay of finite elements is smaller with a
    larger tolerance."""
    frame_interval_s: NotNegative = 0.0
    """Shortest time between frames that are kept [s]; the player moves smoothly between frames. 0
    keeps every frame of the trajectory."""


def replay_data(
    actors: Sequence[Actor | MarkerActor], settings: ReplaySettings | None = None
) -> dict[str, Any]:
    """Return what the player shows of robots, as JSON values.

    Legs of one mesh share their modes, so a further robot adds a hundredth of what the first takes.

    Args:
        actors: The robots, simulated or measured; see `pneumorph.report.film.side_by_side` for
            their lanes.
        settings: How exact.

    Raises:
        ValueError: No robot, or one whose positions are not finite.
    """
    if not actors:
        raise ValueError("a replay needs at least one robot, got none")
    settings = settings or ReplaySettings()
    of_mesh: dict[str, list[Actor]] = {}
    for actor in actors:
        if isinstance(actor, Actor):
            of_mesh.setdefault(_mesh_key(actor), []).append(actor)
    keys, groups = list(of_mesh), of_mesh.values()
    bases = [
        leg_modes([_shapes(each, _kept(each, settings)) for each in group], settings.tolerance_mm)
        for group in groups
    ]
    robots = []
    for actor in actors:
        if isinstance(actor, MarkerActor):
            robots.append(_measured(actor))
        else:
            place = keys.index(_mesh_key(actor))
            robots.append(_simulated(actor, place, bases[place], settings))
    return {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "bases": [_basis(b, group[0].skin[1]) for b, group in zip(bases, groups, strict=True)],
        "robots": robots,
    }


def live_data(actor: Actor, frame: int = 0) -> dict[str, Any]:
    """Return what the player is told of a robot whose other frames are still to come.

    Args:
        actor: A robot with at least one recorded frame.
        frame: Its first frame to show.
    """
    nodes, triangles = actor.skin
    basis = {"node_count": nodes.shape[2], "mode_count": 0, "triangles": array(triangles, "<u4")}
    robot = {
        **_described(actor),
        "basis": 0,
        "turns_rad": [0.0] * nodes.shape[1],
        "frames": 1,
        **live_frame(actor, frame),
    }
    return {"format": FORMAT, "version": FORMAT_VERSION, "bases": [basis], "robots": [robot]}


def live_frame(actor: Actor, frame: int) -> dict[str, Any]:
    """Return one frame of a robot for the player: positions as they are, in single precision."""
    return {
        "robot": 0,
        **_motion(actor, np.array([frame])),
        "positions_mm": array(actor.skin[0][frame], "<f4"),
    }


def array(values: np.ndarray, kind: str) -> str:
    """Return an array in base64, of a numpy type such as ``<f4``."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()


def _simulated(
    actor: Actor, place: int, basis: LegModes, settings: ReplaySettings
) -> dict[str, Any]:
    kept = _kept(actor, settings)
    shapes = _shapes(actor, kept)
    coefficients = basis.coefficients(shapes)
    # Turning a leg into the world adds the rounding of the hub's pose, 1e-4 mm at most.
    error = float(np.abs(basis.shapes(coefficients) - shapes).max())
    return {
        **_described(actor),
        "basis": place,
        "turns_rad": _turns(actor).tolist(),
        "frames": len(kept),
        **_motion(actor, kept),
        "coefficients_mm": array(coefficients, "<f4"),
        "largest_error_mm": error,
    }


def _measured(actor: MarkerActor) -> dict[str, Any]:
    height = np.zeros((len(actor.time_s), 1))
    return {
        "kind": "measured",
        "label": actor.label,
        "lane_mm": actor.lane_mm,
        "regulator_count": actor.commanded_kPa.shape[1],
        "frames": len(actor.time_s),
        "time_s": array(actor.time_s, "<f4"),
        "tracked_mm": array(np.hstack([actor.position_mm, height]), "<f4"),
        "commanded_kPa": array(actor.commanded_kPa, "<f4"),
        "regulated_kPa": array(actor.regulated_kPa, "<f4"),
    }


def _described(actor: Actor) -> dict[str, Any]:
    """What is known of a simulated robot before it moves."""
    trajectory = actor.trajectory
    return {
        "kind": "simulated",
        "label": actor.label,
        "lane_mm": actor.lane_mm,
        "design": trajectory.metadata.get("design"),
        "model": trajectory.metadata.get("model"),
        "status": trajectory.status,
        "regulators": list(actor.regulators),
        "regulator_count": trajectory.commanded_kPa.shape[1],
        "floor_mm": _floor_mm(trajectory.metadata),
        "disk": asdict(actor.disk),
    }


def _motion(actor: Actor, kept: np.ndarray) -> dict[str, Any]:
    """Everything of some frames but the shapes of the legs."""
    from scipy.spatial.transform import Rotation

    trajectory = actor.trajectory
    # Scalar last: x, y, z, w, as the player's library has it.
    quaternion = Rotation.from_matrix(trajectory.hub_rotation[kept]).as_quat()
    hub = np.hstack([trajectory.hub_position_mm[kept], quaternion])
    return {
        "time_s": array(trajectory.time_s[kept], "<f4"),
        "hub": array(hub, "<f4"),
        "tracked_mm": array(trajectory.tracked_point_mm[kept], "<f4"),
        "commanded_kPa": array(trajectory.commanded_kPa[kept], "<f4"),
        "regulated_kPa": array(trajectory.regulated_kPa[kept], "<f4"),
    }


def _basis(basis: LegModes, triangles: np.ndarray) -> dict[str, Any]:
    return {
        "node_count": len(basis.mean) // 3,
        "mode_count": len(basis.modes),
        "triangles": array(triangles, "<u4"),
        "mean_mm": array(basis.mean, "<f4"),
        "modes": array(basis.modes, "<f4"),
    }


def _kept(actor: Actor, settings: ReplaySettings) -> np.ndarray:
    """Return the frames to keep, the last one always among them."""
    times = actor.trajectory.time_s
    kept = [0]
    for frame, time_s in enumerate(times[1:], start=1):
        if time_s - times[kept[-1]] >= settings.frame_interval_s - 1e-9:
            kept.append(frame)
    return np.union1d(kept, [len(times) - 1])


def _mesh_key(actor: Actor) -> str:
    nodes, triangles = actor.skin
    return f"{nodes.shape[2]} {hashlib.sha256(triangles.astype('<u4').tobytes()).hexdigest()}"


def _shapes(actor: Actor, kept: np.ndarray) -> np.ndarray:
    """Return legs in the hub's frame, turned to location 0, (frame x leg, 3 node)."""
    trajectory = actor.trajectory
    nodes = actor.skin[0][kept] - trajectory.hub_position_mm[kept, None, None]
    turn = _turns(actor)
    cosine, sine, zero = np.cos(turn), np.sin(turn), np.zeros_like(turn)
    # Rows of R^T of a turn about z.
    back = np.array([[cosine, sine, zero], [-sine, cosine, zero], [zero, zero, zero + 1.0]])
    rotation = np.einsum("ijl,fkj->flik", back, trajectory.hub_rotation[kept])
    shapes = np.einsum("flik,flnk->flni", rotation, nodes)
    return np.asarray(shapes.reshape(len(kept) * len(turn), -1))


def _turns(actor: Actor) -> np.ndarray:
    """Return each leg's direction about the hub's axis [rad], (leg,); 0 where it is not known."""
    name = actor.trajectory.metadata.get("design")
    if isinstance(name, str):
        design = Design.parse(name)
        if design.leg_count == len(actor.regulators):
            return np.array([design.angle_rad(location) for location, _ in design.legs])
    return np.zeros(len(actor.regulators))


def _floor_mm(metadata: Mapping[str, Any]) -> float | None:
    """Return the height where contact points rest; None where the floor is no plane."""
    height = metadata.get("settings", {}).get("floor_height_mm")
    floor = metadata.get("contact", {}).get("floor", "plane")
    return float(height) if height is not None and str(floor).startswith("plane") else None
