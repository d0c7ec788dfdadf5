"""Legs of one's own that were reduced for lower pressures than the usual are inflated to those."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.unseen_pressure import lowered_pressure_note, unseen_pressure_note
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.registration import make_env

Asked = Callable[[str], Any]
PLATE = Path(__file__).parents[2] / "examples" / "plate.toml"


@pytest.fixture(scope="module")
def low(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The measured leg as if its snapshots ended at 40 kPa."""
    part = module_of_leg("measured").reduced
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
    bench = asked(f"bench --part {low}")
    assert (bench.benchmark.maximum_kPa, bench.expert.amplitude_kPa) == (40.0, 20.0)
    learned = asked(f"coopt --part {low}")
    assert learned.coopt.task.maximum_pressure_kPa == 40.0
    assert learned.baseline.gait.amplitude_kPa == 20.0
    assert learned.coopt.task.reward == asked("coopt").coopt.task.reward


def test_environments_of_ones_own_end_there_too(low: Path) -> None:
    spec = RobotOptions(part=low).spec()
    design = "1.2.0.0.3.0.0.0"
    assert make_env(2, design, spec).task == CrawlingTask(maximum_pressure_kPa=40.0)
    asked = CrawlingTask(maximum_pressure_kPa=60.0)
    assert make_env(2, design, spec, asked).task == asked
    assert make_env(2, design).task == CrawlingTask()


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


def test_a_gait_of_ones_own_may_come_from_another_layer(
    asked: Asked, low: Path, tmp_path: Path
) -> None:
    """Then nothing is said of the expert's gait, which would be ignored."""
    gait, settings = tmp_path / "gait.csv", tmp_path / "own.toml"
    columns = "time_s,regulator_1_kPa,regulator_2_kPa,regulator_3_kPa"
    gait.write_text(f"# design: 1.0.0.2.2.0.0.1\n{columns}\n0.0,10.0,0.0,0.0\n")
    usual = asked("simulate").walk.expert
    settings.write_text(f'[robot]\npart = "{low}"\n')
    command = f"simulate --settings {settings}"
    assert asked(command).walk.expert.amplitude_kPa == 20.0
    assert asked(f"{command} --gait {gait}").walk.expert == usual
    assert asked(f"simulate --part {low} --gait {gait}").walk.expert == usual
    assert asked(f"deploy {gait} --part {low}").deployment.expert == usual
    settings.write_text(f'[walk]\ngait = "{gait}"\n')
    assert asked(f"simulate --settings {settings} --part {low}").walk.expert == usual
    settings.write_text(f'[robot]\ndescribed = "{PLATE}"\n')
    assert asked(f"simulate --settings {settings} --gait {gait}").walk.expert == usual


def test_a_usual_leg_in_the_place_of_a_low_one_has_usual_pressures(
    asked: Asked, low: Path, tmp_path: Path
) -> None:
    usual, settings = tmp_path / "usual.npz", tmp_path / "own.toml"
    module_of_leg("measured").reduced.save(usual)
    settings.write_text(f'[robot]\npart = "{low}"\n')
    command = f"coopt --settings {settings}"
    assert asked(command).coopt.task.maximum_pressure_kPa == 40.0
    assert asked(f"{command} --part {usual}").coopt == asked("coopt").coopt
    assert asked(f"{command} --part {usual}").baseline == asked("coopt").baseline


def test_a_bend_test_climbs_as_far_as_the_snapshots(asked: Asked, low: Path) -> None:
    """In as many steps as usual."""
    bends = asked(f"deploy --bend-test --part {low}").deployment.bends
    assert bends.highest_kPa == 40.0
    usual = asked("deploy --bend-test").deployment.bends
    assert len(bends.pressures_kPa) == len(usual.pressures_kPa)
    further = asked(f"deploy --bend-test --part {low} --bends.highest-kPa 60").deployment.bends
    assert further.highest_kPa == 60.0
    assert asked(f"deploy --part {low}").deployment.bends == usual  # refused beside a gait


def test_it_is_told(low: Path) -> None:
    spec = RobotOptions.of("measured", part=low).spec()
    note = unseen_pressure_note(spec, 40.0)
    assert note is not None
    assert note.startswith("legs are inflated to 40 kPa and not to 90: ")
    assert "it extrapolates beyond" in (unseen_pressure_note(spec, 45.0) or "")
    assert lowered_pressure_note(spec, 45.0) is None
    assert unseen_pressure_note(spec, 10.0) is None  # for other reasons
    assert unseen_pressure_note(RobotOptions.of("measured").spec(), 90.0) is None
