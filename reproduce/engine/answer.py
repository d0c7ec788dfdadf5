"""Do the engine's liberties change the answer? Distances against its converged reference settings.

    python reproduce/engine/answer.py --out runs/engine-answer
    python reproduce/engine/answer.py --out runs/engine-answer-measured --physics measured

Random designs of the paper's space, each with a random gait of 20 actions of one second, and the
baseline walk 20 s: by default settings, by reference settings (double precision, a fresh stiffness
in every step, friction to 1e-8 mm/s), and with steps of 0.005 and 0.02 s. How far each distance
moves by itself: the reference in worlds that differ by a hair. Then one robot of four legs on one
thread is timed. Writes answer.json and prints the tables of the README.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.settings import load_settings
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.part_physics import PhysicsName
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.open_loop_gait import OpenLoopGait, sample_commands
from pneumorph.physics.physics import Physics
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.robot import Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.stepper_settings import StepperSettings

ACTION_S, ACTION_COUNT, SETTLING_S, MAXIMUM_KPA = 1.0, 20, 0.15, 90.0
TIME_STEPS_S = (0.005, 0.01, 0.02)
MARK_CM = 0.05


def robot_in(physics: PhysicsName) -> RobotOptions:
    """The published robot by the settings that `reproduce` keeps, or that of the measured leg."""
    if physics == "published":
        return load_settings(RobotOptions, Path(__file__).parent.parent / "published.toml")
    return RobotOptions.of(physics)


def reference_of(default: StepperSettings) -> StepperSettings:
    """Settings without the engine's liberties."""
    return replace(
        default,
        element_precision="double",
        tangent_tolerance_mm_per_s=0.0,
        contact_tolerance_mm_per_s=1e-8,
        contact_sweeps=20000,
    )


def rubbing(physics: Physics, factor: float) -> Physics:
    """The same physics with every coefficient of friction times `factor`."""
    by_surface = tuple((name, value * factor) for name, value in physics.friction_by_surface)
    return replace(physics, friction=physics.friction * factor, friction_by_surface=by_surface)


def hairs(physics: Physics, reference: StepperSettings) -> list[tuple[Physics, StepperSettings]]:
    """Physics other by a thousandth at most, or other rounding, or another tolerance."""
    factors = tuple(1.0 + change for change in (-1e-3, -1e-4, 1e-4, 1e-3))
    numbers = ("mass_damping_per_s", "time_step_s")
    return [
        *((rubbing(physics, factor), reference) for factor in factors),
        *(
            (replace(physics, **{name: getattr(physics, name) * factor}), reference)
            for name in numbers
            if getattr(physics, name) > 0.0  # measured silicone is damped by its own relaxation
            for factor in factors
        ),
        *(
            (physics, replace(reference, contact_tolerance_mm_per_s=tolerance))
            for tolerance in (1e-6, 1e-7)
        ),
        (physics, replace(reference, instruction_set="baseline")),
    ]


def distances_cm(
    robots: Sequence[Robot],
    gaits: Sequence[OpenLoopGait],
    physics: Physics,
    stepper: StepperSettings,
    threads: int,
) -> tuple[np.ndarray, BatchedSimulator]:
    """Forward travel after settling [cm], (robot,), and the simulator at the end."""
    step_s = physics.time_step_s
    count = round(ACTION_S * ACTION_COUNT / step_s)
    commands = np.stack([sample_commands(gait, step_s, count) for gait in gaits], axis=1)
    simulator = BatchedSimulator(robots, physics, stepper, threads)
    simulator.advance(np.zeros(commands.shape[1:]), round(SETTLING_S / step_s))
    start = simulator.forward_position_mm
    simulator.clear_counters()
    # Equal commands in a row are one call.
    edges = [0, *(np.flatnonzero(np.any(np.diff(commands, axis=0) != 0, axis=(1, 2))) + 1), count]
    for first, last in pairwise(edges):
        simulator.advance(commands[first], last - first)
    if np.any(simulator.status != 0):
        raise RuntimeError(f"robots ended with status {simulator.status.tolist()}")
    return (simulator.forward_position_mm - start) / 10.0, simulator


def times_real_time(spec: RobotSpec, stepper: StepperSettings) -> dict[str, float]:
    """How much faster than real time the baseline's four legs walk 20 s on one thread.

    By the clock, which other programs slow, and by the processor time that was used; best of five.
    """
    robot = spec.assembly(BASELINE_DESIGN)
    best = {"clock": 0.0, "processor_time": 0.0}
    for _ in range(5):
        clocks = time.perf_counter(), time.process_time()
        distances_cm([robot], [ExpertGait()], spec.physics, stepper, 1)
        for name, start, end in zip(
            best, clocks, (time.perf_counter(), time.process_time()), strict=True
        ):
            best[name] = max(best[name], ACTION_S * ACTION_COUNT / (end - start))
    return best


def main(
    out: Path,
    pairs: int = 20,
    threads: int = 0,
    part: Path | None = None,
    physics: PhysicsName = "published",
) -> None:
    """Walk by all settings and compare.

    Args:
        out: Folder of answer.json.
        pairs: Random designs, each with a random gait.
        threads: Of the simulator; 0 takes every processor.
        part: Reduced leg; by default the one that ships.
        physics: What they walk in, and on which leg.
    """
    options, space = robot_in(physics), DesignSpace()
    spec, default = replace(options, part=part).spec(), options.stepper
    usual, converged = spec.physics, reference_of(options.stepper)
    generator = np.random.default_rng(0)
    drawn = generator.integers(len(space), size=pairs)
    designs = [Design.parse(BASELINE_DESIGN), *(space[int(index)] for index in drawn)]
    shape = (pairs, ACTION_COUNT, space.regulator_count)
    held = generator.uniform(0.0, MAXIMUM_KPA, shape)
    gaits: list[OpenLoopGait] = [ExpertGait(), *(HeldGait.evenly(each, ACTION_S) for each in held)]
    robots = [spec.assembly(design) for design in designs]

    reference, _ = distances_cm(robots, gaits, usual, converged, threads)
    by_step = {}
    counters = {}
    for step_s in TIME_STEPS_S:
        stepped = replace(usual, time_step_s=step_s)
        by_step[step_s], simulator = distances_cm(robots, gaits, stepped, default, threads)
        steps = simulator.read("step_count").sum()
        counters[str(step_s)] = {
            "unconverged_share": float(simulator.read("unconverged_total").sum() / steps),
            "worst_residual_mm_per_s": float(simulator.read("worst_residual").max()),
            "worst_penetration_mm": float(simulator.read("worst_penetration").max()),
        }
    # How far the answer moves by itself.
    hair = np.max(
        [
            np.abs(distances_cm(robots, gaits, *hair, threads)[0] - reference)
            for hair in hairs(usual, converged)
        ],
        axis=0,
    )
    error = np.abs(by_step[0.01] - reference)
    firm = hair <= MARK_CM
    summary = {
        "physics": physics,
        "designs": [str(design) for design in designs],
        "reference_cm": reference.tolist(),
        "default_cm": by_step[0.01].tolist(),
        "difference_cm": {"largest": float(error.max()), "median": float(np.median(error))},
        "within_mark": f"{int((error <= MARK_CM).sum())} of {len(error)} within {MARK_CM} cm",
        "moved_by_a_hair_cm": hair.tolist(),
        "firm": f"{int(firm.sum())} pairs that a hair moves by less than {MARK_CM} cm: "
        f"largest difference {error[firm].max():.4f} cm",
        "by_time_step_cm": {str(step): value.tolist() for step, value in by_step.items()},
        "counters": counters,
        "times_real_time_one_4_leg_robot_one_thread": times_real_time(spec, default),
    }
    write_json(out / "answer.json", summary)
    print("| design | reference | 0.01 s | difference | a hair | 0.005 s | 0.02 s |")
    print("|---|---|---|---|---|---|---|")
    for row, design in enumerate(designs):
        print(
            f"| `{design}` | {reference[row]:.3f} | {by_step[0.01][row]:.3f} | {error[row]:.4f} | "
            f"{hair[row]:.4f} | {by_step[0.005][row]:.3f} | {by_step[0.02][row]:.3f} |"
        )
    for name in ("within_mark", "firm", "difference_cm", "counters",
                 "times_real_time_one_4_leg_robot_one_thread"):  # fmt: skip
        print(name, summary[name])


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
