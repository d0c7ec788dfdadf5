"""Factors of earlier trials lead to the same converged step as fresh ones."""

import dataclasses
import time

import numpy as np
import pytest
from helpers.small_robot import small_leg, small_robot

from pneumorph.fem import kept_newton
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.kept_newton import EVENLY
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.step_problem import StepProblem
from pneumorph.fem.time_integration import StepError
from pneumorph.fem.yeoh_constants import yeoh_material
from pneumorph.geometry.pose import rotation_about
from pneumorph.physics.physics import Physics

PHYSICS = Physics(
    floor_height_mm=0.0,
    regulator_count=2,
    damping="objective",
    mass_damping_per_s=0.0,
    stiffness_damping_s=0.0,
    friction=0.6,
)
COMMANDS = np.tile([20.0, 5.0], (8, 1))


@pytest.fixture(scope="module")
def leg() -> PartModel:
    """Rubber that relaxes on a stiff sheet."""
    mesh = small_leg().mesh
    sheet = Membrane("bottom", Material(2e4, 0.3, "st_venant_kirchhoff"), 0.1)
    rubber, relaxation = yeoh_material(50.0, 8.0, -1.0), PronySeries((0.1, 0.2), (0.65, 0.02))
    return PartModel(mesh, rubber, 0.02, (sheet,), "cavity", relaxation=relaxation)


def robot(leg, matrix="kept", physics=PHYSICS, soft=False, **numerics):
    settings = FullOrderSettings("implicit_euler", newton_matrix=matrix, **numerics)
    return small_robot(physics, soft=soft, leg=leg, numerics=settings)


def walked(made):
    return made.rollout(made.initial_state(), COMMANDS)[0]


@pytest.mark.parametrize(("soft", "friction"), [(False, 0.3), (True, 0.0)])
def test_a_walk_is_that_of_fresh_factors(leg, soft, friction):
    """Steps of both end within the tolerance of the same equations. Impulses unbalanced by 1e-10 of
    those at work, 2 mN s, move a node of 1e-4 kg by at most 2e-6 mm/s, and contacts are solved to
    1e-7 mm/s: over 8 steps of 0.01 s less than 1e-6 mm. (Where friction is high the contact law may
    have several solutions, and the two may take different ones.)"""
    physics = dataclasses.replace(PHYSICS, friction=friction)
    kept, fresh = (
        walked(robot(leg, matrix, physics, soft, newton_tolerance=1e-10))
        for matrix in ("kept", "fresh")
    )
    assert fresh.active_contacts > 0
    for x, y in zip(kept.positions, fresh.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-6)


def test_threads_change_no_bit(leg):
    one, two = (walked(robot(leg, thread_count=count)) for count in (1, 2))
    for x, y in zip(one.positions, two.positions, strict=True):
        np.testing.assert_array_equal(x, y)


def rested(made):
    """The robot after it was inflated and has come to rest, so that it keeps its factors."""
    state = made.initial_state()
    for _ in range(60):
        state = made.step(state, COMMANDS[0])
    return state


def test_factors_are_kept_while_a_robot_rests(leg):
    made = robot(leg)
    state = rested(made)
    before = made.kept.made
    for _ in range(5):
        state = made.step(state, COMMANDS[0])
    assert made.kept.made == before


def test_what_turns_evenly_is_foreseen_unstretched():
    """A body that turned by 0.2 radian in the last step and goes straight on is stretched by 0.04.
    The tangent of its sheet there, with the stress of turning on, resists no rotation."""
    rubber = yeoh_material(0.02, 0.0, 0.0, bulk_over_shear=5.0)
    sheet = Membrane("bottom", Material(2e5, 0.3, "st_venant_kirchhoff"), 0.1)
    part = PartModel(small_leg().mesh, rubber, 0.02, (sheet,))
    start = part.rest_nodes
    change = start - start @ rotation_about("y", -np.degrees(0.2)).T
    spin = np.cross([0.3, 1.0, -0.5], start + change).ravel()

    def resistance(foreseen):
        data = np.zeros(len(part.assembly.indices))
        part.compiled.force_and_tangent(start + change, 0.0, None, data, 1.0, foreseen)
        return np.abs(part.assembly.matrix(data) @ spin).max()

    assert resistance(EVENLY * change) < 1e-4 * resistance(None)  # the rubber's share


def test_what_is_foreseen_of_a_leg_is_how_it_moves(leg, monkeypatch):
    """In a step of 10 ms a few millimetres at most, where its nodes lie up to 40 mm from there."""
    foreseen = []
    matrix = StepProblem.implicit_matrix

    def noted(problem, number, trial, *changes):
        foreseen.extend(np.abs(change).max() for change in changes)
        return matrix(problem, number, trial, *changes)

    monkeypatch.setattr(StepProblem, "implicit_matrix", noted)
    walked(robot(leg))
    assert len(foreseen) > 2
    assert 0.0 < max(foreseen) < 10.0


def test_a_displacement_tolerance_is_kept(leg):
    """Each of 8 steps ends within 1e-6 mm, root mean square by mass, of where balance would have
    it, and a robot forgets an error rather than that it grows: 2e-5 mm at any node leaves a factor
    of 20 from the mean to the worst. It takes fewer iterations."""
    close = robot(leg, displacement_tolerance_mm=1e-6)
    balanced = robot(leg, newton_tolerance=1e-10)
    one, other = (made.initial_state() for made in (close, balanced))
    iterations = np.zeros(2)
    for command in COMMANDS:
        one, other = close.step(one, command), balanced.step(other, command)
        iterations += one.iterations, other.iterations
    for x, y in zip(one.positions, other.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=2e-5)
    assert iterations[0] < iterations[1]


def test_a_leg_that_turns_gets_a_factor_of_its_own(leg, monkeypatch):
    """Where no turn is small enough each of two legs gets one in each step at least, on its way
    through the step too, and the end is the same to the tolerance, as in the first test."""
    usual, strict = (robot(leg, newton_tolerance=1e-10) for _ in range(2))
    expected = walked(usual)
    monkeypatch.setattr(kept_newton, "FURTHEST_TURN", 1e-12)
    found = walked(strict)
    assert strict.kept.made > max(usual.kept.made, 4 * len(COMMANDS))
    for x, y in zip(found.positions, expected.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-6)


def test_a_state_from_elsewhere_gets_factors_of_its_own(leg):
    """What a robot did before decides no bit of a walk that begins anew."""
    used, new = robot(leg), robot(leg)
    rested(used)
    for x, y in zip(walked(used).positions, walked(new).positions, strict=True):
        np.testing.assert_array_equal(x, y)


def test_a_stiffness_damping_is_felt(leg):
    """It is no part of what the engine adds up, and so is added beside."""
    damped = dataclasses.replace(PHYSICS, stiffness_damping_s=0.05)
    kept, fresh = (
        walked(robot(leg, matrix, damped, newton_tolerance=1e-10)) for matrix in ("kept", "fresh")
    )
    free = walked(robot(leg))
    for x, y, z in zip(kept.positions, fresh.positions, free.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-5)
        assert np.abs(x - z).max() > 0.01


def test_a_stiff_sheet_that_turns_is_damped_as_it_lies_at_the_start():
    """At a trial's end, what only turns by 0.03 seems stretched by 0.0005; the damping of that
    stretch of a sheet of 2 GPa halved these eight steps to thirty."""
    sheet = Membrane("bottom", Material(2e6, 0.3, "st_venant_kirchhoff"), 0.1)
    rubber = yeoh_material(50.0, 8.0, -1.0)
    part = PartModel(small_leg().mesh, rubber, 0.02, (sheet,), "cavity")
    physics = dataclasses.replace(
        PHYSICS, damping="published", stiffness_damping_s=0.1, floor_height_mm=-1e3
    )
    made, spin = robot(part, physics=physics), np.array([0.0, 3.0, 0.0])
    state = made.initial_state()
    state = dataclasses.replace(
        state,
        hub=dataclasses.replace(state.hub, velocity=np.array([0.0, 0.0, 0.0, *spin])),
        velocities=tuple(np.cross(spin, x) for x in state.positions),
    )
    parts = 0
    for command in COMMANDS:
        state = made.step(state, command)
        parts += state.substeps
    assert parts <= 2 * len(COMMANDS)


def thrown(made, speed):
    """The state of a robot whose legs are thrown at the floor, their tips first."""
    state, velocities = made.initial_state(), []
    for x in state.positions:
        away = np.linalg.norm(x[:, :2], axis=1)
        down = np.where(away > 16.0, -speed * away / 40.0, 0.0)
        velocities.append(np.outer(down, [0.0, 0.0, 1.0]))
    return dataclasses.replace(state, velocities=tuple(velocities))


def test_a_step_that_does_not_converge_is_halved(leg):
    made = robot(leg, newton_iterations=4)
    state = thrown(made, 1000.0)
    parts = []
    for command in COMMANDS:
        state = made.step(state, command)
        parts.append(state.substeps)
    assert max(parts) > 1
    assert state.regulated_kPa[0] == pytest.approx(12.0)  # 150 kPa/s for 0.08 s


def test_laws_that_the_engine_lacks_are_refused():
    made = robot(small_leg())
    with pytest.raises(ValueError, match='newton_matrix is "kept", expected "fresh"'):
        made.step(made.initial_state(), np.zeros(2))


def test_what_decides_nothing_is_no_part_of_kept_settings():
    usual = FullOrderSettings().described()
    assert "newton_matrix" not in usual
    assert FullOrderSettings(thread_count=2).described() == usual
    kept = FullOrderSettings("implicit_euler", newton_matrix="kept")
    assert kept.described()["newton_matrix"] == "kept"
    for settings in (usual, kept.described()):
        assert "displacement_tolerance_mm" not in settings
    closer = dataclasses.replace(kept, displacement_tolerance_mm=1e-5)
    assert closer.described()["displacement_tolerance_mm"] == 1e-5


def test_what_is_set_of_newtons_method_where_it_is_not_used_is_no_part_of_kept_settings():
    """The steps are the same; what earlier versions kept of usual settings is found."""
    usual = FullOrderSettings()
    assert (usual.described()["newton_tolerance"], usual.described()["newton_iterations"]) == (
        1e-8, 30,
    )  # fmt: skip
    own = {"newton_tolerance": 1e-5, "newton_iterations": 7, "newton_matrix": "kept"}
    unused = dataclasses.replace(usual, displacement_tolerance_mm=1e-5, **own)
    assert unused.described() == usual.described()
    used = dataclasses.replace(unused, integrator="implicit_euler").described()
    assert {name: used[name] for name in own} == own
    assert used["displacement_tolerance_mm"] == 1e-5
    fresh = FullOrderSettings("implicit_euler", displacement_tolerance_mm=1e-5)
    assert fresh.described() == FullOrderSettings("implicit_euler").described()


def test_points_that_the_floor_presses_may_be_held(leg, monkeypatch):
    """Where a matrix is indefinite without, its pressed points are held: it is the same step, to
    the tolerance of the first test, and where all that is pressed sticks it takes no more than
    twice the iterations."""
    usual, held = (robot(leg, newton_tolerance=1e-10) for _ in range(2))
    start = rested(usual)
    assert start.impulses[:, 0].max() > 0.0
    calls = []

    class Buckling(kept_newton.KeptLeg):
        def __init__(self, mounted, data, x, weight):
            if not calls or calls[-1] is not data:
                raise np.linalg.LinAlgError("not held")
            super().__init__(mounted, data, x, weight)

    def hold(leg, data, *pressed, original=kept_newton.hold_pressed):
        before = data.copy()
        original(leg, data, *pressed)
        assert (data != before).any()
        calls.append(data)

    monkeypatch.setattr(kept_newton, "KeptLeg", Buckling)
    monkeypatch.setattr(kept_newton, "hold_pressed", hold)
    usual.kept.forget(range(len(usual.legs)))
    command = np.array([24.0, 4.0])
    end = held.step(start, command)
    assert calls
    monkeypatch.undo()
    expected = usual.step(start, command)
    assert end.iterations <= 2 * expected.iterations
    for x, y in zip(end.positions, expected.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-6)


def test_a_robot_on_which_nothing_acts_stays_where_it_is(leg):
    """Without weight and pressure there is no impulse that what is unbalanced could be small
    beside, and rounding does not shrink."""
    physics = dataclasses.replace(PHYSICS, gravity_mm_per_s2=0.0, floor_height_mm=-1e3)
    made = robot(leg, physics=physics, displacement_tolerance_mm=1e-5)
    start = state = made.initial_state()
    for _ in range(3):
        state = made.step(state, np.zeros(2))
    assert state.substeps == 1
    for x, y in zip(state.positions, start.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-7)
    for command in COMMANDS:  # pressure that is felt from 5 kPa on, after four steps
        state = made.step(state, command)
    assert np.abs(state.positions[0] - start.positions[0]).max() > 1e-4


def on_stiff_sheet(young):
    """Rubber that relaxes on a sheet of 2 GPa."""
    sheet = Membrane("bottom", Material(2e6, 0.3, "st_venant_kirchhoff"), 0.1)
    rubber, relaxation = yeoh_material(young, 0.0, 0.0), PronySeries((0.1, 0.2), (0.65, 0.02))
    return PartModel(small_leg().mesh, rubber, 0.02, (sheet,), "cavity", relaxation=relaxation)


@pytest.mark.parametrize("young", [20.0, 100.0])
@pytest.mark.parametrize("speed", [500.0, 1000.0])
def test_a_stiff_sheet_that_springs_does_so_within_one_step(young, speed):
    """Legs thrown at the floor, their tips first: with factors of the first trial alone three of
    these four needed halved steps."""
    made = robot(on_stiff_sheet(young), displacement_tolerance_mm=1e-5)
    state = thrown(made, speed)
    for command in COMMANDS:
        state = made.step(state, 3.0 * command)
        assert state.substeps == 1


def test_the_leg_that_springs_has_factors_of_more_trials(monkeypatch):
    """One of two legs is thrown at the floor; the other rests, which lets it keep its factor."""
    made = robot(on_stiff_sheet(20.0), displacement_tolerance_mm=1e-5)
    start = thrown(made, 300.0)
    start = dataclasses.replace(
        start, velocities=(start.velocities[0], np.zeros_like(start.velocities[1]))
    )
    fresh = []

    def renew(*arguments, original=kept_newton._renew):
        fresh.append(original(*arguments))
        return fresh[-1]

    monkeypatch.setattr(kept_newton, "_renew", renew)
    assert made.step(start, COMMANDS[0]).substeps == 1
    assert fresh[0] == {0, 1}
    assert sum(1 in each for each in fresh) < sum(0 in each for each in fresh)


def test_a_step_far_beyond_the_lowest_energy_is_not_taken_whole(monkeypatch):
    """Legs thrown at the floor: with all of every Newton step none of both beginnings leads to the
    end."""
    part = on_stiff_sheet(20.0)
    shares = []

    def share(slope, original=kept_newton.share_of_step):
        shares.append(original(slope))
        return shares[-1]

    monkeypatch.setattr(kept_newton, "share_of_step", share)
    made = robot(part, displacement_tolerance_mm=1e-5)
    assert made.step(thrown(made, 6000.0), COMMANDS[0]).substeps == 1
    assert min(shares) < 0.5
    monkeypatch.setattr(kept_newton, "share_of_step", lambda slope: 1.0)
    whole = robot(part, displacement_tolerance_mm=1e-5)
    assert whole.step(thrown(whole, 6000.0), COMMANDS[0]).substeps > 1


@pytest.mark.parametrize("thread_count", [1, 2])
def test_no_leg_goes_on_behind_one_that_has_failed(leg, thread_count):
    made, done = robot(leg, thread_count=thread_count), []

    def work(number):
        if number == 0:
            raise np.linalg.LinAlgError("indefinite")
        time.sleep(0.2)
        done.append(number)

    with pytest.raises(np.linalg.LinAlgError):
        made.each_leg(work)
    before = list(done)
    time.sleep(0.4)
    assert done == before


def unstable(monkeypatch, count):
    """Have so many matrices of legs be indefinite unless they are four times as heavy."""
    left = [count]

    class Unstable(kept_newton.KeptLeg):
        def __init__(self, mounted, data, x, weight):
            if weight < 4.0 and left[0] > 0:
                left[0] -= 1
                raise np.linalg.LinAlgError("unstable")
            super().__init__(mounted, data, x, weight)

    monkeypatch.setattr(kept_newton, "KeptLeg", Unstable)


def test_a_leg_is_made_heavier_where_its_matrix_is_indefinite(leg, monkeypatch):
    """At the first trial, for both legs four matrices each: it is the same step, to the tolerance
    of the first test, in more iterations."""
    usual, heavy = (robot(leg, newton_tolerance=1e-10) for _ in range(2))
    start = usual.initial_state()
    expected = usual.step(start, COMMANDS[0])
    unstable(monkeypatch, 8)
    end = heavy.step(start, COMMANDS[0])
    assert end.substeps == 1
    assert end.iterations > expected.iterations
    for x, y in zip(end.positions, expected.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-6)


def test_no_step_ends_where_a_leg_is_unstable(leg, monkeypatch):
    """Balance that holds with a heavier leg alone is the end of no step, whole or in parts, and
    factors of it are left to none."""
    made = robot(leg, displacement_tolerance_mm=1e-5, step_halvings=2)
    unstable(monkeypatch, 10**6)
    with pytest.raises(StepError, match="settles where leg 0 is unstable"):
        made.step(made.initial_state(), COMMANDS[0])


def test_a_step_that_leads_away_begins_again_from_rest(leg, monkeypatch):
    """From a trial that is far off no iteration is left; from rest it is the same step."""
    usual, lost = (robot(leg, newton_tolerance=1e-10) for _ in range(2))
    start = usual.initial_state()
    expected = usual.step(start, COMMANDS[0])

    def astray(problem):
        rest = problem.standing()
        nowhere = [np.full_like(v, np.nan) for v in rest.velocities]
        return problem._moved(rest.hub.velocity, nowhere, rest.impulses, rest.contact_velocities)

    monkeypatch.setattr(kept_newton.StepProblem, "going_on", astray)
    end = lost.step(start, COMMANDS[0])
    assert end.substeps == 1
    assert lost.kept.iterations == end.iterations > expected.iterations
    for x, y in zip(end.positions, expected.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-6)


def test_a_hub_that_legs_would_topple_is_held_by_heavier_ones(leg, monkeypatch):
    """A leg's matrix that is definite may stand because of its hold on the hub alone; then all are
    made anew, heavier, and it is the same step."""
    usual, toppled = (robot(leg, newton_tolerance=1e-10) for _ in range(2))
    start = usual.initial_state()
    expected = usual.step(start, COMMANDS[0])
    weights = []

    def target(robot, problem, legs, now, original=kept_newton._target):
        weights.append([leg.weight for leg in legs])
        if len(weights) <= 2:
            raise np.linalg.LinAlgError("the hub's matrix")
        return original(robot, problem, legs, now)

    monkeypatch.setattr(kept_newton, "_target", target)
    end = toppled.step(start, COMMANDS[0])
    assert end.substeps == 1
    assert weights[:3] == [[0.0, 0.0], [1.0, 1.0], [4.0, 4.0]]
    for x, y in zip(end.positions, expected.positions, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-6)
