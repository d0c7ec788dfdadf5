"""What docs/own_robot.md shows in Python runs, and makes what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import pneumorph as pm
from pneumorph.environment.equal_grounds import check_equal_grounds
from pneumorph.simulation.rollout import rollout

ROOT = Path(__file__).parents[2]
BLOCKS = re.findall(r"```python\n(.*?)```", (ROOT / "docs/own_robot.md").read_text(), re.DOTALL)


def _run(having: str) -> None:
    (block,) = (each for each in BLOCKS if having in each)
    exec(compile(block, "own_robot.md", "exec"), {})


@pytest.fixture
def small_plate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    _run('write("small_plate.toml")')
    return tmp_path / "small_plate.toml"


def test_a_robot_is_built_field_by_field(small_plate: Path) -> None:
    robot = pm.RobotDescription.read(small_plate)
    assert (len(robot.sites), list(robot.modules)) == (4, ["long", "short"])
    commands = np.tile([50.0, 20.0], (10, 1))
    _, walk = rollout(robot.spec(thread_count=1).reduced(robot.usual_design), commands)
    assert walk.status == "completed"


def test_training_says_how_a_description_becomes_a_file(small_plate: Path) -> None:
    robot = pm.RobotDescription.read(small_plate)
    with pytest.raises(
        TypeError, match=r"robot is a RobotDescription, expected the path .*robot\.write\("
    ):
        pm.train("run", robot)  # type: ignore[arg-type]


def test_a_slope_across_rises_to_the_left(small_plate: Path) -> None:
    _run('np.save("across.npy"')
    table = '[physics.ground.map]\npath = "across.npy"\nmm_per_pixel = 10\n'
    text = small_plate.read_text()
    small_plate.write_text(f"{text}mirror = false\n{table}")
    robot = pm.RobotDescription.read(small_plate)
    ground = robot.acting.ground.grid()
    rise = np.tan(np.radians(5.0))
    np.testing.assert_allclose(ground.height(30.0, [-200.0, 0.0, 200.0]),
                               [-200.0 * rise, 0.0, 200.0 * rise], atol=1e-6)  # fmt: skip
    check_equal_grounds(robot.space, robot.acting)
    small_plate.write_text(f"{text}{table}")
    with pytest.raises(ValueError, match=r"across\.npy differs by .*mirror = false"):
        check_equal_grounds(pm.RobotDescription.read(small_plate).space, robot.acting)
