"""Lines, bends and calibration files against closed forms and the paper's own numbers."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from helpers.published_pairs import PAPER_PAIRS

from pneumorph.base.artefact import ArtefactError
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh
from pneumorph.hardware import bend_test
from pneumorph.hardware.bend_staircase import BendTestSettings
from pneumorph.hardware.bend_test import MonotoneBend, equal_bend_pairs, read_bends, read_pairs
from pneumorph.hardware.line_fit import _places, fit_line
from pneumorph.hardware.measured_table import read_measured_table
from pneumorph.physics.air import Air
from pneumorph.physics.calibration import Calibration, UsedCalibration, describe_calibration
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap


def test_the_papers_line_comes_out_of_its_pairs(tmp_path: Path) -> None:
    """The pairs are rounded to 0.01 kPa, which moves the intercept by some thousandths."""
    (tmp_path / "pairs.csv").write_text(PAPER_PAIRS)
    pairs = read_pairs(tmp_path / "pairs.csv")
    line = fit_line(pairs.real_kPa, pairs.simulated_kPa)
    published = PressureMap()
    assert line.slope == pytest.approx(published.slope, abs=1e-4)
    assert line.intercept == pytest.approx(published.intercept_kPa, abs=5e-3)
    assert line.r_squared > 0.99


def test_pairs_in_pascals_are_told(tmp_path: Path) -> None:
    path = tmp_path / "pairs.csv"
    path.write_text("real_pressure_kPa,simulated_pressure_kPa\n15000,15000\n90000,89000\n")
    with pytest.raises(ValueError, match=r"pairs\.csv: a pressure is 90000 kPa, .* in Pa"):
        read_pairs(path)
    path.write_text("real_pressure_Pa,simulated_pressure_Pa\n15000,15000\n90000,89000\n")
    np.testing.assert_allclose(read_pairs(path).real_kPa, [15.0, 90.0])


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """500 noisy lines: 95 % of the intervals hold the truth, to 3 standard errors of a binomial."""
    rng = np.random.default_rng(1)
    x = np.arange(10.0, 101.0, 10.0)
    held = np.zeros(2)
    for _ in range(500):
        line = fit_line(x, 4.0 * x - 20.0 + 5.0 * rng.standard_normal(len(x)))
        held += [
            line.slope_interval[0] < 4.0 < line.slope_interval[1],
            line.intercept_interval[0] < -20.0 < line.intercept_interval[1],
        ]
    assert np.all(np.abs(held / 500 - 0.95) < 3.0 * np.sqrt(0.95 * 0.05 / 500))


def test_repeats_that_know_nothing_new_leave_the_intervals() -> None:
    """Ten copies of each pair are nine times no measurement."""
    x = np.arange(10.0, 91.0, 10.0)
    y = 4.0 * x - 20.0 + 3.0 * np.random.default_rng(4).standard_normal(len(x))
    one, ten = fit_line(x, y), fit_line(np.repeat(x, 10), np.repeat(y, 10))
    assert (ten.slope, ten.intercept) == pytest.approx((one.slope, one.intercept))
    np.testing.assert_allclose(ten.slope_interval, one.slope_interval)
    np.testing.assert_allclose(ten.intercept_interval, one.intercept_interval)
    assert ten.point_count == 90


def test_two_places_are_on_a_line_which_tells_no_interval() -> None:
    """However often they were read: it may be off elsewhere by anything."""
    line = fit_line(np.array([0.0, 0.0, 0.05, 10.0]), np.array([-1.0, 1.0, 0.0, 10.0]))
    assert (line.slope, line.intercept) == pytest.approx(
        (10.0 / (10.0 - 0.05 / 3.0), -(10.0 / (10.0 - 0.05 / 3.0)) * 0.05 / 3.0)
    )
    assert np.isnan([*line.slope_interval, *line.intercept_interval]).all()
    with pytest.raises(ValueError, match=r"all 3 points are at 0\.1, expected different"):
        fit_line(np.full(3, 0.1), np.arange(3.0))


@pytest.mark.parametrize(("common", "repeats"), [(3.0, 1), (3.0, 3), (3.0, 10), (0.0, 3)])
def test_intervals_hold_what_the_line_lacks_at_each_place(common: float, repeats: int) -> None:
    """What all repeats at a pressure have in common, or noise alone: of 500 lines, 95 % of the
    intervals hold the truth, to 4 standard errors of a binomial."""
    rng, held = np.random.default_rng(1), np.zeros(2)
    x = np.arange(10.0, 91.0, 10.0)
    for _ in range(500):
        y = np.repeat(4.0 * x - 20.0 + common * rng.standard_normal(len(x)), repeats)
        y += 0.5 * rng.standard_normal(len(y))
        line = fit_line(np.repeat(x, repeats), y)
        held += [
            line.slope_interval[0] < 4.0 < line.slope_interval[1],
            line.intercept_interval[0] < -20.0 < line.intercept_interval[1],
        ]
    assert np.all(np.abs(held / 500 - 0.95) < 4.0 * np.sqrt(0.95 * 0.05 / 500))


LADDER_KPA = np.arange(10.0, 91.0, 10.0)


@pytest.mark.parametrize(
    ("readings", "jitter_kPa"),
    [
        ([1, 1, 1, 1, 1, 1, 1, 1, 20], 0.0),
        ([10, 1, 1, 1, 1, 1, 1, 1, 10], 0.0),
        ([10] * 9, 0.001),
        ([3] * 9, 0.05),
        ([10] * 9, 0.3),
        ([10] * 9, 0.5),
    ],
)
def test_a_place_counts_once_however_often_it_was_read(
    readings: list[int], jitter_kPa: float
) -> None:
    """And if a gauge does not tell the same pressure twice. Of 500 lines, 95 % of the intervals
    hold the truth, to 4 standard errors of a binomial; the readings' noise of 0.5 kPa makes the
    variances of the means differ by 3 % of the 9 kPa^2 that all readings at a place share."""
    rng, held = np.random.default_rng(1), np.zeros(2)
    for _ in range(500):
        y = 4.0 * LADDER_KPA - 20.0 + 3.0 * rng.standard_normal(len(LADDER_KPA))
        noise, jitter = rng.standard_normal((2, sum(readings)))
        x = np.repeat(LADDER_KPA, readings) + jitter_kPa * jitter
        line = fit_line(x, np.repeat(y, readings) + 0.5 * noise)
        held += [
            line.slope_interval[0] < 4.0 < line.slope_interval[1],
            line.intercept_interval[0] < -20.0 < line.intercept_interval[1],
        ]
    assert np.all(np.abs(held / 500 - 0.95) < 4.0 * np.sqrt(0.95 * 0.05 / 500))


def test_readings_near_each_other_are_of_one_place() -> None:
    """A hundred even steps keep a place at each pressure, and a finer ramp is no single place."""
    rng = np.random.default_rng(2)
    x = rng.permutation(np.linspace(0.0, 90.0, 101))
    y = 4.0 * x - 20.0 + rng.standard_normal(len(x))
    assert len(np.unique(_places(x))) == 101
    line, (slope, intercept) = fit_line(x, y), np.polyfit(x, y, 1)
    assert (line.slope, line.intercept) == pytest.approx((slope, intercept))
    ramp = np.linspace(0.0, 90.0, 1001)
    assert len(np.unique(_places(ramp))) == 34  # of 30 readings each
    assert _places(np.array([90.0, 10.0, 10.7, 50.0, 11.6])).tolist() == [3, 0, 0, 2, 1]


def test_a_curve_or_a_bend_that_is_not_a_number_is_refused() -> None:
    with pytest.raises(ValueError, match="does not rise with the pressure"):
        MonotoneBend(np.array([0.0, 10.0, 20.0]), np.array([0.0, np.nan, 9.0]))
    curve = MonotoneBend(np.array([0.0, 100.0, 200.0]), np.array([0.0, 30.0, 50.0]))
    with pytest.raises(ValueError, match="bend_deg nan is beyond the simulated leg's 0 to 50"):
        curve.pressure(np.array([10.0, np.nan]))


def test_equal_bends_are_found_on_a_known_curve() -> None:
    pressure = np.arange(0.0, 401.0, 10.0)
    curve = MonotoneBend(pressure, 0.3 * pressure + 2e-4 * pressure**2)
    real = np.array([5.0, 20.0, 50.0, 90.0])
    simulated = PressureMap(4.0, -25.0).simulated(real)
    bend = 0.3 * simulated + 2e-4 * simulated**2
    pairs = equal_bend_pairs(real, bend, curve)
    # The first is cut off at zero bend and says nothing; a monotone cubic on a 10 kPa grid follows
    # a parabola to some hundredths of a kPa.
    np.testing.assert_array_equal(pairs.real_kPa, real[1:])
    np.testing.assert_allclose(pairs.simulated_kPa, simulated[1:], atol=0.05)


@pytest.mark.parametrize(
    ("row", "reading", "other"),
    [
        (20, -78.0, r"row 19 has 78 degrees at 70 kPa"),
        (18, 0.0, r"row 20 has 78 degrees at 70 kPa"),
        (26, -0.1, r"row 25 has 102 degrees at 90 kPa"),
    ],
)
def test_a_bend_that_contradicts_the_others_is_refused(
    row: int, reading: float, other: str
) -> None:
    """A slip of the sign, or a reading that was not taken, at a pressure that bends the leg: it and
    all bends of lower pressures would be taken for noise."""
    curve = MonotoneBend(np.linspace(0.0, 450.0, 46), np.linspace(0.0, 135.0, 46))
    real = np.repeat(np.arange(10.0, 91.0, 10.0), 3)
    bend = 0.3 * (4.0 * real - 20.0)
    assert len(equal_bend_pairs(real, bend, curve).real_kPa) == 27
    bend[row] = reading
    at = rf"row {row + 1}: the bend at {real[row]:g} kPa is {reading:g} degrees"
    with pytest.raises(ValueError, match=rf"{at}, expected a positive one: {other}; .* the sign"):
        equal_bend_pairs(real, bend, curve)


def test_a_bend_that_is_not_positive_where_the_leg_hardly_bends_is_noise() -> None:
    curve = MonotoneBend(np.linspace(0.0, 450.0, 46), np.linspace(0.0, 135.0, 46))
    real = np.repeat(np.arange(10.0, 91.0, 10.0), 3)
    bend = 0.3 * (4.0 * real - 20.0)
    bend[1] = -0.4
    np.testing.assert_array_equal(equal_bend_pairs(real, bend, curve).real_kPa, real[3:])


@pytest.mark.parametrize("step_kPa", [2.0, 10.0])
def test_noise_where_the_leg_does_not_bend_yet_does_not_tilt_the_line(step_kPa: float) -> None:
    """Of 100 staircases from 0 kPa, three readings each with 0.5 degrees of noise, the 95 %
    intervals hold the true line in at least 86 %: four standard errors below 95."""
    true, rng, held = PressureMap(4.0785, -20.361), np.random.default_rng(0), np.zeros(2)
    curve = MonotoneBend(np.linspace(0.0, 450.0, 46), np.linspace(0.0, 90.0, 46))
    real = np.repeat(np.arange(0.0, 91.0, step_kPa), 3)
    for _ in range(100):
        measured = curve.bend(true.simulated(real)) + 0.5 * rng.standard_normal(len(real))
        pairs = equal_bend_pairs(real, measured, curve)
        line = fit_line(pairs.real_kPa, pairs.simulated_kPa)
        intervals = np.array([line.slope_interval, line.intercept_interval])
        inside = (intervals[:, 0] <= [true.slope, true.intercept_kPa]) & (
            intervals[:, 1] >= [true.slope, true.intercept_kPa]
        )
        held += inside
    assert held.min() >= 86


@pytest.mark.parametrize("last", [(30.0, False), (15.0, True)])
def test_the_curve_of_a_leg_ends_where_it_gives_way(
    last: tuple[float, bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where no equilibrium is found, or one that is bent less: the leg has snapped."""

    def held_bends(*_: object) -> Iterator[tuple[float, SimpleNamespace]]:
        for bend, converged in ((10.0, True), (20.0, True), last, (40.0, True)):
            yield bend, SimpleNamespace(converged=converged)

    monkeypatch.setattr(bend_test, "held_bends", held_bends)
    leg, mesh = cast(PartModel, None), cast(Mesh, None)  # only passed on
    curve = bend_test.simulated_bend_curve(leg, mesh, 40.0, 10.0)
    np.testing.assert_array_equal(curve.pressure_kPa, [0.0, 10.0, 20.0])
    np.testing.assert_array_equal(curve.bend_deg, [0.0, 10.0, 20.0])


def test_the_last_stair_of_a_bend_test_is_not_above_the_highest() -> None:
    assert list(BendTestSettings(highest_kPa=30.0).pressures_kPa) == [10.0, 20.0, 30.0]
    assert list(BendTestSettings(highest_kPa=34.0).pressures_kPa) == [10.0, 20.0, 30.0, 34.0]
    assert list(BendTestSettings(70.0, 25.0).pressures_kPa) == [25.0, 50.0, 70.0]
    assert list(BendTestSettings(0.3, 0.1).pressures_kPa) == pytest.approx([0.1, 0.2, 0.3])
    for highest_kPa in np.linspace(1.0, 90.0, 400):
        stairs = BendTestSettings(highest_kPa, highest_kPa / 9.0).pressures_kPa
        assert len(stairs) == 9
        assert stairs.max() == highest_kPa


def test_a_bend_beyond_the_simulated_leg_is_refused() -> None:
    curve = MonotoneBend(np.array([0.0, 100.0]), np.array([0.0, 30.0]))
    with pytest.raises(ValueError, match="bend_deg 31 is beyond the simulated leg's 0 to 30"):
        curve.pressure(np.array([10.0, 31.0]))


def test_units_of_the_header_are_converted(tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_text("# leg 3\npressure_psi,bend_rad,remark\n1,0.5,first\n2,1,\n")
    pressure, bend = read_bends(tmp_path / "b.csv")
    np.testing.assert_allclose(pressure, [6.894757, 13.789515], rtol=1e-6)
    np.testing.assert_allclose(bend, np.degrees([0.5, 1.0]))


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_columns_are_separated_as_in_the_header(mark: str, tmp_path: Path) -> None:
    """A remark may hold any of the signs."""
    lines = ["# leg 3; by hand, 2\ttimes", f"pressure_kPa{mark}bend_deg", f"10{mark}3.5"]
    (tmp_path / "b.csv").write_text("\n".join([*lines, "# a; b", f"20{mark}7.5"]) + "\n")
    pressure, bend = read_bends(tmp_path / "b.csv")
    assert pressure.tolist() == [10.0, 20.0]
    assert bend.tolist() == [3.5, 7.5]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("pressure_kPa;bend_deg\n1;2,5\n", "row 1: bend_deg is '2,5', .* has a decimal comma"),
        ("pressure_atm,bend_deg\n1,2\n", "has the unit 'atm', expected pressure_UNIT with one of"),
        ("pressure,bend_deg\n1,2\n", "has the unit 'none'"),
        ("bend_deg\n2\n", "column pressure_kPa is missing"),
        ("pressure_kPa,bend_deg\n1,x\n", "row 1: bend_deg is 'x', expected a finite number"),
        ("pressure_kPa,bend_deg\n", "has no rows"),
        (
            "pressure_kPa,bend_deg\n10,3\n20,7,5\n",
            r"t\.csv, row 2 is '20,7,5', expected 2 cells as in the header; .* decimal commas",
        ),
    ],
)
def test_tables_without_sense_are_refused(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(ValueError, match=message):
        read_measured_table(tmp_path / "t.csv", {"pressure": "kPa", "bend": "deg"})


def test_a_calibration_reads_back_and_is_applied(tmp_path: Path) -> None:
    measured = Calibration(PressureMap(3.8, -18.0), 1.1, 0.08, 0.9, {"slope": (3.7, 3.9)})
    read = Calibration.load(measured.save(tmp_path / "c.json"))
    assert read == measured
    assert read.digest() == measured.digest()
    physics = read.applied_to(Physics())
    assert physics.pressure_map == PressureMap(3.8, -18.0)
    assert (physics.friction, physics.stiffness_damping_s) == (0.9, 0.08)
    # What was not measured stays.
    partial = Calibration(PressureMap(3.8, -18.0)).applied_to(Physics())
    assert partial.friction == Physics().friction


def test_what_was_not_calibrated_is_said_to_be_so() -> None:
    """Summaries of earlier versions named the run's own settings, as if they had been measured."""
    used = describe_calibration(None, PressureMap(1.0, 0.0))
    assert used.file == used.said == "not calibrated"
    earlier = UsedCalibration("the run's own settings", 1.0, 0.0)
    assert earlier.said == "not calibrated"
    assert describe_calibration(None, PressureMap()).said == "the published line"
    line = PressureMap(3.8, -18.0)
    assert describe_calibration(Calibration(line), line).said == "a calibration without a file"


def test_a_calibration_with_air_brings_its_law(tmp_path: Path) -> None:
    """Files of before there was air are read, and keep their digests."""
    line = PressureMap(3.8, -18.0)
    air = Air("orifice", 150.0, (50.0, 60.0, 70.0), (900.0,), chamber_growth=(0.01,))
    measured = Calibration(line, air=air, intervals={"filling_1_mm3_per_s_kPa": (49.0, 51.0)})
    read = Calibration.load(measured.save(tmp_path / "c.json"))
    assert read == measured
    assert read.applied_to(Physics(friction=0.7)) == Physics(
        friction=0.7, pressure_map=line, air=air
    )
    used = describe_calibration(read, line)
    assert used.filling_mm3_per_s_kPa == (50.0, 60.0, 70.0)
    plain = Calibration(line)
    assert plain.digest() != measured.digest()
    older = {name: value for name, value in plain.content().items() if name != "air"}
    header = {"kind": "Calibration", "format_version": 1}
    (tmp_path / "older.json").write_text(json.dumps({**header, **older}))
    assert Calibration.load(tmp_path / "older.json") == plain
    # Written down when calibrations had no air.
    assert plain.digest() == "ead983a7de1cbd616fde9b3132aefc0bf38a019c89ee968ed9d536df97995274"
    content = json.loads((tmp_path / "c.json").read_text())
    content["air"]["supply_kPa"] = -1.0
    (tmp_path / "c.json").write_text(json.dumps(content))
    with pytest.raises(ArtefactError, match="supply_kPa must be at least 1"):
        Calibration.load(tmp_path / "c.json")


def test_what_is_no_calibration_is_refused(tmp_path: Path) -> None:
    (tmp_path / "c.json").write_text('{"kind": "Mesh"}')
    with pytest.raises(ArtefactError, match="it holds a Mesh, expected a Calibration"):
        Calibration.load(tmp_path / "c.json")
    (tmp_path / "c.json").write_text('{"verb": "coopt"}')
    with pytest.raises(ArtefactError, match="it holds no kind of artefact, expected a Calibration"):
        Calibration.load(tmp_path / "c.json")
    with pytest.raises(FileNotFoundError, match="does not exist"):
        Calibration.load(tmp_path / "none.json")


@pytest.mark.parametrize(
    "measured", [["a", "b"], [0.6, -0.1], [0.6], [float("nan"), 0.1], 0.6, [True, 0.1]]
)
def test_measured_numbers_without_sense_are_refused_by_their_file(
    measured: object, tmp_path: Path
) -> None:
    path = Calibration(PressureMap(4.0, -20.0)).save(tmp_path / "c.json")
    content = json.loads(path.read_text())
    content["measured"] = {"friction sheet": measured}
    path.write_text(json.dumps(content))
    with pytest.raises(ArtefactError, match=r"c\.json.*measured friction sheet is .* deviation"):
        Calibration.load(path)


@pytest.mark.parametrize(
    ("name", "value", "cause"),
    [
        ("friction", 55, "at most 10, got 55; it is a ratio of forces"),
        ("friction", 0, "positive and at most 10, got 0"),
        ("modulus_factor", 180_000, "at most 50, got 180000; .* not a modulus"),
        ("modulus_factor", float("nan"), "at most 50, got nan"),
        ("stiffness_damping_s", 80, "at most 10, got 80; it is in seconds"),
    ],
)
def test_measured_parameters_in_other_units_are_refused_by_their_file(
    name: str, value: float, cause: str, tmp_path: Path
) -> None:
    path = Calibration(PressureMap(4.0, -20.0)).save(tmp_path / "c.json")
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {name: value}))
    with pytest.raises(ArtefactError, match=rf"c\.json.*{name} must be .*{cause}"):
        Calibration.load(path)


def test_equivalent_pressures_mean_the_same_to_both_maps() -> None:
    ours, theirs = PressureMap(4.0, -20.0), PressureMap(3.5, -14.0)
    real = np.array([0.0, 4.0, 10.0, 90.0])
    moved = ours.equivalent(real, theirs)
    np.testing.assert_allclose(theirs.simulated(moved), ours.simulated(real), atol=1e-12)
    assert np.all(moved >= 0.0)
    np.testing.assert_allclose(ours.equivalent(real, ours), real, atol=1e-12)
