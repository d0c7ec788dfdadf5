"""Steps of silicone that are linearised where their motion leads: nearly the converged step."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from helpers.crawlers import FRESH, PHYSICS
from helpers.one_leg import COMMAND, HUB, POSE, motion_of, thrown
from helpers.synthetic_part import rubber_reduced_part

from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.reduced_state import ReducedState
from pneumorph.simulation.reference_step import reference_step, unknowns_of

PART = rubber_reduced_part(6, pressures=3, stretches=5)
OBJECTIVE = {"damping": "objective", "stiffness_damping_s": 0.0}
SMALL = motion_of(PART, 0.05, speed=0.02)
"""A motion whose rates change by less in a step than smooth ones may."""


def ahead(
    motion: tuple[np.ndarray, np.ndarray, np.ndarray], **settings: object
) -> BatchedSimulator:
    asked = {"linearised": "ahead", "tangent_tolerance_mm_per_s": 0.0, **OBJECTIVE, **settings}
    return thrown(PART, motion, **asked)


def largest_difference(
    one: ReducedState, other: ReducedState, simulator: BatchedSimulator
) -> float:
    """Of the new velocities, relative to the largest."""
    a, b = (unknowns_of(simulator.robots[0], each) for each in (one, other))
    return float(np.abs(a - b).max() / np.abs(b).max())


@pytest.mark.parametrize("instruction_set", ["best", "avx2", "baseline"])
@pytest.mark.parametrize(("precision", "tolerance"), [("double", 1e-10), ("single", 1e-2)])
def test_a_smooth_step_equals_the_reference(instruction_set, precision, tolerance):
    """The first one begins where it is, as nothing is known of the motion before; tolerances are
    those of the usual step (test_rubber_step.py)."""
    simulator = ahead(
        SMALL, element_precision=precision, instruction_set=instruction_set, time_step_s=0.002
    )
    before, differs = None, []
    for _ in range(8):
        state = simulator.state(0)
        expected, at_the_start = (
            reference_step(
                simulator.robots[0], simulator.physics, state, COMMAND, rates_before=rates
            )
            for rates in (before, None)
        )
        before = state.mode_rates
        simulator.advance(COMMAND[None], 1)
        got = simulator.state(0)
        assert largest_difference(got, expected, simulator) < tolerance
        strains = np.abs(expected.springs).max() + 1e-9
        assert np.abs(got.springs - expected.springs).max() < tolerance * strains
        differs.append(largest_difference(expected, at_the_start, simulator) > 1e-6)
    assert sum(differs) > 2  # there is something to be wrong by
    assert not differs[0]


@pytest.mark.parametrize(
    ("motion", "settings"),
    [
        (motion_of(PART, 0.5, speed=30.0), {}),
        (SMALL, {"stiffness_damping_s": 0.004}),
        (SMALL, {"damping": "published"}),
    ],
)
def test_other_steps_begin_where_they_are(motion, settings):
    """Rates that change by ten times as much, and other dampings than that of branches."""
    elastic = replace(PART, relaxation_weight=np.zeros(0), relaxation_time=np.zeros(0))
    part = elastic if settings.get("damping") == "published" else PART
    ends = []
    for linearised in ("start", "ahead"):
        asked = {"linearised": linearised, "tangent_tolerance_mm_per_s": 0.0}
        simulator = thrown(part, motion, **asked, **{**OBJECTIVE, **settings})
        simulator.advance(COMMAND[None], 3)
        ends.append(simulator.read("modes"))
    np.testing.assert_array_equal(*ends)


def swing(step_s: float, linearised: str) -> np.ndarray:
    """Modes after 0.16 s of swinging freely on a hub that hardly moves, with kept stiffness."""
    held = replace(HUB, mass=1e9, second_moment=1e12 * np.eye(3))
    physics = replace(
        PHYSICS, floor_height_mm=-1e9, gravity_mm_per_s2=0.0, time_step_s=step_s,
        mass_damping_per_s=0.0, pressure_rate_kPa_per_s=1e9, **OBJECTIVE,
    )  # fmt: skip
    stepper = replace(FRESH, linearised=linearised)
    simulator = BatchedSimulator([Robot(held, (Mount(PART, POSE, (1,)),))], physics, stepper, 1)
    slowest = np.linalg.eigh(PART.stiffness(np.zeros(PART.mode_count)))[1][:, 0]
    simulator.write(0, "mode_rates", np.pad(20.0 * slowest, (0, 2)))
    simulator.advance(np.zeros((1, 2)), round(0.16 / step_s))
    return np.array(simulator.read("modes")[0, 0, : PART.mode_count])


def test_both_ways_have_one_limit():
    """First order, both: from halving to halving their changes, and what parts them, fall to half,
    here within a seventh of it."""
    ways = {name: [swing(0.004 / 2**k, name) for k in range(4)] for name in ("start", "ahead")}
    for ends in ways.values():
        changes = [np.linalg.norm(b - a) for a, b in pairwise(ends)]
        assert changes[2] / changes[1] == pytest.approx(0.5, rel=0.15)
    apart = [np.linalg.norm(a - b) for a, b in zip(*ways.values(), strict=True)]
    assert apart[0] > 1e-3
    assert apart[3] / apart[2] == pytest.approx(0.5, rel=0.15)


def test_a_robot_at_rest_stays():
    """f at the end less h K u of no rates is f at the start."""
    usual, other = (
        ahead((np.zeros(6), np.zeros(6), np.zeros(6)), linearised=name, gravity_mm_per_s2=0.0)
        for name in ("start", "ahead")
    )
    for simulator in (usual, other):
        simulator.advance(np.zeros((1, 2)), 5)
        assert np.abs(simulator.read("modes")).max() < 1e-9
