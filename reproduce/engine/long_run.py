"""Millions of robot steps over random designs and extreme gaits: how does each robot end?

    python reproduce/engine/long_run.py --out runs/engine-long

Batches of random designs of the paper's space. Each robot's regulators switch between 0 and 90 kPa,
through every combination of them in a random order, each held for a random time of its own batch
(0.02 to 2 s). After every batch all states are checked to be finite, and the statuses are counted.
Interrupted, it goes on from the batch it was at. Writes long_run.json.
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
from pneumorph.base.settings import load_settings
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.physics import Damping
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.batched_simulator import RobotStatus

PUBLISHED = load_settings(RobotOptions, Path(__file__).parent.parent / "published.toml")
ROBOTS, ROUNDS, HIGH_KPA = 96, 4, 90.0
HOLD_STEPS = (2, 5, 10, 25, 50, 100, 200)
QUANTITIES = ("position", "rotation", "velocity", "angular_velocity", "modes", "mode_rates",
              "impulses", "regulated")  # fmt: skip


def run_batch(seed: int, spec: RobotSpec) -> dict[str, Any]:
    """One batch of robots through all combinations, `ROUNDS` times."""
    generator = np.random.default_rng(seed)
    space = DesignSpace()
    drawn = generator.integers(len(space), size=ROBOTS)
    simulator = spec.simulator([space[int(index)] for index in drawn])
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
        "finite": all(finite.values()),
        "unconverged": int(simulator.read("unconverged_total").sum()),
        "worst_residual_mm_per_s": float(simulator.read("worst_residual").max()),
        "worst_penetration_mm": float(simulator.read("worst_penetration").max()),
    }


def main(out: Path, steps: int = 10_000_000, threads: int = 0, part: Path | None = None) -> None:
    """Walk batch after batch and count.

    Args:
        out: Folder of long_run.json.
        steps: Robot steps in all.
        threads: Of the simulator; 0 takes every processor.
        part: Reduced leg; by default the one that ships.
    """
    spec = replace(PUBLISHED, part=part, threads=threads).spec()
    path = out / "long_run.json"
    total: dict[str, Any] = {
        "batches": 0,
        "steps": 0,
        "statuses": dict.fromkeys((status.name.lower() for status in RobotStatus), 0),
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
        damping: Damping = ("published", "objective")[number % 2]
        physics = replace(PUBLISHED.physics, damping=damping)
        batch = run_batch(number, replace(spec, physics=physics))
        total["batches"] += 1
        total["steps"] += batch["steps"]
        for name, count in zip(total["statuses"], batch["statuses"], strict=True):
            total["statuses"][name] += count
        total["not_finite_batches"] += not batch["finite"]
        total["unconverged"] += batch["unconverged"]
        for name in ("worst_residual_mm_per_s", "worst_penetration_mm"):
            total[name] = max(total[name], batch[name])
        write_json(path, total)
        spent = time.monotonic() - start
        left = (steps - total["steps"]) * spent / max(total["steps"] - first, 1)
        print(f"{total['steps']} steps, {total['statuses']}, {left / 60:.0f} min left", flush=True)


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
