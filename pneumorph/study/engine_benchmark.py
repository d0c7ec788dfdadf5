"""How many steps of reduced robots this machine makes, beside what it could compute."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone, Positive
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.robot.design import Design

_PRODUCT_SIZE, _PRODUCT_COUNT = 768, 12
"""Rows of the square matrices of a timed product, and how many products are timed together."""


@dataclass(frozen=True)
class EngineBenchmark(Checked):
    """What to measure of reduced robots."""

    robot_count: Count = 96
    """Robots in the batch."""
    action_count: Count = 6
    """Random actions, each held for --action-steps."""
    action_steps: Count = 100
    """Time steps of an action."""
    settling_steps: CountOrNone = 15
    """Time steps at zero pressure at the start, not counted."""
    maximum_kPa: Positive = 90.0
    """Upper end of the random commands [real kPa]."""
    seed: CountOrNone = 0
    """Seed of designs and commands."""


@dataclass(frozen=True)
class EngineSpeed:
    """What was measured of reduced robots."""

    env_steps_per_s: float
    """Robot steps a second, all threads together."""
    steps_per_gflop: float
    """The same for each GFLOP/s of matrix products, which compares machines."""
    gemm_gflops: float
    """Rate of single-precision matrix products on as many threads [GFLOP/s]."""
    gemm_threads: int
    gemm_precision: str
    threads: int
    instruction_set: str
    """What the engine ran."""
    element_precision: str
    modes: int
    elements: dict[str, int]
    """Sampled tetrahedra and triangles of a part."""
    robots: int
    mean_legs: float
    mean_contacts: float
    mean_sweeps: float
    mean_newton_steps: float
    """These three are of a robot in a step."""
    fresh_tangent_share: float
    """Share of the legs' steps that computed their stiffness anew."""
    tangent_error_share: float
    """Predictions of kept stiffnesses beyond the tolerance, for each step of a robot."""
    worst_tangent_error_mm_per_s: float
    unconverged_share: float
    """Contact solves that ended above their tolerance, for each step of a robot."""
    worst_residual_mm_per_s: float
    worst_penetration_mm: float
    stage_seconds: dict[str, float]
    """Thread time of each stage in an equal run that was profiled [s]."""
    statuses: tuple[int, ...]
    """Robots that walk, and that diverged."""
    steps: int
    wall_s: float
    damping: str
    calibration: UsedCalibration
    leg: PartsSummary
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
    robot_seconds_per_gflop: float | None = None
    """Simulated time of robots [s] in a second for each GFLOP/s, which compares time steps as well;
    None in files of earlier versions."""


def bench_engine(
    settings: EngineBenchmark, spec: RobotSpec, designs: Sequence[Design]
) -> EngineSpeed:
    """Time reduced robots of random designs under random gaits.

    Args:
        settings: What to measure.
        spec: The robot; its threads are those of the measurement.
        designs: Those that are drawn from, such as those of a `DesignSpace`.
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

    return EngineSpeed(
        env_steps_per_s=steps / seconds,
        steps_per_gflop=steps / seconds / gflops,
        gemm_gflops=gflops,
        gemm_threads=simulator.thread_count,
        gemm_precision="single",
        threads=simulator.thread_count,
        instruction_set=simulator.instruction_set,
        element_precision=spec.stepper.element_precision,
        modes=max(part.mode_count for part in parts),
        elements={
            "tetrahedra": max(len(part.tetrahedron_rest) for part in parts),
            "membrane_triangles": max(len(part.membrane_rest) for part in parts),
        },
        robots=settings.robot_count,
        mean_legs=float(legs.mean()),
        mean_contacts=each_step("contact_total"),
        mean_sweeps=each_step("sweep_total"),
        mean_newton_steps=each_step("newton_total"),
        fresh_tangent_share=float(simulator.read("tangent_total").sum() / (counted @ legs)),
        tangent_error_share=each_step("tangent_error_total"),
        worst_tangent_error_mm_per_s=worst("worst_tangent_error"),
        unconverged_share=each_step("unconverged_total"),
        worst_residual_mm_per_s=worst("worst_residual"),
        worst_penetration_mm=worst("worst_penetration"),
        stage_seconds={name: float(value) for name, value in stages.items()},
        statuses=tuple(np.bincount(simulator.status, minlength=2).tolist()),
        steps=int(steps),
        wall_s=seconds,
        robot_seconds_per_gflop=steps * spec.physics.time_step_s / seconds / gflops,
        **spec.describe(),
    )


def matrix_product_gflops(thread_count: int) -> float:
    """Single-precision matrix-product rate with one product in each thread [GFLOP/s].

    One product a thread, as the stepper runs one robot a thread, so the figure does not depend on
    whether the linear-algebra library was told to use threads of its own.
    """
    pairs = [
        np.random.default_rng(t).random((2, _PRODUCT_SIZE, _PRODUCT_SIZE), dtype=np.float32)
        for t in range(thread_count)
    ]

    def multiply(pair: np.ndarray) -> None:
        for _ in range(_PRODUCT_COUNT):
            pair[0] @ pair[1]

    flop = 2.0 * _PRODUCT_SIZE**3 * _PRODUCT_COUNT * thread_count
    best = 0.0
    with ThreadPoolExecutor(thread_count) as pool:
        for _ in range(4):
            start = time.perf_counter()
            list(pool.map(multiply, pairs))
            seconds = time.perf_counter() - start
            best = max(best, flop / seconds / 1e9)
    return best
