"""From simulation to a robot on the table, on the virtual rig: calibrate, deploy, compare.

    python examples/sim_to_real.py runs/sim-to-real

The virtual rig stands for reality: its robot has another friction, modulus, mass and pressure map
than the simulation (drawn from a seed), its regulators lag and its sensors are noisy. Nothing here
looks at that truth before the end. All is of the published physics, in which the gaits were
learned. On a real rig the steps are the same, with --rig FILE.

Takes about a minute on two idle cores with the reduced robot; --model full has finite elements
behind the rig and takes hours.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.hardware.virtual_rig import VirtualRigSettings, draw_reality
from pneumorph.report.trial_figures import save_transfer_figures
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.deployed_gait import deploy_gait
from pneumorph.study.deployment_settings import DeploymentSettings
from pneumorph.study.fitted_calibration import calibrate
from pneumorph.study.transfer import TransferSettings, transfer

GAITS = Path(__file__).parent / "gaits"


def main(arguments: list[str] | None = None) -> dict[str, Any]:
    """Go the whole way and return what came out."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--model", choices=("reduced", "full"), default="reduced")
    parser.add_argument("--trials", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0, help="of the virtual reality")
    asked = parser.parse_args(arguments)
    out, usual = asked.out, RobotOptions.of("published")
    virtual = VirtualRigSettings(seed=asked.seed)

    # One leg's bend test, and the line that it gives.
    test = DeploymentSettings(bend_test=True, virtual=virtual, model=asked.model)
    bends = deploy_gait(None, test, usual, RunFolder(out / "bend", "deploy")).bends
    assert bends is not None
    measured = CalibrationSettings(bends=Path(bends))
    calibration = calibrate(measured, usual, RunFolder(out / "calibration", "calibrate")).found
    calibrated = replace(usual, calibration=Path(calibration.calibration))

    # The expert's gait near its best phase, and learned ones, several trials each.
    trials = DeploymentSettings(virtual=virtual, model=asked.model, trials=asked.trials)
    expert = replace(trials, expert=ExpertGait(phase_deg=20.0))
    for label, gait, settings in (
        ("B", None, expert),
        ("L", GAITS / "learned.csv", trials),
        ("R", GAITS / "learned_robustly.csv", trials),
    ):
        deploy_gait(gait, settings, calibrated, RunFolder(out / label, "deploy"))

    # Beside the calibrated simulation.
    runs = [f"{label}={out / label}" for label in "BLR"]
    folder = RunFolder(out / "transfer", "transfer")
    compared = transfer(runs, TransferSettings(), calibrated.spec(), folder)
    save_transfer_figures(compared, folder.path)

    # Only now: what was true.
    reality = draw_reality(virtual, usual.physics.pressure_map)
    robots = {each.label: each for each in compared.found.robots}
    true_slope = reality.pressure_map.slope / reality.world.modulus_factor
    low, high = calibration.confidence_intervals_95["slope"]
    print(f"slope {calibration.slope:.3f} ({low:.3f} to {high:.3f}), in truth {true_slope:.3f}")
    for label, each in robots.items():
        ratio = each.transfer_ratio
        print(
            f"{label}: simulated {each.simulated_distance_cm:6.2f} cm, measured "
            f"{each.mean_distance_cm:6.2f} ± {each.spread_cm or 0.0:.2f} cm, "
            f"backsliding {each.mean_backsliding_cm:.2f} cm"
            + (f", transfer ratio {ratio:.2f}" if ratio is not None else "")
        )
    if asked.model == "reduced":
        # The reduced leg calibrates a reduced reality: the interval of this seed holds the truth.
        assert low < true_slope < high
    assert robots["L"].mean_distance_cm > robots["B"].mean_distance_cm + 1.0
    assert robots["R"].mean_distance_cm > robots["B"].mean_distance_cm + 1.0
    return {
        "calibration": result_to_dict(calibration),
        "robots": {label: result_to_dict(each) for label, each in robots.items()},
        "true_slope": true_slope,
    }


if __name__ == "__main__":
    main()
