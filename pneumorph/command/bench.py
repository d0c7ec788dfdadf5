"""Measure how fast the engine is on this machine.

Robots drawn from the paper's design space walk under random gaits. The machine's own matrix-product
rate is measured in the same run, because a figure in steps per second says nothing without it.

Example: pneumorph bench engine --json
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
import tyro

from pneumorph.command.robots import RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.robot import Robot
from pneumorph.simulation.benchmark import EngineBenchmark, bench_engine

flat = tyro.conf.arg(name="")


@dataclass(frozen=True)
class BenchOptions:
    """What to measure."""

    subject: tyro.conf.Positional[Literal["engine"]] = "engine"
    """The batched stepper."""
    benchmark: Annotated[EngineBenchmark, flat] = field(default_factory=EngineBenchmark)
    space: DesignSpace = field(default_factory=DesignSpace)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)


def bench(options: BenchOptions, folder: RunFolder) -> dict[str, Any]:
    """Run the benchmark and return its figures."""
    folder.progress.stage("measuring the engine")
    workshop = Workshop(options.robot)

    def draw_robots(generator: np.random.Generator, count: int) -> Sequence[Robot]:
        drawn = generator.integers(len(options.space), size=count)
        return [workshop.robot(options.space[int(index)]) for index in drawn]

    return bench_engine(
        options.benchmark, options.robot.simulation, draw_robots, options.robot.threads
    )


VERB = Verb(BenchOptions, bench)
