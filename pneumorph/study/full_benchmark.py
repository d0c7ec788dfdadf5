"""How long a step of a robot of finite elements takes on this machine, and where it goes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu

from pneumorph.base.checked import Checked, Count, CountOrNone
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.fem.body_equations import linearly_implicit_equations
from pneumorph.fem.frontal_cholesky import FrontalCholesky, FrontPattern
from pneumorph.fem.full_robot import FullRobot
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics

STAGES = ("assembly", "factorisation", "elimination", "friction")
"""What a full-order robot's clock counts."""


@dataclass(frozen=True)
class FullBenchmark(Checked):
    """What to measure of a full-order robot."""

    settling_steps: CountOrNone = 15
    """Time steps at zero pressure at the start, not timed: the robot falls on the floor."""
    walking_steps: CountOrNone = 50
    """Time steps of the gait before timing begins: the legs inflate and press on the floor."""
    timed_steps: Count = 41
    """Time steps of the gait that are timed."""
    repetitions: Count = 15
    """How often a factorisation and a matrix product are timed."""


@dataclass(frozen=True)
class StepTimes:
    """What was measured of a full-order robot, all linear algebra on one thread."""

    seconds_per_step: float
    """The step of median time [s]. Assembly, factorisation, contact and other add up to it."""
    assembly_seconds: float
    factorisation_seconds: float
    """Of all legs."""
    contact_seconds: float
    """The next two together."""
    elimination_seconds: float
    """Columns of the contacts through the legs' factors."""
    friction_seconds: float
    """The friction solver."""
    other_seconds: float
    slowest_step_seconds: float
    cpu_seconds_per_step: float
    """Less than the wall time where other work took the processor."""
    leg_factorisation_seconds: float
    """The yardstick: one leg's matrix by SciPy's sparse direct solver (SuperLU), median."""
    factorisations_per_step: float
    """A step's time over the yardstick."""
    front_factorisation_seconds: float
    """The same matrix by the front that the step uses."""
    front_factorisations_per_step: float
    unknowns: int
    largest_front: int
    factorisation_gflop: float
    """These three are of the leg."""
    dgemm_gflops: float
    """Rate of double-precision matrix products [GFLOP/s]."""
    legs: int
    contact_count: float
    """Mean of the timed steps."""
    timed_steps: int
    threads: int
    design: str | None = None
    hub: str | None = None
    damping: str | None = None
    calibration: UsedCalibration | None = None
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""


def bench_full(
    settings: FullBenchmark,
    robot: FullRobot,
    commands_kPa: np.ndarray,
    progress: Callable[[int, int], None],
) -> StepTimes:
    """Time the steps of a robot that walks, with all linear algebra on one thread.

    Args:
        settings: What to measure.
        robot: The robot.
        commands_kPa: Real pressure asked for in every step after settling [kPa], (step, regulator).
        progress: Called with the steps made and those to make.

    Raises:
        ValueError: The commands are too few.
    """
    from threadpoolctl import threadpool_info, threadpool_limits

    needed = settings.walking_steps + settings.timed_steps
    if len(commands_kPa) < needed:
        raise ValueError(
            f"commands_kPa has {len(commands_kPa)} steps, expected {needed} or more: walking_steps "
            "and timed_steps are longer than the gait"
        )
    with threadpool_limits(1, user_api="blas"):
        blas = [pool for pool in threadpool_info() if pool["user_api"] == "blas"]
        state = robot.settled_state(settings.settling_steps)
        totals, processor, contacts, stages = [], [], [], []
        for number, command in enumerate(commands_kPa[:needed]):
            robot.clock.clear()
            start, used = time.perf_counter(), time.thread_time()
            state = robot.step(state, command)
            seconds, used = time.perf_counter() - start, time.thread_time() - used
            if number >= settings.walking_steps:
                totals.append(seconds)
                processor.append(used)
                contacts.append(state.active_contacts)
                stages.append({stage: robot.clock.seconds[stage] for stage in STAGES})
            progress(number + 1, needed)
        middle = int(np.argsort(totals)[(len(totals) - 1) // 2])
        total, spent = totals[middle], stages[middle]

        leg = robot.legs[0]
        pressure = robot.physics.pressure_map.simulated(state.regulated_kPa)
        data, _ = linearly_implicit_equations(
            leg.part,
            state.positions[0],
            state.velocities[0],
            leg.pressure_of(pressure),
            robot.physics,
        )
        pattern = FrontPattern(leg.part.assembly, leg.tie.nodes)
        inner = leg.part.assembly.matrix(data)[pattern.unknowns][:, pattern.unknowns].tocsc()
        front = _median_seconds(lambda: FrontalCholesky(pattern, data), settings.repetitions)
        general = _median_seconds(
            lambda: splu(
                inner,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            ),
            max(settings.repetitions // 3, 1),
        )
        square = np.random.default_rng(0).random((768, 768))
        product = _median_seconds(lambda: square @ square, settings.repetitions)
    return StepTimes(
        seconds_per_step=total,
        assembly_seconds=spent["assembly"],
        factorisation_seconds=spent["factorisation"],
        contact_seconds=spent["elimination"] + spent["friction"],
        elimination_seconds=spent["elimination"],
        friction_seconds=spent["friction"],
        other_seconds=total - sum(spent.values()),
        slowest_step_seconds=max(totals),
        cpu_seconds_per_step=processor[middle],
        leg_factorisation_seconds=general,
        factorisations_per_step=total / general,
        front_factorisation_seconds=front,
        front_factorisations_per_step=total / front,
        unknowns=len(pattern.unknowns),
        largest_front=pattern.largest_front,
        factorisation_gflop=pattern.operation_count / 1e9,
        dgemm_gflops=2.0 * len(square) ** 3 / product / 1e9,
        legs=len(robot.legs),
        contact_count=float(np.mean(contacts)),
        timed_steps=len(totals),
        threads=max((pool["num_threads"] for pool in blas), default=1),
    )


def _median_seconds(function: Callable[[], object], repetitions: int) -> float:
    """Median time of a call, after one that is not counted [s]."""
    function()
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return float(np.median(times))
