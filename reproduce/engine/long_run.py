"""Millions of robot steps over random designs and extreme gaits: how does each robot end?

    python reproduce/engine/long_run.py --out runs/engine-long
    python reproduce/engine/long_run.py --physics measured --out runs/engine-long-measured

Batches of random designs of the paper's space. Each robot's regulators switch between 0 and 90 kPa,
through every combination of them in a random order, each held for a random time of its own batch
(0.02 to 2 s). In the measured physics every robot walks in a world of its own, wider than those
that are drawn elsewhere. After every batch all states are checked to be finite, and the statuses
are counted, apart for robots that left the range of their reduction's snapshots. Interrupted, it
goes on from the batch it was at. Writes long_run.json.
"""

from __future__ import annotations

import json
import time
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.layers import layered
from pneumorph.base.settings import load_settings
from pneumorph.catalogue.part_physics import PhysicsName
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.physics import Damping
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.randomisation import Randomisation

PUBLISHED = load_settings(RobotOptions, Path(__file__).parent.parent / "published.toml")
ROBOTS, ROUNDS, HIGH_KPA = 96, 4, 90.0
HOLD_STEPS = (2, 5, 10, 25, 50, 100, 200)
WIDE_WORLDS = Randomisation(
    friction="U(0.3, 1.5)",
    friction_by_surface=(("hub", "U(0.12, 1.5)"),),
    modulus_factor="U(0.88, 2.27)",  # 0.45 to 1.16 MPa
    mass_factor="U(0.9, 1.1)",
    damping_factor="LogU(0.5, 2)",
    filling_factor="LogU(0.25, 4)",
    venting_factor="LogU(0.25, 4)",
)
"""Worlds of the measured robot."""
QUANTITIES = ("position", "rotation", "velocity", "angular_velocity", "modes", "mode_rates",
              "impulses", "regulated")  # fmt: skip


def run_batch(seed: int, spec: RobotSpec, worlds: Randomisation | None) -> dict[str, Any]:
    """One batch of robots through all combinations, `ROUNDS` times, each in a world of its own."""
    generator = np.random.default_rng(seed)
    space = DesignSpace()
    drawn = generator.integers(len(space), size=ROBOTS)
    simulator = BatchedSimulator(
        [spec.assembly(space[int(index)]) for index in drawn],
        spec.physics,
        spec.stepper,
        spec.thread_count,
        None if worlds is None else [worlds.draw(generator) for _ in drawn],
    )
    corners = HIGH_KPA * np.array(list(product((0.0, 1.0), repeat=space.regulator_count)))
    hold = int(generator.choice(HOLD_STEPS))
    for _ in range(ROUNDS):
        order = np.argsort(generator.random((ROBOTS, len(corners))), axis=1)
        for turn in range(len(corners)):
            simulator.advance(corners[order[:, turn]], hold)
    finite = {name: bool(np.all(np.isfinite(simulator.read(name)))) for name in QUANTITIES}
    return {
        "steps": int(simulator.read("step_count").sum()),
        "statuses": np.bincount(simulator.status, minlength=len(RobotStatus)).tolist(),
        "failed_in_range": int(np.sum((simulator.status > 0) & ~(simulator.range_ratio > 1.0))),
        "out_of_range": int(np.sum(simulator.range_ratio > 1.0)),
        "finite": all(finite.values()),
        "unconverged": int(simulator.read("unconverged_total").sum()),
        "worst_residual_mm_per_s": float(simulator.read("worst_residual").max()),
        "worst_penetration_mm": float(simulator.read("worst_penetration").max()),
    }


def main(
    out: Path,
    physics: PhysicsName = "published",
    steps: int = 10_000_000,
    threads: int = 0,
    part: Path | None = None,
) -> None:
    """Walk batch after batch and count.

    Args:
        out: Folder of long_run.json.
        physics: The published physics under both dampings, or the measured one in wide worlds.
        steps: Robot steps in all.
        threads: Of the simulator; 0 takes every processor.
        part: Reduced leg; by default the one that ships.
    """
    measured = physics == "measured"
    robot = layered(RobotOptions(), [{"based_on": "measured"}]) if measured else PUBLISHED
    spec = replace(robot, part=part, threads=threads).spec()
    path = out / "long_run.json"
    total: dict[str, Any] = {
        "batches": 0,
        "steps": 0,
        "statuses": dict.fromkeys((status.name.lower() for status in RobotStatus), 0),
        "failed_in_range": 0,
        "out_of_range": 0,
        "not_finite_batches": 0,
        "unconverged": 0,
        "worst_residual_mm_per_s": 0.0,
        "worst_penetration_mm": 0.0,
    }
    if path.exists():
        total = json.loads(path.read_text())
    start, first = time.monotonic(), total["steps"]
    while total["steps"] < steps:
        number = total["batches"]
        if measured:
            batch = run_batch(number, spec, WIDE_WORLDS)
        else:
            damping: Damping = ("published", "objective")[number % 2]
            acting = replace(PUBLISHED.physics, damping=damping)
            batch = run_batch(number, replace(spec, physics=acting), None)
        total["batches"] += 1
        total["steps"] += batch["steps"]
        for name, count in zip(total["statuses"], batch["statuses"], strict=True):
            total["statuses"][name] += count
        total["not_finite_batches"] += not batch["finite"]
        for name in ("unconverged", "failed_in_range", "out_of_range"):
            total[name] += batch[name]
        for name in ("worst_residual_mm_per_s", "worst_penetration_mm"):
            total[name] = max(total[name], batch[name])
        write_json(path, total)
        spent = time.monotonic() - start
        left = (steps - total["steps"]) * spent / max(total["steps"] - first, 1)
        print(f"{total['steps']} steps, {total['statuses']}, {left / 60:.0f} min left", flush=True)


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
