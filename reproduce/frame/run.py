"""A basis fixed in the world, as published, beside one in the hub's frame, for a turned robot.

    python reproduce/frame/run.py --out runs/frame

A full-order robot walks once (kept in walk.npz); turned about the vertical it is the same walk, for
floor and gravity do not know directions. Writes frame.json and frame.png.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import tyro

from pneumorph.base.artefact import load_artefact, save_artefact, write_json
from pneumorph.base.settings import load_settings
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.paper_robot import paper_hub
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.pod import pod
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings, bend_snapshots
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings, walk_plan
from pneumorph.report.style import (
    BASELINE_COLOUR,
    LEARNED_COLOUR,
    figure_style,
    new_figure,
    save_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PUBLISHED = load_settings(RobotOptions, Path(__file__).parent.parent / "published.toml")
ANGLES_DEG = (0, 15, 30, 45, 60, 90, 135, 180)
"""How far the robot is turned about the vertical."""
REPORTED_DEG = (0, 45, 90, 180)
BEND_KPA = 300.0
"""Simulated pressure of the bent leg that is looked at."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Legs of a robot in their own frames.

    Attributes:
        nodes: In the frame carried by the hub [mm], (state, node, 3).
        carried: Pose of that frame in the frame of the leg at the start, one for each state.
        vertical: The vertical in that frame, one for each state, (state, 3).
    """

    nodes: np.ndarray
    carried: list[Pose]
    vertical: np.ndarray


def walked(part: PartModel, hold_s: float, path: Path) -> Motion:
    """Every fourth step of a four-legged robot's walk over corners of its pressures."""
    settings = WalkSnapshotSettings(leg_counts=(4,), hold_s=hold_s, record_every=4)
    mounting = RadialMounting()
    poses = [mounting.pose(location) for location in range(mounting.location_count)]
    plan = walk_plan(settings, 0, len(poses))
    if not path.exists():
        physics = replace(
            PUBLISHED.physics,
            regulator_count=len(plan.places),
            pressure_map=PressureMap(1.0, 0.0),
            pressure_rate_kPa_per_s=settings.pressure_rate_kPa_per_s,
        )
        mounts = [(part, poses[place], leg) for leg, place in enumerate(plan.places)]
        robot = FullRobot(paper_hub(PUBLISHED.masses).full("rigid"), mounts, physics)
        recorded: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        steps = 0

        def observe(state: FullRobotState) -> None:
            nonlocal steps
            steps += 1
            if steps % settings.record_every == 0:
                rotation, position = robot.hub.frame(state.hub)
                legs = np.array(robot.leg_nodes_in_hub_frame(state))
                recorded.append((legs.astype(np.float32), rotation, position))

        commands = plan.commands_kPa(settings)
        robot.rollout(
            robot.settled_state(), commands, len(commands), record_nodes=False, observe=observe
        )
        columns = map(np.array, zip(*recorded, strict=True))
        arrays = dict(zip(("legs", "rotation", "position"), columns, strict=True))
        save_artefact(path, "FrameWalk", 1, arrays, {"hold_s": hold_s})
    arrays, metadata = load_artefact(path, "FrameWalk", 1)
    if metadata["hold_s"] != hold_s:
        raise ValueError(
            f"{path} was made with --hold-s {metadata['hold_s']}; choose another --out"
        )
    nodes, carried, vertical = [], [], []
    for legs, rotation, position in zip(*arrays.values(), strict=True):
        for leg, place in zip(legs, plan.places, strict=True):
            pose = poses[place]
            nodes.append(leg.astype(float))
            carried.append(pose.inverse().compose(Pose(rotation, position)).compose(pose))
            vertical.append(pose.rotation.T @ np.array([0.0, 0.0, 1.0]))
    return Motion(np.array(nodes), carried, np.array(vertical))


def turned_displacement(part: PartModel, motion: Motion, angle_deg: float) -> np.ndarray:
    """Displacements from the leg's first place [mm], (state, node, 3), of a robot turned further.

    About the vertical through the leg's own origin: where else would only add a translation, which
    the published basis holds.
    """
    result = np.empty_like(motion.nodes)
    for number, (nodes, carried) in enumerate(zip(motion.nodes, motion.carried, strict=True)):
        turn = _about(motion.vertical[number], angle_deg)
        result[number] = carried.apply(nodes) @ turn.T - part.rest_nodes
    return result


def _about(axis: np.ndarray, angle_deg: float) -> np.ndarray:
    """Rotation about a unit vector, (3, 3)."""
    towards = np.linalg.svd(axis[None])[2].T  # its first column is +-axis
    basis = np.column_stack([towards[:, 1], np.cross(axis, towards[:, 1]), axis])
    return basis @ rotation_about("z", angle_deg) @ basis.T


def node_error_mm(displacement: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Mean distance of the nodes to the nearest state of an orthonormal basis, (state,)."""
    flat = displacement.reshape(len(displacement), -1)
    left = flat - (flat @ basis) @ basis.T
    distance: np.ndarray = np.linalg.norm(left.reshape(displacement.shape), axis=2).mean(axis=1)
    return distance


def orthonormal_modes(part: PartModel, displacement: np.ndarray, mode_count: int) -> np.ndarray:
    """POD modes in the Euclidean norm, (3 node, mode); node masses are equal."""
    found = pod(displacement, part.node_mass, tolerance=1e-6, mode_limit=mode_count)
    flat = found.modes.reshape(-1, found.modes.shape[2])
    return np.linalg.qr(flat)[0]


def published_modes(part: PartModel, displacement: np.ndarray, mode_count: int) -> np.ndarray:
    """Three translations, and the POD of what they leave."""
    translations = np.tile(np.eye(3), (part.node_count, 1)) / part.node_count**0.5
    left = displacement - displacement.mean(axis=1, keepdims=True)
    return np.hstack([translations, orthonormal_modes(part, left, mode_count - 3)])


def main(out: Path = Path("runs/frame"), modes: int = 24, hold_s: float = 0.6) -> None:
    """Walk, make both bases, turn the robot, and draw.

    Args:
        out: Folder of the walk, frame.json and the figure.
        modes: Of each basis.
        hold_s: How long a corner of the pressures is held [s].
    """
    part = module_of_leg(PUBLISHED.leg, masses=PUBLISHED.masses).full
    walk = walked(part, hold_s, out / "walk.npz")
    bend = bend_snapshots(part, StaticSnapshotSettings(bend_pressure_kPa=BEND_KPA, bend_count=10))
    pitch = RadialMounting().pose(0).rotation.T @ np.array([0.0, 0.0, 1.0])
    count = len(bend)
    bent = Motion(
        part.rest_nodes + bend.displacement.astype(float),
        [Pose()] * count,
        np.tile(pitch, (count, 1)),
    )

    # Free bending and every second state of the walk train both bases.
    hub_states = walk.nodes - part.rest_nodes
    world_states = turned_displacement(part, walk, 0.0)
    legs = np.arange(len(walk.nodes)) // 4 % 2 == 0
    ours = orthonormal_modes(part, np.concatenate([bend.displacement, hub_states[legs]]), modes)
    published = published_modes(
        part, np.concatenate([bend.displacement, world_states[legs]]), modes
    )
    our_error = node_error_mm(hub_states[~legs], ours)
    full_bend = end_face_bend_deg(part.mesh, bent.nodes[-1])
    our_bend = _held_bend(part, bend.displacement[-1], ours, np.eye(3))
    rows = []
    for angle in ANGLES_DEG:
        error = node_error_mm(turned_displacement(part, walk, angle)[~legs], published)
        turn = _about(pitch, angle)
        moved = turned_displacement(part, bent, angle)[-1]
        rows.append(
            {
                "angle_deg": angle,
                "published_mean_node_error_mm": float(error.mean()),
                "ours_mean_node_error_mm": float(our_error.mean()),
                "published_bend_deg": _held_bend(part, moved, published, turn),
                "ours_bend_deg": our_bend,
                "full_bend_deg": full_bend,
            }
        )
    content = {
        "mode_count": modes,
        "state_count": len(walk.nodes),
        "mean_deformation_mm": float(np.linalg.norm(hub_states, axis=2).mean()),
        "largest_turn_of_hub_deg": max(_angle_deg(pose.rotation) for pose in walk.carried),
        "rows": rows,
    }
    write_json(out / "frame.json", content)
    save_figure(frame_figure(rows), out / "frame.png")
    for row in rows:
        if row["angle_deg"] in REPORTED_DEG:
            print("  ".join(f"{name} {value:.4g}" for name, value in row.items()))
    print(f"wrote {out / 'frame.json'} and {out / 'frame.png'}")


def _held_bend(
    part: PartModel, displacement: np.ndarray, basis: np.ndarray, turn: np.ndarray
) -> float:
    """Bend of the nearest shape that a basis holds, seen from the turned root [degrees]."""
    nearest = (basis @ (basis.T @ displacement.ravel())).reshape(-1, 3)
    return end_face_bend_deg(part.mesh, (part.rest_nodes + nearest) @ turn)


def _angle_deg(rotation: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0))))


@figure_style()
def frame_figure(rows: list[dict[str, float]]) -> Figure:
    """Error and bend over the angle."""
    figure = new_figure(7.0, 2.8)
    first, second = figure.subplots(1, 2)
    angle = [row["angle_deg"] for row in rows]
    for name, colour, label in (
        ("published", BASELINE_COLOUR, "fixed in the world (published)"),
        ("ours", LEARNED_COLOUR, "in the hub's frame (ours)"),
    ):
        errors = [row[f"{name}_mean_node_error_mm"] for row in rows]
        first.semilogy(angle, errors, "o-", color=colour, label=label)
        second.plot(angle, [row[f"{name}_bend_deg"] for row in rows], "o-", color=colour)
    second.axhline(rows[0]["full_bend_deg"], color="black", linewidth=0.8, label="full model")
    first.set(xlabel="robot turned by (deg)", ylabel="mean node error (mm)")
    second.set(xlabel="robot turned by (deg)", ylabel=f"bend held at {BEND_KPA:g} kPa (deg)")
    first.legend(fontsize="small")
    second.legend(fontsize="small")
    return figure


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
