"""What the published damping does to a walk: two designs, two gaits, both dampings, full order.

    python reproduce/damping/run.py --out runs/damping

One file for each walk, so that a run that was stopped goes on; then damping.json and damping.png.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.executor import ExecutorSettings, run_tasks
from pneumorph.base.run_folder import made_once
from pneumorph.base.settings import load_settings
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.fem.false_moment import false_moment
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import read_gait
from pneumorph.physics.open_loop_gait import OpenLoopGait, sample_commands
from pneumorph.physics.physics import Damping
from pneumorph.report.style import (
    BASELINE_COLOUR,
    LEARNED_COLOUR,
    figure_style,
    new_figure,
    save_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(__file__).parent
PUBLISHED = load_settings(RobotOptions, HERE.parent / "published.toml")
DESIGNS = {"expert": BASELINE_DESIGN, "learned": "0.0.0.1.1.2.0.0"}
GAITS = ("expert", "learned")
DAMPINGS: tuple[Damping, ...] = ("published", "objective")
SLIP_MM_PER_S = 1.0
"""A pressed point that moves faster along the floor slips."""


class Observer:
    """Collects what each leg's contacts do in every step."""

    def __init__(self, robot: FullRobot) -> None:
        counts = [leg.contact_count for leg in robot.legs] + [len(robot.hub.contact_points)]
        self._robot, self._ends = robot, np.cumsum(counts)[:-1]
        self.series: dict[str, list[Any]] = {
            name: [] for name in ("x_mm", "slipping", "grip", "damping_Nmm", "elasticity_Nmm")
        }

    def __call__(self, state: FullRobotState) -> None:
        """Note one step."""
        robot = self._robot
        self.series["x_mm"].append(float(robot.tracked_point_mm(state)[0]))
        slipping, grip = [], []
        for impulse, velocity in zip(
            np.split(state.impulses, self._ends),
            np.split(state.contact_velocities, self._ends),
            strict=True,
        ):
            normal = impulse[:, 0].sum()
            speed = np.linalg.norm(velocity[:, 1:], axis=1)
            # Share of the load that rests on points which slip, and of the friction that is used.
            slipping.append(float(impulse[speed > SLIP_MM_PER_S, 0].sum() / max(normal, 1e-12)))
            used = np.linalg.norm(impulse[:, 1:].sum(axis=0))
            grip.append(float(used / max(robot.physics.friction * normal, 1e-12)))
        self.series["slipping"].append(slipping)
        self.series["grip"].append(grip)
        moment = false_moment(robot, state)
        self.series["damping_Nmm"].append(float(np.linalg.norm(moment.damping)))
        self.series["elasticity_Nmm"].append(float(np.linalg.norm(moment.elasticity)))


def walk(duration_s: float, way: tuple[str, str, Damping]) -> dict[str, Any]:
    """What happens while one design walks with one gait under one damping."""
    design, gait_name, damping = way
    gait: OpenLoopGait = ExpertGait(phase_deg=110.0)
    if gait_name == "learned":
        gait, _ = read_gait(HERE / "learned_gait.csv")
    physics = replace(PUBLISHED.physics, damping=damping)
    robot = replace(PUBLISHED, physics=physics).spec().full(DESIGNS[design])
    commands = sample_commands(gait, physics.time_step_s, round(duration_s / physics.time_step_s))
    observer = Observer(robot)
    _, trajectory = robot.rollout(
        robot.settled_state(), commands, record_nodes=False, observe=observer
    )
    return {
        "design": DESIGNS[design],
        "gait": gait_name,
        "damping": damping,
        "status": trajectory.status,
        "distance_cm": trajectory.forward_distance_cm,
        "contact": trajectory.metadata["contact"],
        "weight_moment_Nmm": _weight_moment(robot),
        **observer.series,
    }


def _weight_moment(robot: FullRobot) -> float:
    """Weight of a leg times its distance from the robot's axis, a scale for moments [N mm]."""
    leg = robot.legs[0]
    arm = np.linalg.norm(leg.initial_positions().mean(axis=0)[:2])
    return float(1e-3 * leg.part.mass_kg * robot.physics.gravity_mm_per_s2 * arm)


def described(way: dict[str, Any]) -> dict[str, Any]:
    """The figures of one walk."""
    slipping = np.array(way["slipping"])
    summary = {key: way[key] for key in ("design", "gait", "damping", "status", "distance_cm")}
    for name in ("damping_Nmm", "elasticity_Nmm"):
        moment = np.array(way[name])
        summary |= {f"mean_{name}": float(moment.mean()), f"largest_{name}": float(moment.max())}
    return summary | {
        "weight_moment_Nmm": way["weight_moment_Nmm"],
        # The last column is the disk's own.
        "slipping_share_by_leg": slipping[:, :-1].mean(axis=0).round(3).tolist(),
        "slipping_share_of_disk": float(slipping[:, -1].mean()),
        "grip_used_by_leg": np.array(way["grip"])[:, :-1].mean(axis=0).round(3).tolist(),
        "contact": way["contact"],
    }


@figure_style()
def damping_figure(ways: dict[str, dict[str, Any]]) -> Figure:
    """Forward travel and false moment of every pair under both dampings."""
    figure = new_figure(9.0, 6.0)
    axes = figure.subplots(2, 4, sharex=True, sharey="row")
    for column, (design, gait) in enumerate(product(DESIGNS, GAITS)):
        for damping, colour in zip(DAMPINGS, (BASELINE_COLOUR, LEARNED_COLOUR), strict=True):
            way = ways[f"{design}_{gait}_{damping}"]
            time_s = PUBLISHED.physics.time_step_s * np.arange(1, len(way["x_mm"]) + 1)
            travel = 0.1 * (np.array(way["x_mm"]) - way["x_mm"][0])
            axes[0, column].plot(time_s, travel, color=colour, label=damping)
            moment = np.array(way["damping_Nmm"])
            axes[1, column].plot(time_s, moment, color=colour, linewidth=0.8)
        axes[0, column].set(title=f"{design} design, {gait} gait")
        axes[1, column].set(xlabel="time (s)")
    axes[0, 0].set(ylabel="forward travel (cm)")
    axes[1, 0].set(ylabel="moment of the damping (N mm)")
    axes[0, 0].legend(fontsize="small")
    return figure


def main(out: Path = Path("runs/damping"), processes: int = 1, duration_s: float = 8.0) -> None:
    """Walk everything, compare and draw.

    Args:
        out: Folder of the walks, the summary and the figure.
        processes: Walks side by side.
        duration_s: Length of a walk [s].
    """
    files = {way: out / f"{'_'.join(way)}.json" for way in product(DESIGNS, GAITS, DAMPINGS)}
    missing = [way for way, path in files.items() if not path.exists()]
    made = run_tasks(walk, duration_s, missing, ExecutorSettings(process_count=processes))
    for number, found in made:
        write_json(files[missing[number]], {"duration_s": duration_s, **found})
        print(f"{' '.join(missing[number])}: {found['distance_cm']:.2f} cm", flush=True)
    ways = {path.stem: made_once(path, dict, duration_s=duration_s) for path in files.values()}
    write_json(out / "damping.json", {key: described(way) for key, way in ways.items()})
    save_figure(damping_figure(ways), out / "damping.png", ("png",))


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
