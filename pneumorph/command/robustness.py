"""How pairs fare in worlds drawn at random, and how their ranking changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pneumorph.command.robots import Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.gait.open_loop_gait import OpenLoopGait
from pneumorph.gait.walk import walk
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.simulation.randomised_simulator import simulator_in_world


def distances_in_worlds(
    workshop: Workshop,
    designs: Sequence[Design],
    gaits: Sequence[OpenLoopGait],
    worlds: Sequence[World],
    settling_steps: int,
    folder: RunFolder,
) -> np.ndarray:
    """Walk every pair in every world.

    Returns:
        Distances [cm], (world, pair); NaN where a simulation failed.
    """
    robots = [workshop.robot(design) for design in designs]
    distances = []
    for number, world in enumerate(worlds, start=1):
        simulator = simulator_in_world(robots, world, workshop.simulation, workshop.options.threads)
        walked = walk(
            simulator,
            gaits,
            duration_s=gaits[0].duration_s,
            time_step_s=workshop.simulation.time_step_s,
            settling_step_count=settling_steps,
            record_step_count=100,
        )
        distances.append(walked.distance_cm)
        folder.progress(number, len(worlds), "walking in worlds")
    return np.array(distances)


def draw_worlds(randomisation: Randomisation, count: int, seed: int) -> list[World]:
    """Worlds of a seed."""
    rng = np.random.default_rng([seed, 5])
    return [randomisation.draw(rng) for _ in range(count)]


def robustness(
    labels: Sequence[str], nominal_cm: np.ndarray, distances_cm: np.ndarray
) -> dict[str, Any]:
    """Summarise distances over worlds.

    Args:
        labels: Name of each pair, best first.
        nominal_cm: Distance of each in the simulated world as it stands [cm], (pair,).
        distances_cm: Distances [cm], (world, pair); a failed simulation (NaN) counts as 0.

    Returns:
        For each pair mean, standard deviation, 10th percentile and share of worlds in which it is
        the best; the rankings by nominal and by mean distance, and Kendall's tau between them.
    """
    from scipy.stats import kendalltau

    failed = int(np.isnan(distances_cm).sum())
    distances = np.nan_to_num(distances_cm, nan=0.0)
    mean = distances.mean(axis=0)
    best = np.argmax(distances, axis=1)
    tau = kendalltau(nominal_cm, mean).statistic if len(labels) > 1 else None
    return {
        "world_count": len(distances),
        "failed_count": failed,
        "nominal_ranking": [labels[i] for i in np.argsort(-nominal_cm, kind="stable")],
        "robust_ranking": [labels[i] for i in np.argsort(-mean, kind="stable")],
        "kendall_tau": None if tau is None else float(tau),
        "pairs": [
            {
                "label": label,
                "nominal_distance_cm": float(nominal_cm[i]),
                "mean_distance_cm": float(mean[i]),
                "deviation_cm": float(distances[:, i].std(ddof=1)) if len(distances) > 1 else None,
                "tenth_percentile_cm": float(np.percentile(distances[:, i], 10)),
                "best_share": float(np.mean(best == i)),
            }
            for i, label in enumerate(labels)
        ],
    }
