"""A gait found by an optimiser that knows nothing of robots: CMA-ES of the ``cmaes`` library.

python examples/search_a_gait.py     # about a minute
"""

from __future__ import annotations

import numpy as np
from cmaes import CMA

import pneumorph as pm

PERIOD = 4
"""Actions of a gait, which is repeated until the episode ends."""


def search(
    generations: int = 40, robots: int = 16, task: pm.CrawlingTask | None = None
) -> tuple[np.ndarray, float]:
    """The gait that takes the expert's design farthest in an episode, and how far [cm]."""
    environment = pm.make_env(num_envs=robots, design="1.0.0.2.2.0.0.1", task=task)
    regulators = environment.task.regulator_count
    bounds = np.tile((-1.0, 1.0), (PERIOD * regulators, 1))
    optimiser = CMA(np.zeros(len(bounds)), 0.5, bounds, population_size=robots, seed=0)
    best_gait, best_cm = np.zeros((PERIOD, regulators)), -np.inf
    for generation in range(generations):
        points = [optimiser.ask() for _ in range(robots)]
        gaits = np.reshape(points, (robots, PERIOD, regulators))
        environment.reset(seed=0)
        for action in range(environment.task.action_count):
            *_, info = environment.step(gaits[:, action % PERIOD])
        optimiser.tell(list(zip(points, -info["distance_cm"], strict=True)))
        farthest = np.argmax(info["distance_cm"])
        if info["distance_cm"][farthest] > best_cm:
            best_gait, best_cm = gaits[farthest], info["distance_cm"][farthest]
        print(f"generation {generation}: {best_cm:.2f} cm")
    return best_gait, float(best_cm)


if __name__ == "__main__":
    search()
