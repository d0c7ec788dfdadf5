"""A policy's gait is what it commands in the environment, where it sees its own actions alone."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import jax
import numpy as np
import pytest

from pneumorph.base.artefact import write_json
from pneumorph.base.layers import layered
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.leg_kinds import LegName, pressure_map
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.viscous_crawler import ViscousCrawler
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.learn.evaluation import evaluate_policy
from pneumorph.learn.networks import Policy
from pneumorph.learn.policy_file import save_policy
from pneumorph.learn.sac import Sac, SacSettings
from pneumorph.learn.settings import CooptSettings
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.pressure import PressureMap
from pneumorph.robot.design import Design
from pneumorph.study.gait_source import GaitSource, find_gait, recalibrated

SETTINGS = CooptSettings(
    task=CrawlingTask(action_count=6, action_step_count=10), sac=SacSettings(hidden_sizes=(16, 16))
)


def test_policy_and_environment_agree(tmp_path: Path) -> None:
    task, space = SETTINGS.task, SETTINGS.space
    size = task.state_size + space.one_hot.shape[1]
    policy = Policy(size, task.regulator_count, SETTINGS.sac.hidden_sizes, jax.random.PRNGKey(3))
    path = save_policy(tmp_path / "policy.npz", policy, SETTINGS)
    design = space[1234]
    environment = CrawlingEnvironment(
        [design], lambda each: each, partial(ViscousCrawler, time_step_s=0.01), task
    )
    learner = Sac(size, task.regulator_count, SETTINGS.sac)
    (pair,) = evaluate_policy(environment, space, policy, learner, np.array([1234]))
    found = find_gait(path, str(design), ExpertGait())
    assert found.design == design
    assert found.gait.duration_s == pytest.approx(0.6)
    held = np.array([found.gait.pressure_kPa(0.1 * action) for action in range(6)])
    # Single precision in another batch: some rounding of 90 kPa.
    np.testing.assert_allclose(held, pair.held_kPa, atol=1e-3)
    assert np.ptp(held) > 1.0


def test_a_policy_of_an_environment_of_ones_own_is_refused(tmp_path: Path) -> None:
    """What it saw besides its actions and its design is not known without that environment."""
    task, space = SETTINGS.task, SETTINGS.space
    usual = task.state_size + space.feature_count
    own = Policy(usual + 2, task.regulator_count, SETTINGS.sac.hidden_sizes, jax.random.PRNGKey(3))
    path = save_policy(tmp_path / "policy.npz", own, SETTINGS)
    refused = rf"policy of {usual + 2} observed numbers, expected the {usual} of remembered"
    with pytest.raises(ValueError, match=refused):
        find_gait(path, str(space[7]), ExpertGait())


def test_a_policy_drives_a_design_whatever_its_regulators_are_called(tmp_path: Path) -> None:
    space = SETTINGS.space
    size = SETTINGS.task.state_size + space.one_hot.shape[1]
    policy = Policy(size, 3, SETTINGS.sac.hidden_sizes, jax.random.PRNGKey(3))
    path = save_policy(tmp_path / "policy.npz", policy, SETTINGS, time_step_s=0.02)
    known = find_gait(path, "0.1.1.2.3.0.0.0", ExpertGait()).gait
    renamed = find_gait(path, "0.3.3.1.2.0.0.0", ExpertGait())
    assert str(renamed.design) == "0.3.3.1.2.0.0.0"
    assert renamed.gait.duration_s == pytest.approx(6 * 10 * 0.02)
    for time_s in (0.1, 0.5, 1.1):
        first, second, third = known.pressure_kPa(time_s)
        assert renamed.gait.pressure_kPa(time_s) == pytest.approx([second, third, first])
    with pytest.raises(ValueError, match="too many legs: 7"):
        find_gait(path, "1.1.1.1.1.1.1.0", ExpertGait())


@pytest.mark.parametrize("modulus_factor", [None, 1.25])
@pytest.mark.parametrize("leg", ["published", "hyperelastic"])
def test_a_runs_gait_knows_the_pressure_map_of_its_leg_and_how_long_it_settled(
    leg: LegName, modulus_factor: float | None, tmp_path: Path
) -> None:
    """The map over the modulus that was measured."""
    robot, usual = layered(RobotOptions(), [{"leg": leg}]), pressure_map(leg)
    expected = usual
    if modulus_factor is not None:
        stiff = Calibration(usual, modulus_factor=modulus_factor)
        robot = replace(robot, calibration=stiff.save(tmp_path / "calibration.json"))
        expected = PressureMap(usual.slope / modulus_factor, usual.intercept_kPa / modulus_factor)
    task = replace(SETTINGS.task, settling_step_count=7)
    coopt = replace(SETTINGS, task=task)
    settings = {"robot": settings_to_dict(robot), "coopt": settings_to_dict(coopt)}
    write_json(tmp_path / "settings.json", settings)
    pair = {"design": BASELINE_DESIGN, "gait": "L1.csv"}
    write_json(tmp_path / "summary.json", {"pairs": [pair]})
    write_gait(tmp_path / "L1.csv", HeldGait.evenly(np.full((6, 3), 50.0), 0.1), {})
    found = find_gait(tmp_path, None, ExpertGait())
    assert found.bending_map == expected
    assert found.settling_steps == 7


def test_nothing_asked_is_the_experts_gait() -> None:
    found = find_gait(None, None, ExpertGait(phase_deg=20.0))
    assert str(found.design) == BASELINE_DESIGN
    assert found.gait.pressure_kPa(2.0)[0] > 80.0


def test_recalibrated_gaits_are_cut_off_at_the_limit() -> None:
    soft = PressureMap(4.0785 / 1.2, -20.361)
    gait = recalibrated(ExpertGait(), PressureMap(), soft, 95.0)
    assert gait.pressure_kPa(2.0)[0] == 95.0
    assert recalibrated(ExpertGait(), soft, soft, 95.0) == ExpertGait()


def test_a_gait_of_another_design_is_told(tmp_path: Path) -> None:
    gait = HeldGait.evenly(np.full((2, 3), 20.0))
    path = write_gait(tmp_path / "own.csv", gait, {"design": "0.1.0.2.0.1.0.3"})
    assert find_gait(path, None, ExpertGait()).other_design_note is None
    assert find_gait(path, "0.1.0.2.0.1.0.3", ExpertGait()).other_design_note is None
    note = find_gait(path, BASELINE_DESIGN, ExpertGait()).other_design_note
    assert note == f"{path} is a gait of 0.1.0.2.0.1.0.3; {BASELINE_DESIGN} walks it, as asked"
    nobodys = write_gait(tmp_path / "none.csv", gait)
    assert find_gait(nobodys, BASELINE_DESIGN, ExpertGait()).other_design_note is None


def test_a_gait_for_more_regulators_than_the_robot_has_is_named(tmp_path: Path) -> None:
    path = write_gait(tmp_path / "five.csv", HeldGait.evenly(np.full((2, 5), 20.0)))
    with pytest.raises(ValueError, match=rf"{path} commands 5 regulators, expected at most 3"):
        find_gait(path, None, ExpertGait()).check_robot(3)


def test_a_gait_of_another_reward_says_so() -> None:
    source = GaitSource(ExpertGait(), Design.parse(BASELINE_DESIGN), "runs/a/gaits/L1.csv")
    assert source.own_task_note is None
    said = replace(source, own_task="Diagonal").own_task_note
    assert said is not None
    assert said.startswith("runs/a/gaits/L1.csv was learned for the task Diagonal")
