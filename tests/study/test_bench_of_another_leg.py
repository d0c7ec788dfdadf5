"""What a bench measured relative to a leg is not applied to another, where it would count twice."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.physics.calibration import Calibration
from pneumorph.study.bench_readings import write_bench_readings
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.fitted_calibration import calibrate

READINGS = {"weighing": [42.0, 42.4, 41.8], "bend at one pressure": [75.0, 76.0]}


def bench(folder: Path, robot: RobotOptions, **readings: list[float]) -> Path:
    """The calibration of a robot by some readings, all of them where none are given."""
    named = {name.replace("_", " "): values for name, values in readings.items()}
    table = write_bench_readings(folder / "bench.csv", named or READINGS)
    study = calibrate(CalibrationSettings(bench=table), robot, RunFolder(folder, "calibrate"))
    return Path(study.found.calibration)


def asked(**changes: Any) -> RobotOptions:
    """The usual robot but for some options."""
    if "calibration" in changes:
        changes["calibration"] = str(changes["calibration"])
    return layered(RobotOptions(), [changes])


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the usual leg, which weighs 46.8 g."""
    return bench(tmp_path_factory.mktemp("measured"), RobotOptions())


def test_the_same_leg_takes_what_was_measured_of_it(measured: Path) -> None:
    spec = asked(calibration=measured).spec()
    assert spec.calibration is not None
    assert spec.calibration.measured["mass_factor"][0] == pytest.approx(42.07 / 46.8, abs=1e-3)
    # A reduction of it again, and the leg under a modulus that trials found, are the same.
    again = replace(spec.module.reduced, mass=spec.module.reduced.mass * (1.0 + 1e-5))
    module = replace(spec.module, make_reduced=lambda: again, modulus_factor=1.1)
    sites = tuple(replace(site, modules=(module,)) for site in spec.sites)
    assert replace(spec, sites=sites).calibrated(spec.calibration).module.modulus_factor == 1.1


def test_a_weighed_leg_is_not_weighed_twice(measured: Path) -> None:
    """Given as masses.leg_mass_g as well, it would walk with 37.7 g and a narrow band."""
    with pytest.raises(
        ValueError,
        match=r"calibration.json has mass_factor 0.898\d, weighed relative to legs of 46.81 g "
        r".*there are such of 42 g .*count twice; leave out masses.leg_mass_g",
    ):
        asked(calibration=measured, masses={"leg_mass_g": 42.0}).spec()


def test_a_leg_of_another_stiffness_has_a_modulus_of_its_own(
    measured: Path, tmp_path: Path
) -> None:
    """The same bend is 0.877 of the hyperelastic leg's modulus and 0.870 of the measured one's."""
    readings = {"bend_at_one_pressure": READINGS["bend at one pressure"]}
    other = bench(tmp_path, asked(leg="hyperelastic"), **readings)
    with pytest.raises(
        ValueError,
        match=r"has modulus_factor 0.87\d*, measured relative to the moduli of the hyperelastic leg"
        r" that ships, expected that leg, and the measured leg that ships walks",
    ):
        asked(calibration=other).spec()
    _ = asked(leg="hyperelastic", calibration=other).spec()


def test_what_a_later_bench_does_not_measure_is_of_the_leg_it_was_measured_of(
    measured: Path, tmp_path: Path
) -> None:
    later = bench(tmp_path, asked(calibration=measured), tilt_of_a_leg=[31.0])
    assert set(Calibration.load(later).measured) == {
        "mass_factor", "modulus_factor", "friction sheet",
    }  # fmt: skip
    with pytest.raises(ValueError, match=r"weighed relative to legs of 46\.81 g"):
        asked(calibration=later, masses={"leg_mass_g": 42.0}).spec()


def test_files_that_do_not_say_of_which_leg_they_are_stay_usable(
    measured: Path, tmp_path: Path
) -> None:
    content = json.loads(measured.read_text())
    del content["source"]["bench"]["relative_to"]
    older = tmp_path / "older.json"
    older.write_text(json.dumps(content))
    spec = asked(calibration=older, masses={"leg_mass_g": 42.0}).spec()
    assert spec.module.reduced.mass == pytest.approx(0.042)
    assert Calibration.load(older).digest() == Calibration.load(measured).digest()
