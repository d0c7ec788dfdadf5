"""From simulation to a robot on the table, on the virtual rig: calibrate, deploy, compare.

    python examples/sim_to_real.py runs/sim-to-real

The virtual rig stands for reality: its robot has another friction, modulus, mass and pressure map
than the simulation (drawn from a seed), its regulators lag and its sensors are noisy. Nothing here
looks at that truth before the end. On a real rig the steps are the same, with --rig FILE.

Takes about a minute on two idle cores with the reduced robot; --model full has finite elements
behind the rig and takes hours.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from pneumorph.cli import run
from pneumorph.hardware.virtual_rig import VirtualRigSettings, draw_reality

GAITS = Path(__file__).parent / "gaits"


def main(arguments: list[str] | None = None) -> dict[str, Any]:
    """Go the whole way and return what came out."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--model", choices=("reduced", "full"), default="reduced")
    parser.add_argument("--trials", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0, help="of the virtual reality")
    asked = parser.parse_args(arguments)
    out, seed = asked.out, f"--virtual.seed {asked.seed} --model {asked.model}"

    # One leg's bend test, and the line that it gives.
    verb(f"deploy --bend-test {seed} --out {out}/bend")
    calibration = verb(f"calibrate --bends {out}/bend/bends.csv --out {out}/calibration")
    file = calibration["calibration"]

    # The expert's gait at its best phase, and a learned one, several trials each.
    deploy = f"deploy {seed} --trials {asked.trials} --calibration {file}"
    verb(f"{deploy} --expert.phase-deg 20 --out {out}/B")
    verb(f"{deploy} {GAITS / 'learned.csv'} --out {out}/L")
    verb(f"{deploy} {GAITS / 'learned_robustly.csv'} --out {out}/R")

    # Beside the calibrated simulation.
    runs = f"B={out}/B L={out}/L R={out}/R"
    comparison = verb(f"transfer {runs} --calibration {file} --out {out}/transfer")

    # Only now: what was true.
    reality = draw_reality(VirtualRigSettings(seed=asked.seed))
    robots = {each["label"]: each for each in comparison["robots"]}
    true_slope = reality.pressure_map.slope / reality.world.modulus_factor
    low, high = calibration["confidence_intervals_95"]["slope"]
    print(f"slope {calibration['slope']:.3f} ({low:.3f} to {high:.3f}), in truth {true_slope:.3f}")
    for label, each in robots.items():
        ratio = each["transfer_ratio"]
        print(
            f"{label}: simulated {each['simulated_distance_cm']:6.2f} cm, measured "
            f"{each['mean_distance_cm']:6.2f} ± {each['spread_cm'] or 0.0:.2f} cm, "
            f"backsliding {each['mean_backsliding_cm']:.2f} cm"
            + (f", transfer ratio {ratio:.2f}" if ratio is not None else "")
        )
    if asked.model == "reduced":
        # The reduced leg calibrates a reduced reality: the interval of this seed holds the truth.
        assert low < true_slope < high
    assert robots["L"]["mean_distance_cm"] > robots["B"]["mean_distance_cm"] + 1.0
    assert robots["R"]["mean_distance_cm"] > robots["B"]["mean_distance_cm"] + 1.0
    return {"calibration": calibration, "robots": robots, "true_slope": true_slope}


def verb(command: str) -> dict[str, Any]:
    """Run a verb as on the command line and return its summary."""
    words = command.split()
    print("pneumorph", command)
    if run(words):
        raise SystemExit(f"pneumorph {command} failed")
    folder = Path(words[words.index("--out") + 1])
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return summary


if __name__ == "__main__":
    main()
