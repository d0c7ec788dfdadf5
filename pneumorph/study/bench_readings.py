"""Readings of tests on a bench, and what they say of the numbers that worlds differ in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import write_text
from pneumorph.catalogue.bench_tests import BENCH_TESTS, BEND_TEST_KPA, BenchTest
from pneumorph.catalogue.measured_worlds import UNCERTAINTIES
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.hardware.bend_test import simulated_bend_curve
from pneumorph.hardware.measured_table import read_rows
from pneumorph.simulation.distribution import Distribution

COLUMNS = ["test", "reading"]

FAR = 3.0
"""A number that is this many times beyond the range of the worlds is a mistake in reading."""

SCATTER = 5.0
"""Standard deviations of a test by which a reading may lie beyond that."""


def read_bench_readings(path: Path | str) -> dict[str, np.ndarray]:
    """Read a table ``test,reading`` of tests by their names, repeats welcome.

    Returns:
        Readings of each test, (repeat,), in the unit of its `BenchTest.reading`.

    Raises:
        FileNotFoundError: No such file.
        ValueError: Another header, a test that is not known, or a reading that is no finite number
            or cannot be; names the row.
    """
    header, rows = read_rows(path)
    if header[:2] != COLUMNS:
        raise ValueError(f"{path} has the columns {','.join(header)}, expected {','.join(COLUMNS)}")
    found: dict[str, list[float]] = {}
    for number, row in enumerate(rows, start=1):
        name, text = row[0].strip(), row[1] if len(row) > 1 else ""
        test = bench_test(name, f"{path}, row {number}: ")
        try:
            reading = float(text)
        except ValueError:
            reading = np.nan
        if not np.isfinite(reading):
            raise ValueError(f"{path}, row {number}: reading is {text!r}, expected a finite number")
        _refuse_impossible(test, np.array([reading]), f"{path}, row {number}: ")
        found.setdefault(name, []).append(reading)
    return {name: np.array(readings) for name, readings in found.items()}


def write_bench_readings(path: Path | str, readings: Mapping[str, Iterable[float]]) -> Path:
    """Write a table that `read_bench_readings` reads."""
    lines = [",".join(COLUMNS)]
    lines += [f"{name},{value:.6g}" for name, values in readings.items() for value in values]
    return write_text(path, "\n".join(lines) + "\n")


def bench_test(name: str, where: str = "") -> BenchTest:
    """The test of a name.

    Args:
        name: As certificates have it.
        where: Begins the message.

    Raises:
        ValueError: There is none.
    """
    for test in BENCH_TESTS:
        if test.name == name:
            return test
    known = ", ".join(test.name for test in BENCH_TESTS)
    raise ValueError(f"{where}the test is {name!r}, expected one of {known}")


def measured_numbers(
    readings: Mapping[str, np.ndarray], spec: RobotSpec
) -> dict[str, tuple[float, float]]:
    """Value and standard deviation of the mean of each number that was tested.

    Readings scatter by as much as the test is said to, or by more where they show it; what they
    have in common stays however many there are (JCGM 100:2008, 4.2 and 4.3).

    Args:
        readings: As `read_bench_readings` returns them.
        spec: The robot that moduli and masses are relative to.

    Raises:
        ValueError: A reading says what cannot be, such as a mass that is not positive, or a number
            far outside of what nobody has measured leaves open (`UNCERTAINTIES`).
    """
    found = {}
    for name, read in readings.items():
        test = bench_test(name)
        values = _numbers(test, read, spec)
        _refuse_far(test, read, values)
        value = float(values.mean())
        common, own = test.parts_at(value)
        if len(values) > 1:
            own = max(own, float(values.std(ddof=1)))
        found[test.number] = value, float(np.hypot(common, own / np.sqrt(len(values))))
    return found


def one_leg_notes(readings: Mapping[str, np.ndarray]) -> tuple[str, ...]:
    """What to say of tests of a leg of which there is one reading.

    Args:
        readings: As `read_bench_readings` returns them.
    """
    return tuple(
        f"{name} has one reading, and {bench_test(name).number} is the mean of all legs of the "
        "robot, which differ among themselves: read each leg once"
        for name, read in readings.items()
        if bench_test(name).is_of_a_leg and len(read) == 1
    )


def hub_mass_notes(readings: Mapping[str, np.ndarray]) -> tuple[str, ...]:
    """What to say of legs that were weighed without their hub.

    Args:
        readings: As `read_bench_readings` returns them.
    """
    return tuple(
        f"{name} is of legs, and {bench_test(name).number} makes the hub heavier or lighter by the "
        "same share, though these readings say nothing of it: where the hub is off by another "
        "share, leave them out and give both as weighed (--masses.leg-mass-g, --masses.hub-mass-g)"
        for name in readings
        if bench_test(name).reading == "leg_mass_g"
    )


def beyond_usual_worlds(number: str, value: float, deviation: float) -> str | None:
    """What to say of a measurement that no world of `UNCERTAINTIES` agrees with; None of others.

    Args:
        number: What was measured.
        value: What was found.
        deviation: Its standard deviation.
    """
    usual = UNCERTAINTIES[number].distribution
    try:
        Distribution.parse(usual).check_measured(number, value, deviation)
    except ValueError:
        return (
            f"no world that is drawn as usual, {number} {usual}, agrees with that: certify and "
            "evaluate refuse it unless another distribution of it is given (--randomisation.*)"
        )
    return None


def _refuse_far(test: BenchTest, read: np.ndarray, values: np.ndarray) -> None:
    """Refuse readings that mean a number far outside of the range of the worlds.

    Args:
        test: What was read.
        read: As it was read, (repeat,).
        values: The number by each reading, (repeat,).
    """
    range_ = Distribution.parse(UNCERTAINTIES[test.number].distribution)
    least = range_.lowest / FAR if range_.lowest > 0.0 else range_.lowest * FAR
    most = range_.highest * FAR
    # A reading of what is near the end of its range may lie beyond it by the test's own error.
    least -= SCATTER * test.deviation_at(least)
    most += SCATTER * test.deviation_at(most)
    for reading, value in zip(read, values, strict=True):
        if not least <= value <= most:
            raise ValueError(
                f"a reading of {test.name!r} is {reading:g} ({test.reading}), which makes "
                f"{test.number} {value:.4g}, expected {least:.3g} to {most:.3g}: the worlds have "
                f"{range_.lowest:g} to {range_.highest:g}; likely cause: a slip of the pen, "
                "another unit or test, or a robot of another kind than is simulated"
            )


def _numbers(test: BenchTest, read: np.ndarray, spec: RobotSpec) -> np.ndarray:
    """The world's number by each reading, (repeat,)."""
    if test.reading == "number":
        return read
    _refuse_impossible(test, read)
    if test.reading == "tilt_deg":
        return np.tan(np.radians(read))
    if test.reading == "leg_mass_g":
        return read / (1e3 * spec.module.reduced.mass)
    # A leg of f times the modulus bends under f times the pressure as it did.
    leg, mesh = spec.module.reduced, spec.module.full.mesh
    leg.check_mesh(mesh)
    simulated = float(spec.physics.pressure_map.simulated(BEND_TEST_KPA))
    curve = simulated_bend_curve(leg, mesh, 2.0 * simulated, rotation=spec.physics.rotation)
    return simulated / curve.pressure(read)


def _refuse_impossible(test: BenchTest, read: np.ndarray, where: str = "") -> None:
    """Refuse readings that cannot be.

    Raises:
        ValueError: One is not positive, or a tilt of a right angle and more.
    """
    if test.reading == "number":
        return
    most = 90.0 if test.reading == "tilt_deg" else np.inf
    wrong = read[(read <= 0.0) | (read >= most)]
    if len(wrong):
        bound = "above 0" if most == np.inf else f"between 0 and {most:g}"
        raise ValueError(
            f"{where}a reading of {test.name!r} is {wrong[0]:g}, expected {test.reading} {bound}"
        )
