"""Measure how fast robots are simulated on this machine.

`engine`: reduced robots drawn from a design space, the paper's or that of --robot, walk under
random gaits. `full`: a whole robot of finite elements walks the expert's gait on one thread, timed
by stage of a step. The machine's matrix-product rate is measured in the same run, because steps per
second mean nothing without it.

Example: pneumorph bench engine --json

Example: pneumorph bench full --json
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

import tyro

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_settings import chosen_robot
from pneumorph.command.verb import Verb, flat
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.open_loop_gait import commands_of
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.brought_gait import brought_gait
from pneumorph.study.brought_learning import brought_learning
from pneumorph.study.engine_benchmark import EngineBenchmark, EngineSpeed, bench_engine
from pneumorph.study.full_benchmark import FullBenchmark, StepTimes, bench_full


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

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """The designs, the regulators and the pressures that the robot brings with it."""
        learning = brought_learning(content, below, chosen_robot(content))
        highest_kPa = learning["task"].get("maximum_pressure_kPa")
        gait = brought_gait(content, below, None, None, below["expert"])
        benchmark = {} if highest_kPa is None else {"maximum_kPa": highest_kPa}
        return {"space": learning["space"], "benchmark": benchmark, **gait}

    def idle_settings(self) -> dict[str, str]:
        """Those of the other subject."""
        other = {"engine": ("full_benchmark", "design", "expert"), "full": ("benchmark", "space")}
        return dict.fromkeys(other[self.subject], f"of `bench {self.subject}`")


def bench(options: BenchOptions, folder: RunFolder) -> EngineSpeed | StepTimes:
    """Measure what was asked for."""
    spec = options.robot.spec()
    if options.subject == "engine":
        folder.progress.stage("measuring the engine")
        space, count = options.space, options.benchmark.robot_count
        designs = space.designs if space.is_listed else space.some(count)
        return bench_engine(options.benchmark, spec, designs)
    folder.progress.stage("measuring a full robot's steps")
    commands = commands_of(options.expert, spec.physics.time_step_s, spec.physics.regulator_count)
    times = bench_full(options.full_benchmark, spec.full(options.design), commands, folder.progress)
    hub, said = options.robot.full.hub, spec.describe(reduced=False)
    return replace(times, design=options.design, hub=hub, **said)


VERB = Verb(BenchOptions, bench)
