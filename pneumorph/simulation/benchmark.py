"""How many robot steps a second the stepper makes, beside what the machine can do."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.robot.robot import Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.simulation_settings import SimulationSettings


@dataclass(frozen=True)
class EngineBenchmark:
    """What to measure."""

    robot_count: int = 96
    """Robots in the batch."""
    action_count: int = 6
    """Random actions, each held for `action_steps`."""
    action_steps: int = 100
    """Time steps of an action."""
    settling_steps: int = 15
    """Time steps at zero pressure first, not counted."""
    maximum_kPa: float = 90.0
    """Upper end of the random commands [real kPa]."""
    seed: int = 0
    """Of designs and commands."""


def bench_engine(
    settings: EngineBenchmark,
    simulation: SimulationSettings,
    draw_robots: Callable[[np.random.Generator, int], Sequence[Robot]],
    thread_count: int = 0,
) -> dict[str, Any]:
    """Time random robots under random gaits, and the machine's own matrix product.

    Args:
        settings: What to measure.
        simulation: Physics and numerics.
        draw_robots: Given a generator and a count, that many random robots.
        thread_count: Threads; 0 takes every processor.

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
    robots = draw_robots(generator, settings.robot_count)
    simulator = BatchedSimulator(robots, simulation, thread_count)
    shape = (settings.action_count, settings.robot_count, simulation.regulator_count)
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
    after = matrix_product_gflops(simulator.thread_count)
    steps = float(simulator.read("step_count").sum())
    parts = {id(m.part): m.part for robot in robots for m in robot.mounts}
    gflops = max(before, after)
    return {
        "env_steps_per_s": steps / seconds,
        "steps_per_gflop": steps / seconds / gflops,
        "gemm_gflops": gflops,
        "gemm_threads": simulator.thread_count,
        "gemm_precision": "single",
        "threads": simulator.thread_count,
        "instruction_set": simulator.instruction_set,
        "element_precision": simulation.element_precision,
        "modes": max(part.mode_count for part in parts.values()),
        "elements": {
            "tetrahedra": max(len(part.tetrahedron_rest) for part in parts.values()),
            "membrane_triangles": max(len(part.membrane_rest) for part in parts.values()),
        },
        "robots": settings.robot_count,
        "mean_legs": float(np.mean([len(robot.mounts) for robot in robots])),
        "mean_contacts": float(simulator.read("contact_total").sum() / steps),
        "mean_sweeps": float(simulator.read("sweep_total").sum() / steps),
        "mean_newton_steps": float(simulator.read("newton_total").sum() / steps),
        "fresh_tangent_share": float(
            simulator.read("tangent_total").sum()
            / sum(
                float(count) * len(robot.mounts)
                for count, robot in zip(simulator.read("step_count"), robots, strict=True)
            )
        ),
        "tangent_error_share": float(simulator.read("tangent_error_total").sum() / steps),
        "worst_tangent_error_mm_per_s": float(simulator.read("worst_tangent_error").max()),
        "unconverged_share": float(simulator.read("unconverged_total").sum() / steps),
        "worst_residual_mm_per_s": float(simulator.read("worst_residual").max()),
        "worst_penetration_mm": float(simulator.read("worst_penetration").max()),
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
