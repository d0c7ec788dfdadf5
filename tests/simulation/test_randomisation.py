"""Distributions as written, worlds as drawn, and simulators that live in them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.paper_robot import SURFACES, paper_robot
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.physics.air import Air
from pneumorph.physics.physics import Physics
from pneumorph.robot.design import Design
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.distribution import Distribution
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.simulation.randomised_simulator import (
    RandomisedSimulator,
    simulator_in_worlds,
    worlds_of_round,
)
from pneumorph.simulation.regulator_lag import lagging_commands

DESIGN = Design.parse("1.0.0.2.2.0.0.1")
AS_IS = World(1.2, 1.0, 1.0, 0.0, 0.0)
CONSTANT = Randomisation("1.2", "1", "1", "0", "0")


@pytest.mark.parametrize(
    ("text", "mean", "deviation"),
    [
        ("U(1, 3)", 2.0, 2.0 / np.sqrt(12.0)),
        # A normal cut off at three deviations keeps 98.7 % of its deviation.
        ("N(1.2, 0.1)", 1.2, 0.0987),
        ("LogU(1, 4)", 3.0 / np.log(4.0), np.sqrt(7.5 / np.log(4.0) - (3.0 / np.log(4.0)) ** 2)),
        ("0.7", 0.7, 0.0),
    ],
)
def test_moments(text: str, mean: float, deviation: float) -> None:
    """4000 draws: within four standard errors of the mean, and 5 % of the deviation."""
    rng = np.random.default_rng(0)
    distribution = Distribution.parse(text)
    draws = np.array([distribution.draw(rng) for _ in range(4000)])
    assert draws.mean() == pytest.approx(mean, abs=4.0 * deviation / np.sqrt(4000) + 1e-12)
    assert draws.std() == pytest.approx(deviation, rel=0.05, abs=1e-12)
    assert draws.min() >= distribution.lowest


def test_a_measurement_finds_nothing_at_the_ends_of_a_normal() -> None:
    """Beyond three of its deviations lies 0.27 %, which would make 1.5 two draws of three.
    Expected is the product of both densities below 1.5, to four standard errors of its mean."""
    law, rng = Distribution.parse("N(0, 0.5)"), np.random.default_rng(0)
    draws = np.array([law.drawn_given(law.draw(rng), 1.6, 0.1) for _ in range(200)])
    place = np.linspace(0.5, 1.5, 20_001)
    density = np.exp(-2.0 * place**2 - 50.0 * (place - 1.6) ** 2)
    mean = np.average(place, weights=density)
    deviation = np.sqrt(np.average((place - mean) ** 2, weights=density))
    assert draws.max() < 1.5
    assert draws.mean() == pytest.approx(mean, abs=4.0 * deviation / np.sqrt(200.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("U(1; 3)", "cannot be read, expected a number, U"),
        ("B(1, 3)", "cannot be read"),
        ("U(3, 1)", "bounds in the wrong order"),
        ("LogU(0, 1)", "that is not positive"),
        ("N(1, nan)", "cannot be read"),
    ],
)
def test_distributions_without_sense_are_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Distribution.parse(text)


def test_a_distribution_without_sense_is_named() -> None:
    with pytest.raises(ValueError, match=r"^friction 'U\(1.2, 0.25\)' .* expected U\(0.25, 1.2\)"):
        Randomisation(friction="U(1.2, 0.25)")


def test_impossible_worlds_are_refused() -> None:
    with pytest.raises(ValueError, match=r"friction is 'N\(0.3, 0.2\)', which may give -0.3"):
        Randomisation(friction="N(0.3, 0.2)")


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"friction": "U(25, 120)"}, "may give 25; .* at most 10; .* 55 percent are 0.55"),
        ({"friction_by_surface": (("sheet", "60"),)}, "sheet is '60', which may give 60; .* 10"),
        ({"modulus_factor": "U(85, 115)"}, "at most 50; it is a factor: 85 percent are 0.85"),
        ({"regulator_lag_s": "U(0, 100)"}, "may give 100; .* it is in seconds"),
    ],
)
def test_worlds_in_other_units_are_refused(asked: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Randomisation(**asked)


def test_one_distribution_does_not_shift_the_others_draws() -> None:
    usual = Randomisation().draw(np.random.default_rng(3))
    fixed = Randomisation(friction="1.0").draw(np.random.default_rng(3))
    assert fixed.friction == 1.0
    assert replace(fixed, friction=usual.friction) == usual


def _walked(simulator: object, steps: int = 60) -> np.ndarray:
    command = np.array([[60.0, 0.0, 0.0]])
    simulator.reset()  # type: ignore[attr-defined]
    simulator.advance(np.zeros((1, 3)), 15)  # type: ignore[attr-defined]
    simulator.advance(command, steps)  # type: ignore[attr-defined]
    return np.array(simulator.forward_position_mm)  # type: ignore[attr-defined]


def test_the_world_as_it_is_changes_no_bit() -> None:
    robot = paper_robot("published").assembly(DESIGN)
    physics = Physics()
    plain = _walked(BatchedSimulator([robot], physics, thread_count=1))
    np.testing.assert_array_equal(
        _walked(simulator_in_worlds([robot], [AS_IS], physics, thread_count=1)), plain
    )


@pytest.mark.parametrize(
    "change",
    [
        {"friction": 0.3},
        {"modulus_factor": 1.2},
        {"mass_factor": 1.2},
        {"regulator_lag_s": 0.2},
        {"floor_slope_deg": 3.0},
    ],
    ids=lambda change: next(iter(change)),
)
def test_every_quantity_of_a_world_matters(change: dict[str, float]) -> None:
    robot = paper_robot("published").assembly(DESIGN)
    physics = Physics()
    plain = _walked(simulator_in_worlds([robot], [AS_IS], physics, thread_count=1))
    other = _walked(
        simulator_in_worlds([robot], [replace(AS_IS, **change)], physics, thread_count=1)
    )
    assert abs(other[0] - plain[0]) > 0.01


def test_a_hill_stays_one_in_every_world() -> None:
    """Climbing is asked for by the physics; worlds differ by how a floor was levelled."""
    hill = Physics(floor_slope_deg=10.0)
    assert World.nominal(hill).applied_to(hill).floor_slope_deg == 10.0
    rng = np.random.default_rng(0)
    drawn = [Randomisation(floor_slope_deg="N(0, 0.5)").draw(rng) for _ in range(20)]
    slopes = [world.applied_to(hill).floor_slope_deg for world in drawn]
    assert 8.0 < min(slopes) < 10.0 < max(slopes) < 12.0


def test_what_a_seed_drew_before_there_was_air_it_draws_still() -> None:
    """The air's factors come from a generator of their own, whatever they are drawn from."""
    usual = {"friction": "U(0.9, 1.5)", "modulus_factor": "2", "floor_slope_deg": "N(0, 0.5)"}
    earlier = np.random.default_rng([0, 1])
    friction = []
    for _ in range(2):
        friction.append(Distribution.parse("U(0.9, 1.5)").draw(earlier))
        for text in ("2", "U(0.9, 1.1)", "U(0, 0.2)", "N(0, 0.5)"):
            Distribution.parse(text).draw(earlier)
    for law in ("1", "U(0.5, 2)"):
        drawn = Randomisation(**usual, filling_factor=law, venting_factor=law)
        rng = np.random.default_rng([0, 1])
        worlds = [drawn.draw(rng) for _ in range(2)]
        assert [world.friction for world in worlds] == friction
        factors = {f for world in worlds for f in (world.filling_factor, world.venting_factor)}
        assert len(factors) == (1 if law == "1" else 4)


def test_a_training_of_before_there_was_air_is_known_again() -> None:
    """Its checkpoint has the names of then."""
    names = {"friction", "modulus_factor", "mass_factor", "regulator_lag_s", "floor_slope_deg"}
    assert set(Randomisation().described()) == names
    drawn = Randomisation(venting_factor="U(0.5, 2)").described()
    assert drawn["venting_factor"] == "U(0.5, 2)"
    assert set(drawn) == names | {"venting_factor"}


AIR = Physics(air=Air(law="orifice"))


@pytest.mark.parametrize("name", ["filling_factor", "venting_factor"])
def test_factors_on_valves_are_factors_on_time(name: str) -> None:
    """Through twice the conductance a pressure is where it otherwise is after twice the time."""
    robot = paper_robot("published").assembly(DESIGN)
    up, down = np.array([[80.0, 40.0, 0.0]]), np.zeros((1, 3))
    commands, steps = ([up], 20) if name == "filling_factor" else ([up, down], 4)

    def pressures(factor: float, last: int) -> np.ndarray:
        world = replace(AS_IS, **{name: factor})
        simulator = simulator_in_worlds([robot], [world], AIR, thread_count=1)
        for number, command in enumerate(commands):
            simulator.advance(command, last if number == len(commands) - 1 else 150)
        return np.array(simulator.simulator.read("regulated")[0])

    slow, quick = pressures(1.0, 2 * steps), pressures(2.0, steps)
    assert 5.0 < slow[0] < 75.0
    np.testing.assert_allclose(quick, slow, rtol=1e-12)


def test_robots_in_worlds_of_unlike_air_are_each_as_alone() -> None:
    robots = [
        paper_robot("published").assembly(each) for each in (DESIGN, "1.1.1.2.2.0.0.1", DESIGN)
    ]
    drawn = Randomisation(filling_factor="U(0.5, 2)", venting_factor="U(0.5, 2)")
    simulator = RandomisedSimulator(robots, AIR, drawn, seed=1, world_count=3)
    command = np.tile([60.0, 0.0, 0.0], (3, 1))
    simulator.advance(command, 40)
    together = simulator.forward_position_mm
    for number, world in enumerate(simulator.worlds):
        alone = simulator_in_worlds([robots[number]], [world], AIR, thread_count=1)
        alone.advance(command[:1], 40)
        assert alone.forward_position_mm[0] == together[number]
    # And side by side in one world: unlike numbers of legs are unlike chambers.
    batch = BatchedSimulator(robots, AIR, thread_count=2)
    batch.advance(command, 20)
    regulated = batch.read("regulated")
    np.testing.assert_array_equal(regulated[0], regulated[2])
    assert regulated[1, 0] < 0.7 * regulated[0, 0]  # four legs, not two
    single = BatchedSimulator(robots[1:2], AIR, thread_count=1)
    single.advance(command[:1], 20)
    np.testing.assert_array_equal(single.read("regulated")[0], regulated[1])


def test_surfaces_have_distributions_of_their_own() -> None:
    """What else a seed draws stays; surfaces that only the physics names keep their coefficient."""
    named = Randomisation(friction_by_surface=(("sheet", "U(0.4, 1.0)"), ("hub", "0.3")))
    world, usual = (each.draw(np.random.default_rng(3)) for each in (named, Randomisation()))
    assert replace(world, friction_by_surface=()) == usual
    drawn = dict(world.friction_by_surface)
    assert 0.4 < drawn["sheet"] < 1.0
    assert drawn["hub"] == 0.3
    physics = Physics(friction_by_surface=(("skin", 0.7), ("hub", 0.9)))
    expected = {"skin": 0.7, "hub": 0.3, "sheet": drawn["sheet"]}
    assert dict(world.applied_to(physics).friction_by_surface) == expected
    robot = paper_robot("published").assembly(DESIGN)
    icy, gripping = (
        _walked(simulator_in_worlds([robot], [replace(AS_IS, friction_by_surface=(("sheet", mu),))],
                                   Physics(), thread_count=1))
        for mu in (0.2, 1.0)
    )  # fmt: skip
    assert abs(icy[0] - gripping[0]) > 0.01
    with pytest.raises(ValueError, match=r"sheet is 'N\(0.3, 0.2\)', which may give -0.3"):
        Randomisation(friction_by_surface=(("sheet", "N(0.3, 0.2)"),))
    with pytest.raises(ValueError, match="names 'sheet' 2 times, expected each"):
        Randomisation(friction_by_surface=(("sheet", "0.3"), ("sheet", "0.4")))


def test_the_papers_surfaces_are_drawn_over_what_is_known_of_them() -> None:
    world = measured_worlds().draw(np.random.default_rng(0))
    for name, value in world.friction_by_surface:
        assert SURFACES[name].low <= value <= SURFACES[name].high
        assert SURFACES[name].source
    for surface in SURFACES.values():
        # As far from one end as from the other in proportion, to two digits behind the point.
        middle = surface.nominal
        assert middle / surface.low == pytest.approx(surface.high / middle, rel=0.05)
    known = paper_robot("published").assembly(DESIGN).contact_surfaces.known_names()
    assert sorted(SURFACES) == known == ["hub", "sheet", "skin"]


def test_lagging_regulators_follow_a_first_order_filter() -> None:
    """After a time t of one command c the filter is at c (1 - exp(-t / lag)), the rate allowing;
    for five steps of 0.01 s at a time the pressure is at its mean over them."""
    robot = paper_robot("published").assembly(DESIGN)
    lag, steps = 0.3, 60
    simulator = simulator_in_worlds(
        [robot], [replace(AS_IS, regulator_lag_s=lag)], Physics(), thread_count=1
    )
    simulator.advance(np.array([[10.0, 20.0, 0.0]]), steps)
    regulated = simulator.simulator.read("regulated")[0]
    missing = (np.exp(-0.55 / lag) - np.exp(-0.6 / lag)) * lag / 0.05
    np.testing.assert_allclose(regulated[:2], np.array([10.0, 20.0]) * (1.0 - missing))
    simulator.reset()
    simulator.advance(np.array([[10.0, 20.0, 0.0]]), steps)
    np.testing.assert_array_equal(simulator.simulator.read("regulated")[0], regulated)


@pytest.mark.parametrize("lag", [0.01, 0.05, 0.1])
def test_a_command_comes_as_late_as_the_lag(lag: float) -> None:
    """The mean delay of a first-order filter's answer to a step is its time constant: the integral
    of what is missing, over the step. What is still missing at the end is exp(-2 / lag) of it."""
    commands = np.full((200, 1), 40.0)
    missing = 1.0 - lagging_commands(commands, lag, 0.01) / commands
    assert 0.01 * missing.sum() == pytest.approx(lag * (1.0 - np.exp(-2.0 / lag)), rel=1e-9)


def test_commands_of_a_gait_lag_as_the_simulators_do() -> None:
    """At every fifth step, where both renew them; steps between are held."""
    robot = paper_robot("published").assembly(DESIGN)
    world = replace(AS_IS, regulator_lag_s=0.2)
    simulator = simulator_in_worlds([robot], [world], Physics(pressure_rate_kPa_per_s=1e9))
    commands = np.repeat(np.array([[10.0, 20.0, 0.0], [40.0, 0.0, 5.0]]), 10, axis=0)
    lagging = lagging_commands(commands, 0.2, 0.01)
    for step in (0, 10):
        for part in range(2):
            simulator.advance(commands[step][None], 5)
            regulated = simulator.simulator.read("regulated")[0]
            np.testing.assert_allclose(regulated, lagging[step + 5 * part + 4], rtol=1e-12)
    assert lagging_commands(commands, 0.0, 0.01) is commands


def test_a_roughness_of_zero_is_a_number_of_its_world() -> None:
    """A normal that begins at 0 gives exactly that in one draw of some 700: seed 2 draws one. The
    numbers of a certificate ended in a KeyError, or without the roughness."""
    drawn = Randomisation(friction_by_surface=(("sheet", "0.5"),), ground_roughness_mm="N(3, 1)")
    worlds = worlds_of_round(drawn, seed=2, number=0, count=144)
    expected = [world.ground_roughness_mm for world in worlds]
    level = expected.index(0.0)
    for first in (0, level):
        order = [first, *(place for place in range(144) if place != first)]
        numbers = drawn.numbers_of([worlds[place] for place in order])
        assert list(numbers["ground_roughness_mm"]) == [expected[place] for place in order]
        assert list(numbers["friction sheet"]) == [0.5] * 144
    assert list(numbers) == list(worlds[1 if level == 0 else 0].numbers)
    assert "ground_roughness_mm" not in drawn.numbers_of([worlds[level]] * 2)


def test_a_measurement_narrows_its_own_number_alone() -> None:
    """Of a uniform range far from its ends the draws are the measurement's normal distribution:
    mean and deviation within four standard errors of 400 draws. At an end half of it is left, whose
    mean is 0.798 deviations inside."""
    usual = Randomisation(friction="U(0, 2)", friction_by_surface=(("sheet", "U(0.2, 1.2)"),))
    found = replace(usual, measured=(("friction", 0.7, 0.05), ("friction sheet", 0.2, 0.01)))
    pairs = [
        [each.draw(rng) for _ in range(400)]
        for each in (usual, found)
        for rng in [np.random.default_rng(2)]
    ]
    friction = np.array([world.friction for world in pairs[1]])
    assert friction.mean() == pytest.approx(0.7, abs=4 * 0.05 / 20)
    assert friction.std() == pytest.approx(0.05, rel=4 / np.sqrt(800))
    sheet = np.array([dict(world.friction_by_surface)["sheet"] for world in pairs[1]])
    assert sheet.mean() == pytest.approx(0.2 + 0.798 * 0.01, abs=4 * 0.006 / 20)
    for before, after in zip(*pairs, strict=True):
        same = {"friction": 0.0, "friction_by_surface": ()}
        assert replace(before, **same) == replace(after, **same)


@pytest.mark.parametrize(
    ("measured", "message"),
    [
        (("grip", 1.0, 0.1), "measured names 'grip', expected one of friction, modulus_factor"),
        (("friction", 1.0, 0.0), "with a standard deviation of 0, expected a finite value"),
        (("friction", 3.0, 0.1), "measured friction is 3, expected 0.9 to 1.5 give or take"),
        (("filling_factor", 1.0, 0.1), "filling_factor is 1 and no distribution"),
    ],
)
def test_measurements_without_sense_are_refused(
    measured: tuple[str, float, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        Randomisation(measured=(measured,))


def test_a_number_that_was_measured_twice_is_refused() -> None:
    """The last one counted alone, even where both contradict each other."""
    twice = (("friction", 1.0, 0.02), ("friction", 1.4, 0.02))
    with pytest.raises(ValueError, match="measured names 'friction' 2 times, expected each number"):
        Randomisation(measured=twice)


def test_robots_live_in_their_worlds_and_draws_repeat() -> None:
    robots = [paper_robot("published").assembly(DESIGN) for _ in range(4)]
    physics = Physics()
    simulator = RandomisedSimulator(robots, physics, Randomisation(), seed=5, world_count=2)
    command = np.tile([60.0, 0.0, 0.0], (4, 1))

    def positions(number: int) -> np.ndarray:
        simulator.redraw(number)
        simulator.advance(command, 40)
        return np.array(simulator.forward_position_mm)

    first, other, again = positions(1), positions(2), positions(1)
    np.testing.assert_array_equal(first, again)
    # Robots 0 and 2 share a world, 0 and 1 do not.
    assert first[0] == first[2]
    assert first[0] != first[1]
    assert first[0] != other[0]
    np.testing.assert_array_equal(simulator.status, np.zeros(4))


def test_robots_that_are_refused_are_not_drawn_again() -> None:
    robots = [paper_robot("published").assembly(DESIGN)]
    simulator = RandomisedSimulator(robots, Physics(), Randomisation(), seed=5, world_count=1)
    with pytest.raises(ValueError, match="expected at least one robot"):
        simulator.set_robots([])
    simulator.redraw(1)
    assert len(simulator.status) == 1


def test_worlds_below_a_number_are_the_nominal_one() -> None:
    robots, physics = [paper_robot("published").assembly(DESIGN)], Physics(friction=0.7)
    plain = _walked(BatchedSimulator(robots, physics, thread_count=1))
    simulator = RandomisedSimulator(robots, physics, Randomisation(), 5, 1, nominal_until=10)
    found = {}
    for number in (9, 10, 3):
        simulator.redraw(number)
        found[number] = _walked(simulator)
    assert found[9] == found[3] == plain
    assert found[10] != plain


def test_the_environment_redraws_by_its_seed_alone() -> None:
    task = CrawlingTask(action_count=2, action_step_count=20)

    def make(robots: object) -> RandomisedSimulator:
        return RandomisedSimulator(robots, Physics(), Randomisation(), 0, 2)  # type: ignore[arg-type]

    environment = CrawlingEnvironment([DESIGN] * 2, paper_robot("published").assembly, make, task)

    def rewards(seed: int) -> np.ndarray:
        environment.reset(seed=seed, options={"designs": [DESIGN] * 2})
        return np.array(environment.step(np.full((2, 3), 0.5))[1])

    first, other = rewards(7), rewards(8)
    assert not np.array_equal(first, other)
    np.testing.assert_array_equal(rewards(7), first)


def test_constant_worlds_are_the_plain_simulator() -> None:
    robots = [paper_robot("published").assembly(DESIGN)]
    physics = Physics()
    randomised = RandomisedSimulator(robots, physics, CONSTANT, world_count=3)
    np.testing.assert_array_equal(
        _walked(randomised), _walked(BatchedSimulator(robots, physics, thread_count=1))
    )
