"""Readings of bench tests against closed forms, and worlds that agree with them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.bench_tests import BENCH_TESTS
from pneumorph.catalogue.measured_worlds import UNCERTAINTIES, measured_worlds
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.hardware.virtual_rig import VirtualRigSettings, true_air
from pneumorph.physics.calibration import Calibration
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.bench_readings import (
    bench_test,
    beyond_usual_worlds,
    hub_mass_notes,
    measured_numbers,
    one_leg_notes,
    read_bench_readings,
    write_bench_readings,
)
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.fitted_calibration import calibrate
from pneumorph.study.virtual_reality import VirtualReality


@pytest.fixture(scope="module")
def spec() -> RobotSpec:
    return RobotOptions.of("measured").spec()


def test_a_tilt_is_its_tangent_and_a_weight_a_share(spec: RobotSpec, tmp_path: Path) -> None:
    mass_g = 1e3 * spec.module.reduced.mass
    given = {"tilt of a leg": [30.0, 30.0], "weighing": [0.9 * mass_g], "level of the floor": [0.5]}
    read = read_bench_readings(write_bench_readings(tmp_path / "bench.csv", given))
    found = measured_numbers(read, spec)
    friction, spread = found["friction sheet"]
    assert friction == pytest.approx(math.tan(math.pi / 6.0))
    # Half of the deviation is common to both readings.
    assert spread == pytest.approx(0.05 * friction * math.sqrt(0.25 + 0.75 / 2.0))
    # The file keeps six digits.
    assert found["mass_factor"] == pytest.approx((0.9, 0.009), rel=1e-5)
    assert found["floor_slope_deg"] == (0.5, 0.1)


def test_readings_that_scatter_more_than_said_count_as_they_scatter(spec: RobotSpec) -> None:
    read = np.array([0.0, 0.5, 1.0])
    _, spread = measured_numbers({"level of the floor": read}, spec)["floor_slope_deg"]
    assert spread == pytest.approx(math.hypot(0.05, 0.5 / math.sqrt(3.0)))
    apart = {
        "tilt of a leg": np.array([20.0, 42.0])
    }  # one of them is wrong, and nobody knows which
    low, high = np.tan(np.radians([20.0, 42.0]))
    assert measured_numbers(apart, spec)["friction sheet"] == pytest.approx(
        (
            0.5 * (low + high),
            math.hypot(0.5 * 0.05 * 0.5 * (low + high), 0.5 * (high - low)),
        )
    )


def test_no_repetition_lessens_what_readings_have_in_common(spec: RobotSpec) -> None:
    read = np.full(10_000, 30.0)
    friction, spread = measured_numbers({"tilt of a leg": read}, spec)["friction sheet"]
    assert spread == pytest.approx(0.5 * 0.05 * friction, rel=1e-3)


def test_one_reading_of_one_leg_is_told_to_be_of_one_leg() -> None:
    one, four = np.array([60.0]), np.full(4, 60.0)
    (told,) = one_leg_notes({"bend at one pressure": one, "tilt of a leg": one})
    assert told.startswith("bend at one pressure has one reading, and modulus_factor is the mean")
    assert one_leg_notes({"bend at one pressure": four, "weighing": four}) == ()


def test_a_hub_that_nobody_weighed_is_told(spec: RobotSpec) -> None:
    """Worlds scale its mass with that of the legs."""
    heavier = spec.scaled(mass_factor=1.1)
    assert heavier.hub.rigid.mass == pytest.approx(1.1 * spec.hub.rigid.mass)
    (told,) = hub_mass_notes({"weighing": np.full(4, 42.0), "tilt of a leg": np.array([30.0])})
    assert told.startswith("weighing is of legs, and mass_factor makes the hub heavier or lighter")
    assert hub_mass_notes({"tilt of a leg": np.array([30.0])}) == ()


def test_the_bend_of_a_stiffer_leg_gives_its_factor(spec: RobotSpec) -> None:
    """Without gravity a leg of f times the modulus bends under f times the pressure as it did; the
    virtual rig bends the stiffer leg itself. Curves every 10 kPa err by 0.1 % between."""
    settings = VirtualRigSettings(
        reality=replace(measured_worlds(), modulus_factor="1.1"),
        pressure_slope_factor="1",
        pressure_intercept_kPa="-20.361",
        bend_noise_deg=0.0,
    )
    read = VirtualReality(spec, settings, "reduced").bench_readings(["bend at one pressure"], 1)
    factor, spread = measured_numbers(read, spec)["modulus_factor"]
    assert factor == pytest.approx(1.1, rel=2e-3)
    assert spread == pytest.approx(0.03 * factor)


def test_the_virtual_rigs_readings_are_about_its_hidden_numbers(spec: RobotSpec) -> None:
    """Means of 400 readings, to four of their deviations; a tangent of scattered angles is off by
    less than a hundredth of that."""
    settings = VirtualRigSettings(seed=5, reality=measured_worlds())
    reality = VirtualReality(spec, settings, "reduced")
    # One is read as a bend; behind valves there is no lag.
    without = ("bend at one pressure", "lag of a regulator")
    names = [test.name for test in BENCH_TESTS if test.name not in without]
    with pytest.raises(ValueError, match="regulators have no lag"):
        reality.bench_readings(without[1:], 1)
    found = measured_numbers(reality.bench_readings(names, 400), spec)
    # Each valve is off by a draw of its own: the rig's, whatever its world says.
    air, count = spec.physics.air, spec.physics.regulator_count
    valves = true_air(settings, reality.reality.world, air, count)
    of_valves = {
        factor: np.mean(np.divide(valves.of_each(name, count), air.of_each(name, count)))
        for factor, name in (
            ("filling_factor", "filling_mm3_per_s_kPa"),
            ("venting_factor", "venting_mm3_per_s_kPa"),
        )
    }
    assert abs(of_valves["filling_factor"] / reality.reality.world.filling_factor - 1.0) > 0.01
    for name in names:
        test = bench_test(name)
        true = of_valves.get(test.number, reality.reality.world.numbers[test.number])
        value, _ = found[test.number]
        common, own = test.parts_at(true)
        assert abs(value - true) < 4.0 * math.hypot(common, own / math.sqrt(400.0)), name
    other = VirtualReality(spec, replace(settings, seed=6), "reduced").bench_readings(names, 1)
    assert other["weighing"] != reality.bench_readings(names, 1)["weighing"]


def test_worlds_agree_with_what_a_calibration_measured(spec: RobotSpec, tmp_path: Path) -> None:
    """Two hundred draws that a test of a deviation of 0.02 left scatter as much, to four standard
    errors of a deviation; what was given besides wins, and constants stay."""
    bench = write_bench_readings(tmp_path / "bench.csv", {"tilt of a leg": [31.0] * 4})
    options = RobotOptions.of("measured")
    study = calibrate(CalibrationSettings(bench=bench), options, RunFolder(tmp_path, "calibrate"))
    file = Path(study.found.calibration)
    tilted = replace(options, calibration=file).spec()
    drawn = tilted.agreeing_worlds(measured_worlds())
    rng = np.random.default_rng(1)
    sheets = [drawn.draw(rng).numbers["friction sheet"] for _ in range(200)]
    value = math.tan(math.radians(31.0))
    expected = 0.05 * value * math.sqrt(0.25 + 0.75 / 4.0)
    assert Calibration.load(file).measured["friction sheet"] == pytest.approx((value, expected))
    assert np.std(sheets) == pytest.approx(expected, rel=4.0 / math.sqrt(400.0))
    given = replace(measured_worlds(), measured=(("friction sheet", 0.5, 0.1),))
    assert tilted.agreeing_worlds(given) == given
    constant = Randomisation(friction_by_surface=(("sheet", "0.6"),))
    assert tilted.agreeing_worlds(constant) == constant
    assert spec.agreeing_worlds(given) is given
    with pytest.raises(ValueError, match="measured names 'friction sheet', expected one of"):
        tilted.agreeing_worlds(Randomisation())


def test_a_calibration_without_measured_numbers_is_read_and_keeps_its_digest(
    tmp_path: Path,
) -> None:
    plain = Calibration(friction=0.8)
    measured = replace(plain, measured={"mass_factor": (0.9, 0.01)})
    assert Calibration.load(measured.save(tmp_path / "m.json")).measured == measured.measured
    assert measured.digest() != plain.digest()
    text = plain.save(tmp_path / "p.json").read_text().replace('"measured": {},', "")
    assert '"measured"' not in text
    (tmp_path / "older.json").write_text(text)
    assert Calibration.load(tmp_path / "older.json").digest() == plain.digest()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("test,angle\ntilt of a leg,3\n", "has the columns test,angle, expected test,reading"),
        ("test,reading\ntilt,3\n", "row 1: the test is 'tilt', expected one of tilt of a robot"),
        ("test,reading\nweighing,\n", "row 1: reading is '', expected a finite number"),
        ("test,reading\nweighing,nan\n", "row 1: reading is 'nan', expected a finite number"),
        ("test,reading\n", "no rows"),
        ("test,reading\ntilt of a leg,31,9\n", "row 1 is 'tilt of a leg,31,9', .* decimal commas"),
    ],
)
def test_a_table_that_says_something_else_is_refused(text: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "bench.csv").write_text(text)
    with pytest.raises(ValueError, match=told):
        read_bench_readings(tmp_path / "bench.csv")


@pytest.mark.parametrize(
    ("name", "reading", "told"),
    [
        ("tilt of a leg", 90.0, "is 90, expected tilt_deg between 0 and 90"),
        ("weighing", -1.0, "is -1, expected leg_mass_g above 0"),
        ("bend at one pressure", 0.0, "is 0, expected bend_deg above 0"),
    ],
)
def test_what_cannot_be_read_off_is_refused(
    name: str, reading: float, told: str, spec: RobotSpec
) -> None:
    with pytest.raises(ValueError, match=told):
        measured_numbers({name: np.array([reading])}, spec)


def test_bench_readings_come_after_what_they_are_read_against() -> None:
    with pytest.raises(ValueError, match="both bench and bends were given"):
        CalibrationSettings(bench=Path("a"), bends=Path("b"))


@pytest.mark.parametrize(
    ("name", "reading", "number"),
    [
        ("tilt of a leg", 89.99, "friction sheet 5730"),
        ("tilt of the hub", 0.01, "friction hub 0.0001745"),
        ("lag of a regulator", 80.0, "regulator_lag_s 80"),  # milliseconds
        ("level of the floor", -45.0, "floor_slope_deg -45"),
        ("weighing", 0.0468, "mass_factor"),  # kilograms
        ("step up of pressure", 2000.0, "filling_factor 2000"),  # the conductance itself
    ],
)
def test_readings_far_outside_of_what_worlds_allow_are_refused(
    name: str, reading: float, number: str, spec: RobotSpec
) -> None:
    with pytest.raises(ValueError, match=f"{name}' is .*makes {number}.*expected .*likely cause"):
        measured_numbers({name: np.array([reading])}, spec)


def test_a_measurement_that_no_usual_world_agrees_with_is_told() -> None:
    assert beyond_usual_worlds("mass_factor", 1.12, 0.012) is None
    told = beyond_usual_worlds("mass_factor", 1.239, 0.012)
    assert told is not None
    assert "mass_factor U(0.9, 1.1), agrees" in told


def test_every_test_of_the_bench_is_of_a_number_that_worlds_have() -> None:
    assert {test.number for test in BENCH_TESTS} <= set(UNCERTAINTIES)
