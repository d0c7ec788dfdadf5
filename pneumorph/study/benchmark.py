"""How long a step of a robot takes on this machine, beside what the machine can do."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu

from pneumorph.base.checked import Checked, Count, CountOrNone, Positive
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.body_equations import linearly_implicit_equations
from pneumorph.fem.frontal_cholesky import FrontalCholesky, FrontPattern
from pneumorph.fem.full_robot import FullRobot
from pneumorph.robot.design import Design

STAGES = ("assembly", "factorisation", "elimination", "friction")
"""What a full-order robot's clock counts."""


@dataclass(frozen=True)
class EngineBenchmark(Checked):
    """What to measure of reduced robots."""

    robot_count: Count = 96
    """Robots in the batch."""
    action_count: Count = 6
    """Random actions, each held for `action_steps`."""
    action_steps: Count = 100
    """Time steps of an action."""
    settling_steps: CountOrNone = 15
    """Time steps at zero pressure first, not counted."""
    maximum_kPa: Positive = 90.0
    """Upper end of the random commands [real kPa]."""
    seed: CountOrNone = 0
    """Of designs and commands."""


@dataclass(frozen=True)
class FullBenchmark(Checked):
    """What to measure of a full-order robot."""

    settling_steps: CountOrNone = 15
    """Steps at zero pressure first, not counted: the robot falls."""
    walking_steps: CountOrNone = 50
    """Steps of the gait next, not counted: the legs are inflated and press on the floor."""
    timed_steps: Count = 41
    """Steps of the gait that are timed."""
    repetitions: Count = 15
    """Factorisations and matrix products that are timed."""


def bench_engine(
    settings: EngineBenchmark, spec: RobotSpec, designs: Sequence[Design]
) -> dict[str, Any]:
    """Time reduced robots of random designs under random gaits.

    Args:
        settings: What to measure.
        spec: The robot; its threads are those of the measurement.
        designs: Those that are drawn from, such as those of a `DesignSpace`.

    Returns:
        ``env_steps_per_s`` (robot steps a second, all threads), ``threads``, ``modes``,
        ``elements`` (sampled tetrahedra and triangles of a part), ``mean_legs``,
        ``mean_contacts``, ``mean_sweeps``, ``fresh_tangent_share`` (of the legs' steps),
        ``tangent_error_share`` (predictions of kept stiffnesses that were wrong by more than the
        tolerance, for each step of a robot), ``worst_tangent_error_mm_per_s``,
        ``stage_seconds`` (thread time of an equal profiled run), ``gemm_gflops`` (single
        precision, same threads), ``steps_per_gflop``, ``statuses``.
    """
    generator = np.random.default_rng(settings.seed)
    drawn = generator.integers(len(designs), size=settings.robot_count)
    robots = [spec.assembly(designs[int(index)]) for index in drawn]
    simulator = spec.simulator(robots)
    shape = (settings.action_count, settings.robot_count, spec.physics.regulator_count)
    commands = generator.uniform(0.0, settings.maximum_kPa, shape)

    def run(profile: bool) -> float:
        simulator.reset()
        simulator.advance(np.zeros(shape[1:]), settings.settling_steps)
        simulator.clear_counters()
        start = time.perf_counter()
        for command in commands:
            simulator.advance(command, settings.action_steps, profile=profile)
        return time.perf_counter() - start

    before = matrix_product_gflops(simulator.thread_count)
    run(profile=True)
    stages = simulator.stage_seconds
    seconds = run(profile=False)
    gflops = max(before, matrix_product_gflops(simulator.thread_count))
    parts = [mount.part for robot in robots for mount in robot.mounts]
    legs = np.array([len(robot.mounts) for robot in robots])
    counted = simulator.read("step_count")
    steps = float(counted.sum())

    def each_step(name: str) -> float:
        return float(simulator.read(name).sum() / steps)

    def worst(name: str) -> float:
        return float(simulator.read(name).max())

    return {
        "env_steps_per_s": steps / seconds,
        "steps_per_gflop": steps / seconds / gflops,
        "gemm_gflops": gflops,
        "gemm_threads": simulator.thread_count,
        "gemm_precision": "single",
        "threads": simulator.thread_count,
        "instruction_set": simulator.instruction_set,
        "element_precision": spec.stepper.element_precision,
        "modes": max(part.mode_count for part in parts),
        "elements": {
            "tetrahedra": max(len(part.tetrahedron_rest) for part in parts),
            "membrane_triangles": max(len(part.membrane_rest) for part in parts),
        },
        "robots": settings.robot_count,
        "mean_legs": float(legs.mean()),
        "mean_contacts": each_step("contact_total"),
        "mean_sweeps": each_step("sweep_total"),
        "mean_newton_steps": each_step("newton_total"),
        "fresh_tangent_share": float(simulator.read("tangent_total").sum() / (counted @ legs)),
        "tangent_error_share": each_step("tangent_error_total"),
        "worst_tangent_error_mm_per_s": worst("worst_tangent_error"),
        "unconverged_share": each_step("unconverged_total"),
        "worst_residual_mm_per_s": worst("worst_residual"),
        "worst_penetration_mm": worst("worst_penetration"),
        "stage_seconds": {name: float(value) for name, value in stages.items()},
        "statuses": np.bincount(simulator.status, minlength=2).tolist(),
        "steps": int(steps),
        "wall_s": seconds,
    }


def matrix_product_gflops(thread_count: int, size: int = 768, repetitions: int = 12) -> float:
    """Single-precision matrix-product rate with one product in each thread [GFLOP/s].

    One product a thread, as the stepper runs one robot a thread, so the figure does not depend on
    whether the linear-algebra library was told to use threads of its own.
    """
    pairs = [
        np.random.default_rng(t).random((2, size, size), dtype=np.float32)
        for t in range(thread_count)
    ]

    def multiply(pair: np.ndarray) -> None:
        for _ in range(repetitions):
            pair[0] @ pair[1]

    best = 0.0
    with ThreadPoolExecutor(thread_count) as pool:
        for _ in range(4):
            start = time.perf_counter()
            list(pool.map(multiply, pairs))
            seconds = time.perf_counter() - start
            best = max(best, 2.0 * size**3 * repetitions * thread_count / seconds / 1e9)
    return best


def bench_full(
    settings: FullBenchmark,
    robot: FullRobot,
    commands_kPa: np.ndarray,
    progress: Callable[[int, int], None],
) -> dict[str, Any]:
    """Time the steps of a robot that walks, with all linear algebra on one thread.

    Args:
        settings: What to measure.
        robot: The robot.
        commands_kPa: Real pressure asked for in every step after settling [kPa], (step, regulator).
        progress: Called with the steps made and those to make.

    Returns:
        ``seconds_per_step``, of the step of median time, and of the same step ``assembly_seconds``,
        ``factorisation_seconds`` (of all legs), ``contact_seconds`` (the columns of the contacts
        through the legs' factors, ``elimination_seconds``, and the friction solver,
        ``friction_seconds``) and ``other_seconds``, which add up to it; ``slowest_step_seconds``;
        ``cpu_seconds_per_step``, less than the wall time where other work took the processor;
        ``leg_factorisation_seconds``, the yardstick: median for one leg's matrix at the end, in
        the same run, by SciPy's sparse direct solver (SuperLU), and ``factorisations_per_step``, a
        step's time over it; ``front_factorisation_seconds`` and ``front_factorisations_per_step``,
        the same by the front that the step uses; the leg's ``unknowns``, ``largest_front`` and
        ``factorisation_gflop``; ``dgemm_gflops``; ``legs``, ``contact_count`` (mean of the timed
        steps) and ``threads``.

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
            float(pressure[leg.regulator]),
            robot.physics,
        )
        pattern = FrontPattern(leg.part.assembly, leg.attachment)
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
    return {
        "seconds_per_step": total,
        "assembly_seconds": spent["assembly"],
        "factorisation_seconds": spent["factorisation"],
        "contact_seconds": spent["elimination"] + spent["friction"],
        "elimination_seconds": spent["elimination"],
        "friction_seconds": spent["friction"],
        "other_seconds": total - sum(spent.values()),
        "slowest_step_seconds": max(totals),
        "cpu_seconds_per_step": processor[middle],
        "leg_factorisation_seconds": general,
        "factorisations_per_step": total / general,
        "front_factorisation_seconds": front,
        "front_factorisations_per_step": total / front,
        "unknowns": len(pattern.unknowns),
        "largest_front": pattern.largest_front,
        "factorisation_gflop": pattern.operation_count / 1e9,
        "dgemm_gflops": 2.0 * len(square) ** 3 / product / 1e9,
        "legs": len(robot.legs),
        "contact_count": float(np.mean(contacts)),
        "timed_steps": len(totals),
        "threads": max((pool["num_threads"] for pool in blas), default=1),
    }


def _median_seconds(function: Callable[[], object], repetitions: int) -> float:
    """Median time of a call, after one that is not counted [s]."""
    function()
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return float(np.median(times))
