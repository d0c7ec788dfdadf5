"""Robots that learn go through few states, for which few of their legs' points do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.layers import layered
from pneumorph.base.progress import Progress
from pneumorph.catalogue.robot_identity import reduction_digest
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import CooptSettings
from pneumorph.study.learning_robots import learning_robots, states_of_modules
from pneumorph.study.training_options import quick_training

PLATE = Path(__file__).parent.parent.parent / "examples" / "plate.toml"


@pytest.fixture(scope="module")
def settings() -> CooptSettings:
    return quick_training().coopt


@pytest.fixture(scope="module")
def whole() -> RobotSpec:
    return RobotOptions().spec()


@pytest.fixture(scope="module")
def learning(whole: RobotSpec, settings: CooptSettings) -> RobotSpec:
    return learning_robots(whole, settings)


def test_they_have_fewer_points_which_stand_for_all_where_they_walk(
    whole: RobotSpec, learning: RobotSpec, settings: CooptSettings
) -> None:
    part, every = (
        each.module.reduced for each in (learning, whole.with_fewer_modes(settings.learning_modes))
    )
    assert part.mode_count == every.mode_count == settings.learning_modes
    assert len(part.tetrahedron_index) < 0.5 * len(every.tetrahedron_index)
    assert part.tetrahedron_weight.min() > 0.0
    # In states that they were not chosen on, errors are as far as tolerated, in the energy of the
    # displacement that they cause: a residual over many states, three times it in the mean of some.
    (states,) = states_of_modules(learning, settings, seed=1).values()
    shares = []
    for state in states[::20]:
        forces = every.internal_force(state, "polar")
        wrong = part.internal_force(state, "polar") - forces
        energies = (
            each @ np.linalg.solve(every.stiffness(state, "polar"), each)
            for each in (wrong, forces)
        )
        shares.append(np.sqrt(np.divide(*energies)))
    assert np.mean(shares) < 3.0 * settings.learning_tolerance


def test_they_are_the_same_whatever_the_number_of_threads(
    whole: RobotSpec, learning: RobotSpec, settings: CooptSettings
) -> None:
    """Of the engine; sums of the search have one thread."""
    again = learning_robots(replace(whole, thread_count=1), settings)
    assert reduction_digest(again) == reduction_digest(learning) != reduction_digest(whole)


def test_what_they_learn_on_is_told(
    whole: RobotSpec, settings: CooptSettings, capsys: pytest.CaptureFixture[str]
) -> None:
    learning = learning_robots(whole, settings, Progress())
    points = learning.module.points
    assert points is not None
    assert f"{points.count} of its 304 points" in capsys.readouterr().err


def test_where_gaits_count_as_they_are_seen_all_points_stay(
    whole: RobotSpec, settings: CooptSettings
) -> None:
    assert learning_robots(whole, replace(settings, objective=Objective())) is whole
    every = learning_robots(whole, replace(settings, learning_tolerance=0.0))
    assert every.module.points is None


def test_a_kind_of_leg_has_points_of_its_own_and_one_that_no_robot_has_keeps_all() -> None:
    options = layered(quick_training(), [{"robot": {"described": str(PLATE)}}])
    mixed, settings = options.robot.spec(), options.coopt
    long, short = learning_robots(mixed, settings).modules
    assert long.points is not None
    assert short.points is not None
    assert not np.array_equal(long.points.tetrahedron_factor, short.points.tetrahedron_factor)
    of_long = tuple(site.replace("b*", "").strip() for site in settings.space.options)
    without = replace(settings, space=replace(settings.space, options=of_long))
    long, short = learning_robots(mixed, without).modules
    assert long.points is not None
    assert short.points is None
