"""An evaluation has failed where no robot survived, in the world as it stands or in drawn ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import pytest
from helpers.run_folders import write_run

from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.stepper_settings import StepperSettings
from pneumorph.study import evaluation
from pneumorph.study.evaluation import EvaluationSettings, evaluate
from pneumorph.study.survived import NONE_SURVIVED
from pneumorph.study.training_options import TrainingOptions


@pytest.mark.parametrize("randomize", [False, True])
def test_the_status_tells_whether_a_robot_survived(
    tmp_path: Path, randomize: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = replace(TrainingOptions(), robot=RobotOptions.of("published"))
    task = replace(options.coopt.task, action_count=2)
    asked = replace(options, coopt=replace(options.coopt, task=task))
    run = write_run(tmp_path / "run", "coopt", asked)
    settings = EvaluationSettings(randomize=randomize, world_count=2)
    robot = asked.robot.spec()
    diverging = replace(robot, stepper=StepperSettings(speed_limit_mm_per_s=1.0))
    failed = evaluate(run, settings, diverging)
    assert (failed.status, failed.best_achieved) == (NONE_SURVIVED, None)
    assert evaluate(run, settings, robot).status == "completed"
    if randomize:
        assert failed.robustness is not None
        assert failed.robustness.failed_count == 2
        # One that survives in a drawn world alone has survived.
        none = [evaluation._Walked(None, None, None)]
        monkeypatch.setattr(evaluation, "_together", lambda *_: none)
        elsewhere = evaluate(run, settings, robot)
        assert (elsewhere.status, elsewhere.best_achieved) == ("completed", None)


@pytest.mark.parametrize(("physics", "says"), [("published", True), ("measured", False)])
def test_worlds_of_another_physics_than_the_runs_are_told(
    tmp_path: Path, physics: Literal["published", "measured"], says: bool
) -> None:
    """From Python nothing but the default says what they are drawn from."""
    options = replace(TrainingOptions(), robot=RobotOptions.of(physics))
    task = replace(options.coopt.task, action_count=1, action_step_count=20)
    asked = replace(options, coopt=replace(options.coopt, task=task))
    run = write_run(tmp_path / "run", "coopt", asked)
    for drawn, told in ((EvaluationSettings().randomisation, says), (Randomisation(), False)):
        settings = EvaluationSettings(randomize=True, world_count=2, randomisation=drawn)
        notes = evaluate(run, settings).notes
        assert any("those of the measured physics" in note for note in notes) == told
