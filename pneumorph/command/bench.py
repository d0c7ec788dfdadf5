"""Measure how fast robots are simulated on this machine.

`engine`: reduced robots drawn from the paper's design space walk under random gaits. `full`: the
finite elements of a whole robot walk the expert's gait, on one thread, by stage of a step. The
machine's own matrix-product rate is measured in the same run, because a figure in steps per second
says nothing without it. `--profile` shows the stages of a step over batch sizes, leg counts, mode
counts and threads, as a table and a figure.

Example: pneumorph bench engine --json

Example: pneumorph bench engine --profile

Example: pneumorph bench full --json
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Annotated, Any, Literal

import numpy as np
import tyro

from pneumorph.command.robots import RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.fem.benchmark import FullBenchmark, bench_full
from pneumorph.gait.expert_gait import BASELINE_DESIGN, ExpertGait
from pneumorph.presets import paper_robot_builder
from pneumorph.report.engine_figure import engine_figure
from pneumorph.report.style import save_figure
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.robot import Robot
from pneumorph.robot.truncated_part import truncated_part
from pneumorph.simulation.benchmark import EngineBenchmark, bench_engine
from pneumorph.simulation.engine_profile import EngineProfile, profile_engine

flat = tyro.conf.arg(name="")


@dataclass(frozen=True)
class BenchOptions:
    """What to measure."""

    subject: tyro.conf.Positional[Literal["engine", "full"]] = "engine"
    """The batched stepper of reduced robots, or a robot of finite elements."""
    benchmark: Annotated[EngineBenchmark, flat] = field(default_factory=EngineBenchmark)
    profile: bool = False
    """Of `engine`: also time the stages over batch sizes, leg counts, mode counts and threads."""
    engine_profile: EngineProfile = field(default_factory=EngineProfile)
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

    cut = cache(lambda modes: paper_robot_builder(truncated_part(workshop.leg, modes)))

    def draw_robots(
        generator: np.random.Generator,
        count: int,
        legs: int | None = None,
        modes: int | None = None,
    ) -> Sequence[Robot]:
        allowed = [
            index
            for index in range(len(options.space))
            if legs is None or options.space[index].leg_count == legs
        ]
        if not allowed:
            raise ValueError(f"no design has {legs} legs; change engine_profile.legs or the space")
        build = workshop.robot if modes is None else cut(modes)
        drawn = generator.integers(len(allowed), size=count)
        return [build(options.space[allowed[int(index)]]) for index in drawn]

    figures = bench_engine(
        options.benchmark, workshop.simulation, draw_robots, options.robot.threads
    )
    figures = {
        "calibration": workshop.calibration_description,
        "leg": workshop.leg_description,
        **figures,
    }
    if options.profile:
        folder.progress.stage("profiling the engine")
        rows = profile_engine(
            options.engine_profile,
            options.benchmark,
            workshop.simulation,
            draw_robots,
            workshop.leg.mode_count,
            options.robot.threads,
            folder.progress,
        )
        save_figure(engine_figure(rows), folder / "engine_profile.png")
        figures["profile"] = rows
    return figures


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
