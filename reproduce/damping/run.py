"""What the published damping does to a walk: two designs, two gaits, both dampings, full order.

    python reproduce/damping/run.py --out runs/damping [--processes 2] [--duration-s 8]

One file for each walk, so that a run that was stopped goes on; then damping.json and damping.png.
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.artefact import write_json
from pneumorph.fem.false_moment import false_moment
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.gait.expert_gait import BASELINE_DESIGN, ExpertGait
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.open_loop_gait import sample_commands
from pneumorph.presets import paper_full_robot
from pneumorph.report.style import (
    BASELINE_COLOUR,
    LEARNED_COLOUR,
    figure_style,
    new_figure,
    save_figure,
)
from pneumorph.robot.design import Design
from pneumorph.simulation.simulation_settings import SimulationSettings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(__file__).parent
DESIGNS = {"expert": BASELINE_DESIGN, "learned": "0.0.0.1.1.2.0.0"}
GAITS = ("expert", "learned")
DAMPINGS = ("published", "objective")
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
            grip.append(float(used / max(robot.settings.friction * normal, 1e-12)))
        self.series["slipping"].append(slipping)
        self.series["grip"].append(grip)
        moment = false_moment(robot, state)
        self.series["damping_Nmm"].append(float(np.linalg.norm(moment.damping)))
        self.series["elasticity_Nmm"].append(float(np.linalg.norm(moment.elasticity)))


def walk(arguments: tuple[str, str, str, float, Path]) -> None:
    """Walk one design with one gait under one damping and save what happened."""
    design, gait_name, damping, duration_s, folder = arguments
    path = folder / f"{design}_{gait_name}_{damping}.json"
    if path.exists():
        there = json.loads(path.read_text())["duration_s"]
        if there != duration_s:
            raise ValueError(
                f"{path} is of {there:g} s, expected {duration_s:g}; choose another --out"
            )
        return
    gait = ExpertGait(phase_deg=110.0)
    if gait_name == "learned":
        gait, _ = read_gait(HERE / "learned_gait.csv")
    settings = SimulationSettings(damping=damping)
    robot = paper_full_robot(Design.parse(DESIGNS[design]), settings)
    commands = sample_commands(gait, settings.time_step_s, round(duration_s / settings.time_step_s))
    observer = Observer(robot)
    _, trajectory = robot.rollout(
        robot.settled_state(), commands, record_nodes=False, observe=observer
    )
    write_json(
        path,
        {
            "design": DESIGNS[design],
            "gait": gait_name,
            "damping": damping,
            "duration_s": duration_s,
            "status": trajectory.status,
            "distance_cm": trajectory.forward_distance_cm,
            "contact": trajectory.metadata["contact"],
            "weight_moment_Nmm": _weight_moment(robot),
            **observer.series,
        },
    )
    print(f"wrote {path}: {trajectory.forward_distance_cm:.2f} cm", flush=True)


def _weight_moment(robot: FullRobot) -> float:
    """Weight of a leg times its distance from the robot's axis, a scale for moments [N mm]."""
    leg = robot.legs[0]
    arm = np.linalg.norm(leg.initial_positions().mean(axis=0)[:2])
    return float(1e-3 * leg.part.mass_kg * robot.settings.gravity_mm_per_s2 * arm)


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
            time_s = 0.01 * np.arange(1, len(way["x_mm"]) + 1)
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


def main() -> None:
    """Walk everything, compare and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("runs/damping"))
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--duration-s", type=float, default=8.0)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    walks = [
        (design, gait, damping, options.duration_s, options.out)
        for design, gait, damping in product(DESIGNS, GAITS, DAMPINGS)
    ]
    with ProcessPoolExecutor(options.processes) as pool:
        list(pool.map(walk, walks))
    ways = {
        "_".join(names): json.loads((options.out / f"{'_'.join(names)}.json").read_text())
        for names in product(DESIGNS, GAITS, DAMPINGS)
    }
    write_json(options.out / "damping.json", {key: described(way) for key, way in ways.items()})
    save_figure(damping_figure(ways), options.out / "damping.png", ("png",))
    print(f"wrote {options.out / 'damping.json'} and {options.out / 'damping.png'}")


if __name__ == "__main__":
    main()
