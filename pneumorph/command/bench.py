"""Measure how fast robots are simulated on this machine.

`engine`: reduced robots drawn from the paper's design space walk under random gaits. `full`: the
finite elements of a whole robot walk the expert's gait, on one thread, by stage of a step. The
machine's own matrix-product rate is measured in the same run, because a figure in steps per second
says nothing without it.

Example: pneumorph bench engine --json

Example: pneumorph bench full --json
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
from pneumorph.fem.benchmark import FullBenchmark, bench_full
from pneumorph.gait.expert_gait import BASELINE_DESIGN, ExpertGait
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.robot import Robot
from pneumorph.simulation.benchmark import EngineBenchmark, bench_engine

flat = tyro.conf.arg(name="")


@dataclass(frozen=True)
class BenchOptions:
    """What to measure."""

    subject: tyro.conf.Positional[Literal["engine", "full"]] = "engine"
    """The batched stepper of reduced robots, or a robot of finite elements."""
    benchmark: Annotated[EngineBenchmark, flat] = field(default_factory=EngineBenchmark)
    full_benchmark: FullBenchmark = field(default_factory=FullBenchmark)
    design: str = BASELINE_DESIGN
    """Robot of `full`: regulator of each location, 0 for no leg."""
    expert: ExpertGait = field(default_factory=ExpertGait)
    space: DesignSpace = field(default_factory=DesignSpace)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)


def bench(options: BenchOptions, folder: RunFolder) -> dict[str, Any]:
    """Run the benchmark and return its figures."""
    workshop = Workshop(options.robot)
    if options.subject == "full":
        return _bench_full(options, workshop, folder)
    folder.progress.stage("measuring the engine")

    def draw_robots(generator: np.random.Generator, count: int) -> Sequence[Robot]:
        drawn = generator.integers(len(options.space), size=count)
        return [workshop.robot(options.space[int(index)]) for index in drawn]

    figures = bench_engine(
        options.benchmark, workshop.simulation, draw_robots, options.robot.threads
    )
    return {
        "calibration": workshop.calibration_description,
        "leg": workshop.leg_description,
        **figures,
    }


def _bench_full(options: BenchOptions, workshop: Workshop, folder: RunFolder) -> dict[str, Any]:
    folder.progress.stage("measuring a full robot's steps")
    robot = workshop.full(Design.parse(options.design))
    figures = bench_full(
        options.full_benchmark, robot, workshop.commands(options.expert), folder.progress
    )
    return {
        "design": options.design,
        "hub": options.robot.full.hub,
        "calibration": workshop.calibration_description,
        **figures,
    }


VERB = Verb(BenchOptions, bench)
