"""A hidden world, three tests on a bench, and the band before and after."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.hardware.virtual_rig import VirtualRigSettings
from pneumorph.study.bench_readings import write_bench_readings
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.certified_candidates import CertificateSettings
from pneumorph.study.certified_pairs import Band, Certificate
from pneumorph.study.certified_rounds import certify
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.fitted_calibration import CALIBRATION_FILE, calibrate
from pneumorph.study.rivals import worlds_of
from pneumorph.study.study_once import study_folder, study_once
from pneumorph.study.virtual_reality import VirtualReality

TESTS = 3
READINGS = 5
"""Of each test."""


@dataclass(frozen=True)
class Narrowed:
    """What tests of one hidden robot did to the band of the best pair."""

    seed: int
    tests: tuple[str, ...]
    measured: dict[str, tuple[float, float]]
    """Value and standard deviation by number."""
    true: dict[str, float]
    """What they are on the rig."""
    before: Band
    after: Band
    rig_cm: float


def narrowed(
    run: FinishedRun,
    certificate: Certificate,
    reality: RobotOptions,
    rig: VirtualRigSettings,
    rig_cm: float,
    work: Path,
) -> Narrowed:
    """Test the rig's robot by what its certificate names first, calibrate, and certify again.

    Args:
        run: The training.
        certificate: Of it, before any test.
        reality: What is true behind the rig.
        rig: Its hidden world.
        rig_cm: How far its robot went [cm].
        work: Keeps readings, calibration and certificate.
    """
    # The rig's valves lag by what its gait was made of, which no bench reads.
    tests = [each.test for each in certificate.tests if each.number != "regulator_lag_s"][:TESTS]
    hidden = VirtualReality(reality.spec(), rig, "reduced")
    bench = write_bench_readings(work / "bench.csv", hidden.bench_readings(tests, READINGS))
    own = RunFolder(work, "calibrate")
    found = calibrate(CalibrationSettings(bench=bench), run.robot, own).found
    calibrated = replace(run.robot, calibration=work / CALIBRATION_FILE).spec()
    settings = CertificateSettings(randomisation=worlds_of(run))
    folder = study_folder(work / "certificate", "certify")
    again = study_once(
        folder,
        Certificate,
        {"run": run.digest(), "measured": found.measured, "certificate": settings},
        lambda: certify(run, settings, calibrated, folder),
    )
    numbers = hidden.reality.world.numbers
    (before,), (after,) = (
        [pair.band for pair in each.pairs if pair.label == certificate.best]
        for each in (certificate, again)
    )
    return Narrowed(
        rig.seed,
        tuple(tests),
        found.measured,
        {name: numbers[name] for name in found.measured},
        before,
        after,
        rig_cm,
    )
