"""Where the stepper's time goes on this machine, over batches, legs, modes and threads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pneumorph.machine import processor_count
from pneumorph.robot.robot import Robot
from pneumorph.simulation.benchmark import EngineBenchmark, bench_engine
from pneumorph.simulation.simulation_settings import SimulationSettings

AXES = ("robots", "legs", "modes", "threads")
"""What is varied, one at a time."""

DrawRobots = Callable[[np.random.Generator, int, int | None, int | None], Sequence[Robot]]
"""Draws random robots from a generator, a count, a number of legs and a number of modes; None
leaves legs or modes as they come."""


@dataclass(frozen=True)
class EngineProfile:
    """What to vary."""

    robots: tuple[int, ...] = (1, 8, 32, 96)
    """Robots in the batch, on all threads."""
    legs: tuple[int, ...] = (3, 4, 5, 6)
    """Legs of every robot, on one thread."""
    modes: tuple[int, ...] = (8, 16, 24)
    """Modes of a leg, on one thread; counts that the leg has not are left out."""
    batch: int = 32
    """Robots where legs, modes or threads vary."""
    actions: int = 1
    """Random actions of each measurement."""


def profile_engine(
    settings: EngineProfile,
    benchmark: EngineBenchmark,
    simulation: SimulationSettings,
    draw_robots: DrawRobots,
    mode_count: int,
    thread_count: int = 0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[dict[str, Any]]:
    """Measure the stages with one thing varied at a time.

    Args:
        settings: What to vary.
        benchmark: Seed, pressures and steps of each measurement.
        simulation: Physics and numerics.
        draw_robots: Makes random robots.
        mode_count: Modes of the leg as it is.
        thread_count: Most threads; 0 takes every processor.
        progress: Told the measurements made and those to make.

    Returns:
        One dictionary for each measurement: ``axis`` (of `AXES`), ``value``, ``env_steps_per_s``,
        ``gemm_gflops``, ``steps_per_gflop``, ``threads``, and ``stage_us``, the thread time of each
        stage for one leg and step [us].
    """
    threads = thread_count or processor_count()
    cases: list[tuple[str, int, int, int, int | None, int | None]] = [
        *(("robots", count, threads, count, None, None) for count in settings.robots),
        *(("legs", legs, 1, settings.batch, legs, None) for legs in settings.legs),
        *(
            ("modes", modes, 1, settings.batch, None, modes)
            for modes in settings.modes
            if modes <= mode_count
        ),
        *(("threads", each, each, settings.batch, None, None) for each in range(1, threads + 1)),
    ]
    rows: list[dict[str, Any]] = []
    for axis, value, case_threads, robots, legs, modes in cases:

        def draw(
            generator: np.random.Generator,
            count: int,
            legs: int | None = legs,
            modes: int | None = modes,
        ) -> Sequence[Robot]:
            return draw_robots(generator, count, legs, modes)

        figures = bench_engine(
            replace(benchmark, robot_count=robots, action_count=settings.actions),
            simulation,
            draw,
            case_threads,
        )
        leg_steps = figures["steps"] * figures["mean_legs"]
        rows.append(
            {
                "axis": axis,
                "value": value,
                "threads": case_threads,
                "mean_legs": figures["mean_legs"],
                "env_steps_per_s": figures["env_steps_per_s"],
                "gemm_gflops": figures["gemm_gflops"],
                "steps_per_gflop": figures["steps_per_gflop"],
                "stage_us": {
                    name: 1e6 * seconds / leg_steps
                    for name, seconds in figures["stage_seconds"].items()
                },
            }
        )
        progress(len(rows), len(cases))
    return rows
