"""What the best robot of a run achieved until each of its rounds."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

from helpers.result_example import example
from helpers.run_folders import write_run

from pneumorph.base.layers import layered
from pneumorph.base.result import result_to_dict
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.study.learning_curve import learning_curve
from pneumorph.study.training_options import TrainingOptions
from pneumorph.study.training_result import TrainingResult

TURN = Goal("turn_left", cm_per_unit=0.1)


def trained(folder: Path, rounds: list[dict[str, float | None]], found: TrainingResult) -> Path:
    """A finished training with a line of metrics for each round."""
    reward = {} if found.goal.is_forward else {"reward": {"goal": "turn_left"}}
    task = {"action_step_count": 50, **reward}
    options = layered(TrainingOptions(), [{"coopt": {"task": task}}])
    run = write_run(folder, "coopt", options, **result_to_dict(replace(found, pairs=())))
    lines = [json.dumps({"timestep": 10 * number, **line}) for number, line in enumerate(rounds, 1)]
    (run / "training" / "metrics.jsonl").write_text("".join(f"{line}\n" for line in lines))
    return run


def of(goal: Goal, distance_cm: float | None, achieved: float | None) -> TrainingResult:
    """What a training of 20 timesteps found, with 10 more of fine-tuning."""
    counts = {"timesteps": 20, "finetuning_timesteps": 10}
    best = {"best_distance_cm": distance_cm, "best_achieved": achieved}
    return replace(example(TrainingResult), goal=goal, **counts, **best)


def test_a_run_without_a_robot_that_survived_has_no_points(tmp_path: Path) -> None:
    none = {"best_distance_cm": None, "best_achieved": None}
    assert learning_curve(trained(tmp_path / "a", [none], of(FORWARD, None, None))) == ([], [])
    later = learning_curve(trained(tmp_path / "b", [none], of(FORWARD, 3.0, 3.0)))
    assert later == ([15.0], [3.0])


def test_what_counts_is_what_the_goal_asks_for(tmp_path: Path) -> None:
    """A robot that turns further has come less far; an earlier version told the distance alone."""
    turns = [
        {"best_distance_cm": 5.0, "best_achieved": 40.0},
        {"best_distance_cm": 2.0, "best_achieved": 60.0},
    ]
    found = learning_curve(trained(tmp_path / "turn", turns, of(TURN, 1.0, 70.0)))
    assert found == ([5.0, 10.0, 15.0], [40.0, 60.0, 70.0])
    earlier = [{"best_distance_cm": 5.0}]
    found = learning_curve(trained(tmp_path / "crawl", earlier, of(FORWARD, 4.0, None)))
    assert found == ([5.0, 15.0], [5.0, 5.0])
