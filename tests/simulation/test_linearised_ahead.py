"""Steps of silicone that are linearised where their motion leads: nearly the converged step."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from helpers.crawlers import FRESH, PHYSICS
from helpers.one_leg import COMMAND, HUB, POSE, motion_of, thrown
from helpers.synthetic_part import rubber_reduced_part, synthetic_reduced_part
from scipy.linalg import eigh

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.reduction.modal_equilibrium import modal_tangent, rising_modal_equilibria
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.reduced_state import ReducedState
from pneumorph.simulation.reference_forces import elastic_forces, relaxing_forces
from pneumorph.simulation.reference_step import reference_step, unknowns_of

PART = rubber_reduced_part(6, pressures=3, stretches=5)
EXAMPLES = Path(__file__).parents[2] / "examples"
TURNING = "0.1+1.0.2+3.3+3.0.0.3+2"
"""A design of examples/two_chambers.toml."""
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


@pytest.mark.parametrize("law", ["corotational", "stable_neo_hookean"])
def test_parts_of_other_laws_begin_where_they_are(law):
    """However smoothly they move; the reference as the engine. Beside a leg of silicone, which is
    linearised ahead, as well. Tolerances are those of a smooth step."""
    other = synthetic_reduced_part(6, law=law)
    physics = replace(PHYSICS, floor_height_mm=-1e6, pressure_rate_kPa_per_s=1e9, **OBJECTIVE)
    physics = replace(physics, time_step_s=0.002)
    stepper = replace(FRESH, linearised="ahead", tangent_tolerance_mm_per_s=0.0)
    across = Pose(rotation_about("z", 180.0) @ POSE.rotation, POSE.translation * [-1.0, -1.0, 1.0])
    for parts in ((other,), (other, PART)):
        mounts = tuple(Mount(*each, (1,)) for each in zip(parts, (POSE, across), strict=False))
        simulator = BatchedSimulator([Robot(HUB, mounts)], physics, stepper, 1)
        before, differs = None, []
        for _ in range(8):
            state = simulator.state(0)
            expected, at_the_start = (
                reference_step(simulator.robots[0], physics, state, COMMAND, rates_before=rates)
                for rates in (before, None)
            )
            before = state.mode_rates
            simulator.advance(COMMAND[None], 1)
            assert largest_difference(simulator.state(0), expected, simulator) < 1e-10
            differs.append(largest_difference(expected, at_the_start, simulator) > 0.0)
        assert any(differs) == (len(parts) == 2)


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


@pytest.mark.parametrize("share", [0.55, 0.7, 1.0, 2.0, 10.0])
def test_a_stiffness_that_is_not_the_true_one_lets_no_oscillation_grow(share: float) -> None:
    """(46) of one mode of stiffness k, with K = share k, has no growing solution at any step from
    half of k on, as the step from the start. Led by the last rates alone it needs three quarters of
    k: an oscillation from step to step then leads itself on."""
    led = np.array([0.0, 0.5, 0.5])  # h w, of q, h u and h u before
    start, moving, _ = np.eye(3)
    for stiff in np.logspace(-3.0, 6.0, 91):  # h^2 k of a unit mass
        # h u' = (h u - h^2 k (q + h w) + share h^2 k h w) / (1 + share h^2 k)
        new = (moving - stiff * (start + led) + share * stiff * led) / (1.0 + share * stiff)
        growth = np.abs(np.linalg.eigvals(np.array([start + new, new, moving]))).max()
        assert growth < 1.0 + 1e-9


def test_inflated_legs_at_rest_do_not_tremble() -> None:
    """Two-chamber legs held at 90 kPa without floor and gravity, in small steps: their stiffness
    lacks more than a quarter of some modes'. Led by the last rates alone their rates change to and
    fro by 80 in each step."""
    spec = RobotDescription.read(EXAMPLES / "two_chambers.toml").spec()
    physics = replace(spec.physics, gravity_mm_per_s2=0.0, floor_height_mm=-1e4, time_step_s=0.0025)
    own = replace(spec, physics=physics, stepper=replace(FRESH, linearised="ahead"))
    simulator = own.simulator([TURNING])
    command = np.full((1, physics.regulator_count), 90.0)
    simulator.advance(command, 1000)
    rates = []
    for _ in range(3):
        rates.append(simulator.read("mode_rates").copy())
        simulator.advance(command, 1)
    assert np.linalg.norm(rates[0] - 2.0 * rates[1] + rates[2]) < 0.01


def test_the_stiffness_of_a_step_is_more_than_half_of_the_true_one() -> None:
    """Of the leg that ships, up to the highest pressure of its snapshots: so no oscillation from
    step to step grows, led or not. The branches, which both have, are those of the usual step."""
    mount = paper_robot().assembly("1.0.0.2.2.0.0.1").mounts[0]
    part, pressures = mount.part, np.arange(5.0, 106.0, 5.0)
    shares = []
    for kPa, balance in zip(pressures, rising_modal_equilibria(part, pressures), strict=True):
        if kPa not in (60.0, 90.0, 105.0):
            continue  # a step on the way
        alpha = balance.alpha
        springs = np.zeros((len(part.relaxation_weight), len(part.tetrahedron_measure), 6))
        relaxing = relaxing_forces(mount, alpha, alpha, springs, 0.01)[1][6:, 6:]
        taken = elastic_forces(mount, alpha, "objective")[1][6:, 6:] + relaxing
        true = modal_tangent(part, alpha, np.array([kPa])) + relaxing
        shares.append(eigh(true, taken, eigvals_only=True)[-1])
    assert np.all(np.diff(shares) > 0.0)
    assert shares[-1] < 2.0
    np.testing.assert_allclose(shares, [1.16, 1.30, 1.49], atol=0.05)  # as docs/physics.md says
