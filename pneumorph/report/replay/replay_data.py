"""What a replay page is told: every robot's motion as JSON with arrays in base64.

The player (`player/` beside this file) reads it. Arrays are little-endian; all positions are in mm,
pressures in real kPa, times in s. docs/file_formats.md lists the fields.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.base.checked import Checked, NotNegative, Positive
from pneumorph.environment.goal import Goal
from pneumorph.report.floor_slope import slope_deg
from pneumorph.report.ground_surface import SPACING_MM, plane_height_mm
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.replay.leg_modes import LegModes, leg_modes
from pneumorph.report.scene import Actor, full_pressure_kPa

FORMAT = "pneumorph replay"
FORMAT_VERSION = 2


@dataclass(frozen=True)
class ReplaySettings(Checked):
    """Accuracy of a replay, and with it the size of its page."""

    tolerance_mm: Positive = 0.01
    """Largest error of a leg's node in each coordinate [mm]. A larger tolerance makes replays of
    finite elements smaller; reduced robots are always exact to single precision."""
    frame_interval_s: NotNegative = 0.0
    """Shortest time between stored frames [s]; 0 stores every frame of the trajectory. The player
    moves smoothly in between."""


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
    of_mesh: dict[str, list[tuple[Actor, int]]] = {}
    for actor in actors:
        if isinstance(actor, Actor):
            for leg in range(len(actor.legs)):
                of_mesh.setdefault(_mesh_key(actor, leg), []).append((actor, leg))
    keys, groups = list(of_mesh), of_mesh.values()
    bases = [
        leg_modes(
            [_shapes(actor, leg, _kept(actor, settings)) for actor, leg in group],
            settings.tolerance_mm,
        )
        for group in groups
    ]
    robots = [
        _measured(actor) if isinstance(actor, MarkerActor)
        else _simulated(actor, keys, bases, settings)
        for actor in actors
    ]  # fmt: skip
    return {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "full_kPa": full_pressure_kPa(actors),
        "bases": [
            _basis(basis, actor.legs[leg].triangles)
            for basis, ((actor, leg), *_) in zip(bases, groups, strict=True)
        ],
        "robots": robots,
    }


def live_data(actor: Actor, frame: int = 0) -> dict[str, Any]:
    """Return what the player is told of a robot whose other frames are still to come.

    Args:
        actor: A robot with at least one recorded frame.
        frame: Its first frame to show.
    """
    keys = [_mesh_key(actor, leg) for leg in range(len(actor.legs))]
    first = {key: actor.legs[keys.index(key)] for key in dict.fromkeys(keys)}
    bases = [
        {
            "node_count": leg.nodes.shape[1],
            "mode_count": 0,
            "triangles": array(leg.triangles, "<u4"),
        }
        for leg in first.values()
    ]
    robot = {
        **_described(actor),
        "bases": [list(first).index(key) for key in keys],
        "frames": 1,
        **live_frame(actor, frame),
    }
    return {"format": FORMAT, "version": FORMAT_VERSION, "bases": bases, "robots": [robot]}


def live_frame(actor: Actor, frame: int) -> dict[str, Any]:
    """Return one frame of a robot for the player: positions as they are, in single precision."""
    positions = np.concatenate([leg.nodes[frame] for leg in actor.legs])
    return {
        "robot": 0,
        **_motion(actor, np.array([frame])),
        "positions_mm": array(positions, "<f4"),
    }


def array(values: np.ndarray, kind: str) -> str:
    """Return an array in base64, of a numpy type such as ``<f4``."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()


def _simulated(
    actor: Actor, keys: Sequence[str], bases: Sequence[LegModes], settings: ReplaySettings
) -> dict[str, Any]:
    kept = _kept(actor, settings)
    places = [keys.index(_mesh_key(actor, leg)) for leg in range(len(actor.legs))]
    coefficients, error = [], 0.0
    for leg, place in enumerate(places):
        shapes = _shapes(actor, leg, kept)
        coefficients.append(bases[place].coefficients(shapes))
        # Turning a leg into the world adds the rounding of the hub's pose, 1e-4 mm at most.
        error = max(error, float(np.abs(bases[place].shapes(coefficients[-1]) - shapes).max()))
    return {
        **_described(actor),
        "bases": places,
        "frames": len(kept),
        **_motion(actor, kept),
        "coefficients_mm": array(np.hstack(coefficients), "<f4"),
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
        **_goal(actor.goal),
        "regulators": [list(each) for each in actor.regulators],
        "regulator_count": trajectory.commanded_kPa.shape[1],
        "poses": [
            np.column_stack([rotation, position]).ravel().tolist()
            for rotation, position in zip(
                actor.shape.leg_rotation, actor.shape.leg_position_mm, strict=True
            )
        ],
        "floor_mm": plane_height_mm(trajectory.metadata),
        "floor_slope_deg": slope_deg(trajectory),
        **_ground(actor),
        "hub_nodes_mm": array(actor.shape.hub_nodes_mm, "<f4"),
        "hub_triangles": array(actor.shape.hub_triangles, "<u4"),
        **_payload(actor),
    }


def _payload(actor: Actor) -> dict[str, Any]:
    """The mark of what its hub carries; nothing where it carries nothing."""
    mark = actor.mark
    if mark is None:
        return {}
    return {
        "payload": {
            "place_mm": mark.place_mm.tolist(),
            "radius_mm": mark.radius_mm,
            "corners_mm": array(mark.corners_mm, "<f4"),
        }
    }


def _goal(goal: Goal) -> dict[str, Any]:
    """What of its way is told beside a robot; nothing where that is the distance."""
    if goal.is_forward:
        return {}
    told = {"label": goal.label, "symbol": goal.symbol, "digits": goal.digits}
    return {"goal": {**told, "direction": list(goal.direction)}}


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


def _mesh_key(actor: Actor, leg: int) -> str:
    shown = actor.legs[leg]
    content = hashlib.sha256(shown.triangles.astype("<u4").tobytes()).hexdigest()
    return f"{shown.nodes.shape[1]} {content}"


def _shapes(actor: Actor, leg: int, kept: np.ndarray) -> np.ndarray:
    """Return a leg in its own frame, (frame, 3 node)."""
    trajectory, shape = actor.trajectory, actor.shape
    nodes = actor.legs[leg].nodes[kept] - trajectory.hub_position_mm[kept, None]
    in_hub = np.einsum("fki,fnk->fni", trajectory.hub_rotation[kept], nodes)
    own = (in_hub - shape.leg_position_mm[leg]) @ shape.leg_rotation[leg]
    return np.asarray(own.reshape(len(kept), -1))


def _ground(actor: Actor) -> dict[str, Any]:
    """The heights that a robot walked on; nothing of a plane."""
    surface = actor.ground
    if surface is None:
        return {}
    return {
        "ground": {
            "columns": len(surface.x_mm),
            "rows": len(surface.y_mm),
            "corner_mm": [float(surface.x_mm[0]), float(surface.y_mm[0])],
            "spacing_mm": SPACING_MM,
            "height_mm": array(surface.height_mm, "<f4"),
        }
    }
