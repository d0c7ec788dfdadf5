"""Observations tell as many regulators of a leg as the first designs of an environment have."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.registration import make_env, make_single_env

CHAMBERS = Path(__file__).parents[2] / "examples" / "two_chambers.toml"
ONE, TWO = "1.0.2.0.1.0.2.0", "1+2.0.2.0.1.0.2.0"


@pytest.fixture(scope="module")
def robot() -> RobotSpec:
    return replace(RobotDescription.read(CHAMBERS).spec(), thread_count=1)


def test_a_design_with_more_is_told_how_it_can_follow(robot: RobotSpec) -> None:
    """Its legs have two cavities: that is not what is wrong with it."""
    told = (
        r"design 1\+2\.0\.2\.0\.1\.0\.2\.0 has a leg on 2 regulators at location 0, expected at "
        r"most 1: .* of its first designs has: make it with one that has a leg on 2$"
    )
    many, one = make_env(num_envs=1, design=ONE, robot=robot), make_single_env(ONE, robot)
    with pytest.raises(ValueError, match=told) as error:
        many.reset(options={"designs": [TWO]})
    assert "cavities" not in str(error.value)
    with pytest.raises(ValueError, match=told):
        one.reset(options={"design": TWO})


def test_what_the_message_says_helps(robot: RobotSpec) -> None:
    env = make_env(num_envs=1, design=TWO, robot=robot)
    for design in (ONE, TWO):
        observation, _ = env.reset(seed=0, options={"designs": [design]})
        assert observation in env.observation_space
