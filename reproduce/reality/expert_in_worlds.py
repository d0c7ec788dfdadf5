"""The expert's robot over all phases, in worlds of what nobody has measured, beside the real one.

The paper says of its real robot: 4 to 5 cm in 20 s, best at 110 degrees, 1.2 cm back in a cycle.
Each physics makes a band of each, from its 10th to its 90th percentile over the worlds; of the best
phase, which is an angle, the shortest arc that holds as many.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.base.run_folder import made_once
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.part_physics import PhysicsName
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.walk import walk
from pneumorph.report.style import figure_style, new_figure
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.randomised_simulator import simulator_in_worlds
from pneumorph.study.robustness import draw_worlds
from pneumorph.study.sensitivity import Sensitivity, sensitivities

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PHASES_DEG = tuple(range(10, 360, 20))
PAPERS_PHASE_DEG = 110
WORLD_COUNT = 48
PERCENTILES = (10.0, 50.0, 90.0)


@dataclass(frozen=True)
class Stated:
    """What the paper says of its real robot, from the least to the most that its words allow."""

    what: str
    least: float
    most: float


STATED = {
    "distance_cm": Stated("distance at 110°, its best (cm)", 4.0, 5.0),
    "best_phase_deg": Stated("best phase (°)", 110.0, 110.0),
    "backsliding_cm": Stated("back in a cycle at 110° (cm)", 1.2, 1.2),
}


def walks(physics: PhysicsName, world: World) -> dict[str, list[float]]:
    """Distance and mean slide back in a cycle at every phase [cm], in one world."""
    spec = paper_robot(physics)
    gaits = [ExpertGait(phase_deg=float(phase)) for phase in PHASES_DEG]
    robots = [spec.assembly(BASELINE_DESIGN)] * len(gaits)
    walked = walk(
        simulator_in_worlds(
            robots, [world] * len(robots), spec.physics, spec.stepper, spec.thread_count
        ),
        gaits,
        duration_s=gaits[0].duration_s,
        time_step_s=spec.physics.time_step_s,
    )
    return {
        "distance_cm": walked.distance_cm.tolist(),
        "backsliding_cm": walked.backsliding_cm(gaits[0].period_s).tolist(),
        "range_ratio": walked.range_ratio.tolist(),
    }


def shortest_arc(angles_deg: np.ndarray, share: float) -> list[float]:
    """Where the shortest arc that holds a share of angles begins and ends [deg], in the sense of
    growing angles; it may cross 360.

    Args:
        angles_deg: The angles, (angle,) [deg].
        share: How many of them it holds.
    """
    angles = np.sort(np.mod(angles_deg, 360.0))
    held = int(np.ceil(share * len(angles) - 1e-9))
    ends = np.concatenate([angles, angles + 360.0])[held - 1 : held - 1 + len(angles)]
    first = int(np.argmin(ends - angles))
    return [float(angles[first]), float(np.mod(ends[first], 360.0))]


def on_arc(angle_deg: float, arc_deg: list[float]) -> bool:
    """Whether an angle lies on an arc, as `shortest_arc` gives it [deg]."""
    start, end = arc_deg
    return bool(np.mod(angle_deg - start, 360.0) <= np.mod(end - start, 360.0))


def bands(made: list[dict[str, list[float]]], worlds: list[World]) -> dict[str, Any]:
    """Percentiles over worlds of what the paper states, and at every phase, what the distance
    depends on, and each world; failed walks are left out and counted."""
    distance, slide, ratio = (
        np.array([each[name] for each in made], dtype=float)
        for name in ("distance_cm", "backsliding_cm", "range_ratio")
    )
    at = PHASES_DEG.index(PAPERS_PHASE_DEG)

    def percentiles(values: np.ndarray) -> list[float]:
        return [float(each) for each in np.nanpercentile(values, PERCENTILES)]

    best = np.array(PHASES_DEG)[np.nanargmax(distance, axis=1)]
    found = {
        "distance_cm": percentiles(distance[:, at]),
        "best_phase_deg": shortest_arc(best, (PERCENTILES[-1] - PERCENTILES[0]) / 100.0),
        "backsliding_cm": percentiles(slide[:, at]),
    }
    return {
        "bands": found,
        "contained": {
            name: on_arc(stated.least, found[name])
            if name == "best_phase_deg"
            else found[name][0] <= stated.most and found[name][-1] >= stated.least
            for name, stated in STATED.items()
        },
        "best_distance_cm": percentiles(np.nanmax(distance, axis=1)),
        "by_phase_cm": np.nanpercentile(distance, PERCENTILES, axis=0).tolist(),
        "depends_on": [asdict(each) for each in _depends_on(distance[:, at], worlds)],
        "worlds": len(distance),
        "in_world": [
            {
                "around_110_cm": np.round(distance[k, at - 1 : at + 2], 2).tolist(),
                "backsliding_cm": round(float(slide[k, at]), 2),
                "best_phase_deg": int(best[k]),
                "best_distance_cm": round(float(np.nanmax(distance[k])), 2),
                "surface_friction": {n: round(v, 2) for n, v in world.friction_by_surface},
                "friction": round(world.friction, 2),
                "floor_slope_deg": round(world.floor_slope_deg, 2),
            }
            for k, world in enumerate(worlds)
        ],
        "failed_walks": int(np.isnan(distance).sum()),
        "left_range_share": float(np.mean(ratio > 1.2)),
    }


def _depends_on(distance_cm: np.ndarray, worlds: list[World]) -> tuple[Sensitivity, ...]:
    walked = ~np.isnan(distance_cm)
    kept = [world.numbers for world, fine in zip(worlds, walked, strict=True) if fine]
    numbers = {name: np.array([each[name] for each in kept]) for name in kept[0]}
    return sensitivities(numbers, distance_cm[walked])


@figure_style()
def bands_figure(found: dict[str, dict[str, Any]]) -> Figure:
    """Distance over phase in each physics, and what the paper says of the real robot."""
    figure = new_figure(5.0, 3.2)
    axes = figure.add_subplot()
    for name, each in found.items():
        low, middle, high = each["by_phase_cm"]
        (line,) = axes.plot(PHASES_DEG, middle, label=f"{name} physics")
        axes.fill_between(PHASES_DEG, low, high, color=line.get_color(), alpha=0.2, linewidth=0)
    real = STATED["distance_cm"]
    axes.plot(2 * [PAPERS_PHASE_DEG], [real.least, real.most], "k", linewidth=3, label="real robot")
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set(
        xlabel="phase (°)", ylabel="distance in 20 s (cm)", xlim=(PHASES_DEG[0], PHASES_DEG[-1])
    )
    axes.legend(fontsize="x-small")
    return figure


def expert_bands(out: Path) -> dict[str, dict[str, Any]]:
    """Bands of both physics; finished worlds are not walked again."""
    found = {}
    worlds = draw_worlds(measured_worlds(), WORLD_COUNT, 0)
    for physics in ("published", "measured"):
        made = []
        for number, world in enumerate(worlds):
            path = out / "expert_in_worlds" / physics / f"{number}.json"
            made.append(made_once(path, partial(walks, physics, world), **asdict(world)))
            print(f"{physics} physics, world {number + 1} of {WORLD_COUNT}", flush=True)
        found[physics] = bands(made, worlds)
    return found
