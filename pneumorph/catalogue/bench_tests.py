"""Tests of the paper's robot on a bench, each of one number that worlds differ in."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Reading = Literal["tilt_deg", "bend_deg", "leg_mass_g", "number"]
"""What is read off: the angle at which something slides, the bend at `BEND_TEST_KPA`, what a leg
weighs, or the number itself."""

BEND_TEST_KPA = 50.0
"""Pressure of the test of one bend [real kPa]."""


COMMON_SHARE = 0.5
"""Of a test's standard deviation, what all its readings have in common: the zero of a protractor,
the scale of a photograph, the sheet that was cut. No repetition makes it less. A guess."""


@dataclass(frozen=True)
class BenchTest:
    """A test, what it finds and how well."""

    name: str
    number: str
    """Which number of a world; see `World.numbers`."""
    deviation: float
    """Standard deviation of what a single reading finds, of the number itself or relative to it."""
    relative: bool
    minutes: float
    """Of one who has robot, supply and a phone's camera at hand."""
    how: str
    reading: Reading = "number"

    @property
    def is_of_a_leg(self) -> bool:
        """Whether each leg has its own number, of which the worlds have the mean."""
        return self.reading in ("bend_deg", "leg_mass_g")

    def deviation_at(self, value: float) -> float:
        """Standard deviation of a single reading at a value of the number."""
        return self.deviation * abs(value) if self.relative else self.deviation

    def parts_at(self, value: float) -> tuple[float, float]:
        """What of `deviation_at` all readings have in common, and what each has of its own:
        standard deviations, whose squares add up."""
        whole = self.deviation_at(value)
        return COMMON_SHARE * whole, math.sqrt(1.0 - COMMON_SHARE**2) * whole


BENCH_TESTS = (
    BenchTest(
        "tilt of a robot",
        "friction",
        0.05,
        True,
        5.0,
        "Of surfaces without a coefficient of their own: tilt the robot at rest until it slides.",
        "tilt_deg",
    ),
    BenchTest(
        "tilt of a leg",
        "friction sheet",
        0.05,
        True,
        5.0,
        "Lay a leg with its sheet on a board of the floor and tilt until it slides: the tangent.",
        "tilt_deg",
    ),
    BenchTest(
        "tilt of a leg on its side",
        "friction skin",
        0.05,
        True,
        5.0,
        "Lay a leg on its side, bare silicone below, on a board of the floor and tilt until it "
        "slides: the tangent.",
        "tilt_deg",
    ),
    BenchTest(
        "tilt of the hub",
        "friction hub",
        0.05,
        True,
        5.0,
        "Lay the hub without legs on a board of the floor and tilt until it slides: the tangent.",
        "tilt_deg",
    ),
    BenchTest(
        "bend at one pressure",
        "modulus_factor",
        0.03,
        True,
        10.0,
        "Hold a leg at its end, inflate it to 50 kPa, wait, and read the bend off a photograph, "
        "each leg of the robot once; the factor is the one that the simulated leg needs.",
        "bend_deg",
    ),
    BenchTest(
        "ring-down of a leg",
        "damping_factor",
        0.1,
        True,
        10.0,
        "Release a leg that was pushed aside and film it: the logarithmic decrement, over that of "
        "the simulated leg.",
    ),
    BenchTest(
        "weighing",
        "mass_factor",
        0.01,
        True,
        2.0,
        "Kitchen scales, each leg. The hub is taken to be off by as much as the legs: where it is "
        "not, give both as weighed (masses.leg_mass_g, masses.hub_mass_g).",
        "leg_mass_g",
    ),
    BenchTest(
        "step up of pressure",
        "filling_factor",
        0.1,
        True,
        10.0,
        "Command a step and log the sensed pressure (`pneumorph calibrate --air`): the filling "
        "conductance over the simulated one.",
    ),
    BenchTest(
        "step down of pressure",
        "venting_factor",
        0.1,
        True,
        10.0,
        "Command a step down and log the sensed pressure (`pneumorph calibrate --air`): the "
        "venting conductance over the simulated one.",
    ),
    BenchTest(
        "lag of a regulator",
        "regulator_lag_s",
        0.01,
        False,
        10.0,
        "Take the leg off, close the outlet, command a small step and log the sensed pressure: "
        "the time until 63 % of the step, which is the time constant of a first-order lag [s].",
    ),
    BenchTest(
        "level of the floor",
        "floor_slope_deg",
        0.1,
        False,
        2.0,
        "A spirit level: how much steeper the floor is than the simulated one [degrees].",
    ),
    BenchTest(
        "photograph from the side",
        "mounting_angle_deg",
        0.3,
        False,
        5.0,
        "Of the mounted legs at rest: degrees below where they should point.",
    ),
)
"""What each finds is a guess of how well a careful person does it, not a measurement."""
