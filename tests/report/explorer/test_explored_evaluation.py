"""An evaluation is explored among the designs of its training, and its robot walks them."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

from helpers.run_folders import write_run

from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.report.explorer.explored_run import explore, said_space
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_options import TrainingOptions

PLATE = Path(__file__).parents[3] / "examples" / "plate.toml"


def _evaluated(
    folder: Path, verb: str, training: object, design: str, robot: dict[str, Any]
) -> Path:
    """An evaluation of a run that found one design, by a robot."""
    write_run(folder / "run", verb, training, [design])
    settings = {"robot": settings_to_dict(layered(RobotOptions(), [robot]))}
    told = {"run": str(folder / "run"), "model": "reduced"}
    return write_run(folder / "evaluation", "evaluate", settings, [design], **told)


def _command(evaluation: Path) -> tuple[str, int]:
    """The command on an evaluation's page, and how many designs the page has."""
    run = FinishedRun.read(evaluation)
    found = explore(RunFolder(evaluation / "explorer", "explore"), run)
    (command,) = re.findall(
        r"pneumorph simulate (.*?)--design DESIGN", Path(found.page).read_text()
    )
    assert found.scored_count == 1
    return command, found.design_count


def test_an_evaluation_of_a_robot_of_a_file(tmp_path: Path) -> None:
    robot = {"described": str(PLATE)}
    plate = RobotDescription.read(PLATE)
    training = layered(TrainingOptions(), [{"robot": robot}])
    evaluation = _evaluated(tmp_path, "coopt", training, plate.usual_design, robot)
    policy = tmp_path / "run" / "training" / "policy.npz"
    assert _command(evaluation) == (f"--gait {policy} ", len(plate.space))
    shutil.rmtree(tmp_path / "run")  # then the file says both
    assert _command(evaluation) == (f"--robot {PLATE} ", len(plate.space))


def test_another_robot_than_the_trainings_is_named_beside_its_gait(tmp_path: Path) -> None:
    """An evaluation may be in other physics."""
    training = layered(TrainingOptions(), [{"coopt": {"space": {"maximum_legs": 3}}}])
    robot = {"based_on": "published"}
    evaluation = _evaluated(tmp_path, "coopt", training, "1.0.0.1.0.0.0.2", robot)
    policy = tmp_path / "run" / "training" / "policy.npz"
    command, count = _command(evaluation)
    assert command == f"--gait {policy} --physics published "
    assert count == len(FinishedRun.read(tmp_path / "run").space)


def test_of_a_training_that_is_gone_the_papers_robot_is_named(tmp_path: Path) -> None:
    robot = {"based_on": "published"}
    evaluation = _evaluated(tmp_path, "coopt", TrainingOptions(), BASELINE_DESIGN, robot)
    shutil.rmtree(tmp_path / "run")
    run = FinishedRun.read(evaluation)
    assert said_space(run) is None
    assert _command(evaluation) == ("--physics published ", len(DesignSpace()))


def test_a_robot_that_its_names_do_not_tell_is_walked_by_its_settings(tmp_path: Path) -> None:
    folder, robot = tmp_path / "my run", {"physics": {"friction": 0.7}}
    evaluation = _evaluated(folder, "coopt", TrainingOptions(), BASELINE_DESIGN, robot)
    command, _ = _command(evaluation)
    ((policy, settings),) = re.findall(r"^--gait '(.*)' --settings '(.*)' $", command)
    assert Path(policy) == folder / "run" / "training" / "policy.npz"
    kept = json.loads(Path(settings).read_text())["robot"]
    assert kept == settings_to_dict(layered(RobotOptions(), [robot]))
