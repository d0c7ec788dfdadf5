"""What a training's page says in numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.environment.goal import FORWARD
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.snapshot import TrainingSnapshot
from pneumorph.report.physics_words import MEAN_OVER_WORLDS, walked_in
from pneumorph.report.training_view import _headline, training_view_data
from pneumorph.robot.design_space import DesignSpace


@pytest.mark.parametrize(
    ("of_round", "found", "said"),
    [(4.0, [7.0], "4.0 cm"), (None, [7.0], "7.0 cm"), (None, [], "none yet")],
)
def test_the_best_is_that_of_the_round_or_what_was_found(
    of_round: float | None, found: list[float], said: str
) -> None:
    """Robots in drawn worlds have none in their rounds."""
    last = {"best_distance_cm": of_round, "best_achieved": of_round, "return_mean_cm": 1.0,
            "design_entropy": 2.0, "design_entropy_target": 2.0}  # fmt: skip
    pairs = [DesignGaitPair(0, np.zeros((1, 3)), each, each, "policy", 9, each) for each in found]
    headline = _headline(TrainingSnapshot([last], pairs, 9, 9, 0.0), FORWARD)
    assert headline[f"best {FORWARD.label}"] == said


def test_a_task_of_ones_own_is_named_and_told_by_its_rewards() -> None:
    last = {"best_distance_cm": 4.0, "return_mean_cm": 1.0, "return_maximum_cm": 2.5,
            "timestep": 9, "design_entropy": 2.0, "design_entropy_target": 2.0,
            "score_histogram": [0.25, 0.75]}  # fmt: skip
    early = TrainingSnapshot([last], [], None, 9, 0.0)
    pairs = [DesignGaitPair(0, np.zeros((1, 3)), 7.0, 1.75, "policy", 9, 7.0)]
    said = training_view_data(
        replace(early, pairs=pairs), DesignSpace(), None, 1.5, own_task="Diagonal"
    )
    assert "Robots learn the task Diagonal" in said["status"]
    assert "Reward of Diagonal of each round" in said["figures"]
    assert "expert" not in said["figures"]
    assert "score 1.75 cm" in said["designs"]
    assert "distance" not in " ".join((said["numbers"], said["figures"], said["designs"]))
    headline = _headline(early, FORWARD, own_task="Diagonal")
    assert headline["best episode, reward of Diagonal"] == "2.50 cm"
    assert headline["mean reward of the last round"] == "1.00 cm"
    found = _headline(replace(early, pairs=pairs), FORWARD, own_task="Diagonal")
    assert found["best score, reward of Diagonal"] == "1.75 cm"


def test_rewards_that_something_is_taken_off_are_called_so() -> None:
    last = {"best_distance_cm": 4.0, "return_mean_cm": 1.0, "timestep": 9,
            "design_entropy": 2.0, "design_entropy_target": 2.0,
            "score_histogram": [0.25, 0.75]}  # fmt: skip
    snapshot = TrainingSnapshot([last], [], None, 9, 0.0)
    said = training_view_data(snapshot, DesignSpace(), None, penalised=True)
    assert "Reward of each round" in said["figures"]
    assert "mean reward of the last round" in said["numbers"]


def test_a_page_tells_where_robots_walk_and_what_a_mean_is() -> None:
    """The best of rounds is of one walk, what was found at the end of the training's worlds."""
    last = {"best_distance_cm": None, "return_mean_cm": 1.0, "timestep": 9,
            "design_entropy": 2.0, "design_entropy_target": 2.0,
            "score_histogram": [0.25, 0.75]}  # fmt: skip
    pairs = [DesignGaitPair(0, np.zeros((1, 3)), 7.0, 7.0, "policy", 9, 7.0)]
    snapshot = TrainingSnapshot([last], pairs, 9, 9, 0.0)
    where = walked_in("published physics", drawn=True)
    told = training_view_data(snapshot, DesignSpace(), None, where=where, of_pairs=MEAN_OVER_WORLDS)
    assert told["status"].endswith("Robots walk in worlds drawn around published physics.")
    assert "best distance, mean over the training&#x27;s worlds" in told["numbers"]
    assert "7.0 cm, mean over the training&#x27;s worlds" in told["designs"]
    of_rounds = replace(snapshot, metrics=[{**last, "best_distance_cm": 4.0}])
    assert _headline(of_rounds, FORWARD, MEAN_OVER_WORLDS)["best distance"] == "4.0 cm"
    plain = training_view_data(snapshot, DesignSpace(), None)
    assert "mean over" not in plain["numbers"] + plain["designs"]
    assert plain["status"].endswith("timesteps.")
