"""Gymnasium finds the crawling robots by name once the package is imported."""

from __future__ import annotations

import pickle
import subprocess
import sys
import warnings
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.passive_env_checker import check_action_space, check_observation_space
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.registration import (
    ENVIRONMENT_ID,
    make_single_env,
    register_environments,
)
from pneumorph.environment.single_crawling_environment import SingleCrawlingEnvironment
from pneumorph.robot.design import Design

DESIGN = "1.2.0.0.3.0.0.0"
PLATE = Path(__file__).parents[2] / "examples/plate.toml"


def run_python(program: str) -> str:
    """What a program prints in an interpreter of its own, where a warning is an error."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.parametrize(
    "program",
    [
        "import gymnasium, pneumorph; made = gymnasium.make('pneumorph/Crawl-v0')",
        "import gymnasium; made = gymnasium.make('pneumorph:pneumorph/Crawl-v0')",
    ],
)
def test_import_registers_the_name(program: str) -> None:
    assert run_python(f"{program}; print(type(made.unwrapped).__name__)") == (
        SingleCrawlingEnvironment.__name__
    )


def test_import_stays_light() -> None:
    """What takes most of a second to import waits until a name is used."""
    heavy = {"jax", "scipy", "matplotlib", "equinox", "av", "PIL", "tyro", "pneumorph._engine"}
    loaded = run_python("import pneumorph, sys; print(*sys.modules)").split()
    assert "gymnasium" in loaded
    assert heavy & set(loaded) == set()


def test_one_robot_by_name_passes_the_checker() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = gymnasium.make(ENVIRONMENT_ID, design=DESIGN)
        check_env(made.unwrapped)
    observation, _ = made.reset(seed=0)
    np.testing.assert_array_equal(observation[12:], Design.parse(DESIGN).one_hot(3))


def test_many_robots_by_name_are_one_batch_with_sound_spaces() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = gymnasium.make_vec(ENVIRONMENT_ID, num_envs=96, design=DESIGN)
        check_observation_space(made.single_observation_space)
        check_action_space(made.single_action_space)
    assert isinstance(made, CrawlingEnvironment)
    assert made.num_envs == 96
    assert set(made.designs) == {Design.parse(DESIGN)}
    one = gymnasium.make(ENVIRONMENT_ID)
    assert made.single_observation_space == one.observation_space
    assert made.single_action_space == one.action_space
    assert made.reset(seed=0)[0] in made.observation_space


def test_each_robot_of_a_batch_has_its_own_design() -> None:
    made = gymnasium.make_vec(ENVIRONMENT_ID, num_envs=2, design=[DESIGN, BASELINE_DESIGN])
    assert made.designs == (Design.parse(DESIGN), Design.parse(BASELINE_DESIGN))
    with pytest.raises(ValueError, match="got 2 designs for num_envs = 3"):
        gymnasium.make_vec(ENVIRONMENT_ID, num_envs=3, design=[DESIGN, BASELINE_DESIGN])


def test_a_second_registration_says_nothing() -> None:
    before = gymnasium.spec(ENVIRONMENT_ID)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        register_environments()
    assert gymnasium.spec(ENVIRONMENT_ID) is before


def test_a_robot_of_ones_own_has_its_own_regulators_and_modules() -> None:
    robot = RobotDescription.read(PLATE).spec()
    one = gymnasium.make(ENVIRONMENT_ID, design="b1.0.2.1.0.4", robot=robot).unwrapped
    many = gymnasium.make_vec(ENVIRONMENT_ID, num_envs=1, design="b1.0.2.1.0.4", robot=robot)
    assert one.action_space.shape == (4,)
    # Four actions of four regulators, six sites of nothing or two kinds of legs on four regulators.
    assert one.observation_space.shape == many.single_observation_space.shape == (4 * 4 + 6 * 9,)
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(ValueError, match="the task has 3 regulators and the robot 4"):
            make(ENVIRONMENT_ID, design="1.0.2.1.0.1", robot=robot, task=CrawlingTask())


@pytest.mark.parametrize(
    ("robot", "design"),
    [(paper_robot("published"), DESIGN), (RobotDescription.read(PLATE).spec(), "b1.0.2.1.0.4")],
    ids=["paper", "plate"],
)
def test_environments_go_into_other_processes(robot: RobotSpec, design: str) -> None:
    """Fresh processes get the robot as bytes, as those of Gymnasium's and of other learners'
    subprocess environments do, and walk as it does here, to the last bit."""
    made = partial(make_single_env, design, pickle.loads(pickle.dumps(robot)))
    here, there = SyncVectorEnv([made]), AsyncVectorEnv([made], context="spawn")
    action = np.full((1, robot.physics.regulator_count), 0.5, np.float32)
    try:
        rewards = []
        for each in (here, there):
            each.reset(seed=0)
            rewards.append(each.step(action)[1])
        assert rewards[0] == rewards[1]
        assert rewards[0] != 0.0
    finally:
        there.close()
