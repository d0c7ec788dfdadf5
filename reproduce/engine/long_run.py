"""Millions of robot steps over random designs and extreme gaits: how does each robot end?

    python reproduce/engine/long_run.py --out runs/engine-long [--steps 10000000] [--threads 2]

Batches of random designs of the paper's space. Each robot's regulators switch between 0 and 90 kPa,
through every combination of them in a random order, each held for a random time of its own batch
(0.02 to 2 s). After every batch all states are checked to be finite, and the statuses are counted.
Interrupted, it goes on from the batch it was at. Writes long_run.json.
"""

from __future__ import annotations

import argparse
import json
import time
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.artefact import write_json
from pneumorph.presets import load_default_leg, paper_robot_builder
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation import BatchedSimulator, RobotStatus, SimulationSettings

ROBOTS, ROUNDS, HIGH_KPA = 96, 4, 90.0
HOLD_STEPS = (2, 5, 10, 25, 50, 100, 200)
QUANTITIES = ("position", "rotation", "velocity", "angular_velocity", "modes", "mode_rates",
              "impulses", "regulated")  # fmt: skip


def run_batch(seed: int, leg: ReducedPart, damping: str, threads: int) -> dict[str, Any]:
    """One batch of robots through all combinations, `ROUNDS` times."""
    generator = np.random.default_rng(seed)
    space = DesignSpace()
    build = paper_robot_builder(leg)
    robots = [build(space[int(i)]) for i in generator.integers(len(space), size=ROBOTS)]
    simulator = BatchedSimulator(robots, SimulationSettings(damping=damping), threads)  # type: ignore[arg-type]
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--steps", type=int, default=10_000_000)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--part", type=Path, help="reduced leg; by default the one that ships")
    options = parser.parse_args()
    leg = load_default_leg() if options.part is None else ReducedPart.load(options.part)
    path = options.out / "long_run.json"
    options.out.mkdir(parents=True, exist_ok=True)
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
    while total["steps"] < options.steps:
        number = total["batches"]
        batch = run_batch(number, leg, ("published", "objective")[number % 2], options.threads)
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
        left = (options.steps - total["steps"]) * spent / max(total["steps"] - first, 1)
        print(f"{total['steps']} steps, {total['statuses']}, {left / 60:.0f} min left", flush=True)


if __name__ == "__main__":
    main()
