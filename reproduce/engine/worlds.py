"""What it costs that every robot of a batch has a world of its own.

    python reproduce/engine/worlds.py

96 random designs under random pressures, in one world and in 96 drawn ones of the measured physics,
in turn; prints the least time of each and their ratio.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
import tyro

from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.randomisation import World
from pneumorph.study.robustness import draw_worlds

ROBOTS, ACTIONS, ACTION_STEPS = 96, 10, 100


def main(repeats: int = 3, threads: int = 1) -> None:
    """Time both.

    Args:
        repeats: Times that each is timed.
        threads: Of the simulator.
    """
    spec, space = paper_robot("measured", thread_count=threads), DesignSpace()
    drawn = space.drawn(ROBOTS, np.random.default_rng(0))
    robots = [spec.assembly(space[int(index)]) for index in drawn]

    def seconds(worlds: Sequence[World]) -> float:
        simulator, rng = spec.simulator_in_worlds(robots, worlds), np.random.default_rng(1)
        simulator.advance(np.zeros((ROBOTS, 3)), 15)
        start = time.perf_counter()
        for _ in range(ACTIONS):
            simulator.advance(rng.uniform(0.0, 90.0, (ROBOTS, 3)), ACTION_STEPS)
        return time.perf_counter() - start

    one = [World.nominal(spec.physics)] * ROBOTS
    own = draw_worlds(measured_worlds(), ROBOTS, 0)
    found = [(seconds(one), seconds(own)) for _ in range(repeats)]
    least_one, least_own = (min(times) for times in zip(*found, strict=True))
    ratio = least_own / least_one
    print(f"{least_one:.1f} s in one world, {least_own:.1f} s in {ROBOTS}: {ratio:.2f}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
