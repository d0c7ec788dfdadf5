"""Legs of one's own that were reduced for lower pressures than the usual are inflated to those."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pneumorph.catalogue.paper_leg import paper_leg
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.unseen_pressure import unseen_pressure_note

Asked = Callable[[str], Any]
PLATE = Path(__file__).parents[2] / "examples" / "plate.toml"


@pytest.fixture(scope="module")
def low(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The measured leg as if its snapshots ended at 40 kPa."""
    part = paper_leg("measured").reduced
    report = part.metadata["report"]
    bend = {name: column[:8] for name, column in report["bend"].items()}
    assert max(bend["pressure_kPa"]) == 40.0
    part = replace(part, metadata={**part.metadata, "report": {**report, "bend": bend}})
    return part.save(tmp_path_factory.mktemp("low") / "low.npz")


def test_gaits_and_tasks_end_where_snapshots_do(asked: Asked, low: Path) -> None:
    assert asked(f"simulate --part {low}").walk.expert.amplitude_kPa == 20.0
    assert asked(f"baseline --part {low}").sweep.gait.amplitude_kPa == 20.0
    assert asked(f"search --part {low}").search.task.maximum_pressure_kPa == 40.0
    assert asked(f"deploy --part {low}").deployment.expert.amplitude_kPa == 20.0
    learned = asked(f"coopt --part {low}")
    assert learned.coopt.task.maximum_pressure_kPa == 40.0
    assert learned.baseline.gait.amplitude_kPa == 20.0
    assert learned.coopt.task.reward == asked("coopt").coopt.task.reward


def test_what_is_asked_for_stays(asked: Asked, low: Path) -> None:
    walk = asked(f"simulate --part {low} --expert.amplitude-kPa 30").walk
    assert walk.expert.amplitude_kPa == 30.0
    learned = asked(f"coopt --part {low} --task.maximum-pressure-kPa 60")
    assert learned.coopt.task.maximum_pressure_kPa == 60.0
    assert asked("simulate").walk.expert.amplitude_kPa == 45.0


def test_a_part_in_a_robots_file_is_such_a_leg(asked: Asked, low: Path) -> None:
    text = PLATE.read_text().replace('leg = "measured"\n\n', 'part = "low.npz"\n\n')
    path = low.parent / "plate.toml"
    path.write_text(text)
    learned = asked(f"coopt --robot {path}")
    assert learned.coopt.task.maximum_pressure_kPa == 40.0
    assert learned.coopt.task.regulator_count == 4
    assert learned.baseline.gait.amplitude_kPa == 20.0
    expert = asked(f"simulate --robot {path}").walk.expert
    assert (expert.amplitude_kPa, expert.regulator_count) == (20.0, 4)
    assert asked(f"simulate --robot {PLATE}").walk.expert.amplitude_kPa == 45.0


def test_it_is_told(low: Path) -> None:
    spec = RobotOptions.of("measured", part=low).spec()
    note = unseen_pressure_note(spec, 40.0)
    assert note is not None
    assert note.startswith("legs are inflated to 40 kPa at most, as ")
    assert "it extrapolates beyond" in (unseen_pressure_note(spec, 45.0) or "")
    assert unseen_pressure_note(RobotOptions.of("measured").spec(), 90.0) is None
