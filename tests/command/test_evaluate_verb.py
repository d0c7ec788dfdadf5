"""A run's pairs walk in the physics that was asked for, and in the run's own where none was."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.run_folders import crawl, write_run
from helpers.run_json import run_json

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import run
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.physics.physics import Physics
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.rollout import rollout
from pneumorph.study.training_options import TrainingOptions

REPRODUCE = Path(__file__).parent.parent.parent / "reproduce"
OBJECTIVE = Physics(damping="objective", friction=0.8)
WORLDS = Randomisation("U(0.3, 0.4)", "1.1", "0.9", "0.05", "2")


def write(folder: Path, **options: Any) -> Path:
    """A finished coopt run of one pair, two seconds long."""
    task = CrawlingTask(action_count=2)
    asked = replace(
        TrainingOptions(), robot=RobotOptions.of("published", physics=OBJECTIVE), **options
    )
    asked = replace(asked, coopt=replace(asked.coopt, task=task))
    return write_run(folder, "coopt", asked)


def walked_cm(physics: Physics) -> float:
    """How far that pair walks in a physics, by the library alone [cm]."""
    robot = paper_robot("published", physics=physics).reduced(BASELINE_DESIGN)
    return float(rollout(robot, crawl(2, seed=1), record_nodes=False)[1].forward_distance_cm)


def test_published_physics_can_be_asked_of_an_objective_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`published` is the default of its flag, and wins over the run's own all the same."""
    run = write(tmp_path / "run")
    distances = {}
    for flags, physics in (
        ("", OBJECTIVE),
        ("--physics.damping published", replace(OBJECTIVE, damping="published")),
        ("--physics.damping published --physics.friction 1.2", Physics()),
        ("--simulation.damping published", replace(OBJECTIVE, damping="published")),
        ("--afresh --physics published", Physics()),
    ):
        found = run_json(f"evaluate {run} {flags} --out {tmp_path / 'e'}", capsys)
        # The same robot and steps: rounding of the sums of times alone.
        assert found["best_distance_cm"] == pytest.approx(walked_cm(physics), abs=1e-9), flags
        assert found["damping"] == physics.damping
        distances[physics] = found["best_distance_cm"]
    # Each of these physics tells itself from the others.
    assert np.abs(np.diff(sorted(distances.values()))).min() > 1e-3
    assert len(distances) == 3


def test_a_kept_run_of_objective_damping_walks_both(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its best pair goes 7.4 cm in its own physics and 11.0 cm in the published one.

    Other rounding moves such a walk by up to 0.4 cm (reproduce/engine): a centimetre tells the two
    apart on every processor.
    """
    kept = REPRODUCE / "damping_gap" / "objective"
    pair = json.loads((REPRODUCE / "damping_gap" / "damping_gap.json").read_text())["objective"][
        "pairs"
    ][0]
    for flags, far in (
        ("", pair["own_distance_cm"]),
        ("--physics.damping published", pair["other_distance_cm"]),
        ("--simulation.damping=published", pair["other_distance_cm"]),
    ):
        found = run_json(f"evaluate {kept} --pair-count 1 {flags} --out {tmp_path}", capsys)
        assert found["best_distance_cm"] == pytest.approx(far, abs=1.0), flags
        assert found["reported_distance_cm"] == pytest.approx(pair["own_distance_cm"], abs=1e-6)
    assert pair["other_distance_cm"] - pair["own_distance_cm"] > 3.0


def test_the_best_is_the_furthest_of_what_walked_not_the_first_of_the_training(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Under objective damping L3 and L5 of the kept run come 1.0 cm, L1 goes back by 0.3 cm."""
    kept = REPRODUCE / "paper_scale"
    found = run_json(f"evaluate {kept} --physics.damping objective --out {tmp_path}", capsys)
    best = max(found["pairs"], key=lambda pair: pair["distance_cm"])
    assert best["distance_cm"] > found["pairs"][0]["distance_cm"] + 0.5
    for name in ("design", "distance_cm", "reported_distance_cm"):
        assert found[name if name.startswith("reported") else f"best_{name}"] == best[name]
    assert run(["report", str(tmp_path), "--figure-files"]) == 0
    page = (tmp_path / "report" / "page.html").read_text()
    assert "place in the run" in page
    assert f"{best['distance_cm']:.1f} cm" in page


def test_randomize_draws_from_the_runs_own_worlds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def drawn(run: Path, flags: str = "") -> dict[str, Any]:
        found = run_json(
            f"evaluate {run} --randomize --world-count 3 {flags} --out {tmp_path / 'e'}", capsys
        )
        assert not any("--randomize" in note for note in found["notes"])  # as it was asked for
        robustness: dict[str, Any] = found["robustness"]
        return robustness

    run = write(tmp_path / "drawn", randomize=True, randomisation=WORLDS)
    own = drawn(run)
    assert own["distributions"]["friction"] == "U(0.3, 0.4)"
    for world in own["worlds"]:
        assert 0.3 <= world["friction"] <= 0.4
        assert (world["modulus_factor"], world["mass_factor"]) == (1.1, 0.9)
    assert len({world["friction"] for world in own["worlds"]}) == 3
    # A flag changes what it names, the rest stays the run's.
    other = drawn(run, "--randomisation.friction 0.5")
    assert other["distributions"] == {**own["distributions"], "friction": "0.5"}
    assert {world["friction"] for world in other["worlds"]} == {0.5}
    usual = drawn(run, "--afresh --physics published")["distributions"]
    assert usual["friction"] == Randomisation().friction
    # Worlds that a run was not trained in are nobody's: the usual ones are drawn.
    plain = write(tmp_path / "plain", randomisation=WORLDS)
    assert drawn(plain)["distributions"] == usual


def test_worlds_that_nobody_said_are_those_of_the_physics(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Robots of the measured physics, whose legs slide with 0.4 to 0.7, never walk at the published
    0.9 to 1.5: neither those of a run without worlds, nor those of `--afresh`."""
    plain, other = tmp_path / "measured", write(tmp_path / "published")
    task = CrawlingTask(action_count=2)
    asked = replace(TrainingOptions(), robot=RobotOptions.of("measured"))
    write_run(plain, "coopt", replace(asked, coopt=replace(asked.coopt, task=task)))
    out = tmp_path / "e"

    def settings(run: Path, flags: str = "") -> Any:
        run_json(f"evaluate {run} --randomize --world-count 1 {flags} --out {out}", capsys)
        return json.loads((out / "settings.json").read_text())["evaluation"]["randomisation"]

    usual, published = settings_to_dict(measured_worlds()), settings_to_dict(Randomisation())
    assert settings(plain) == usual
    assert [name for name, _ in usual["friction_by_surface"]] == ["sheet", "skin", "hub"]
    assert settings(other, "--afresh") == usual
    assert settings(other, "--physics measured") == usual
    assert settings(other) == published
    assert settings(plain, "--physics published") == published
    assert settings(plain, "--afresh --leg published") == published
    one = settings(plain, "--randomisation.floor-slope-deg 1")
    assert one == {**usual, "floor_slope_deg": "1"}


def test_distances_of_drawn_worlds_need_not_repeat(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both runs report 10 cm of a pair that goes elsewhere: of the one that walked in its physics
    alone something must differ, the other's distance was of other worlds."""
    notes = {}
    for name, drawn in (("plain", False), ("drawn", True)):
        folder = write(tmp_path / name, randomize=drawn, randomisation=WORLDS)
        notes[name] = run_json(f"evaluate {folder} --out {tmp_path / 'e'}", capsys)["notes"]
    assert any("physics, leg or machine differ" in note for note in notes["plain"])
    assert not any("differ" in note for note in notes["drawn"])
    assert any("in worlds drawn at random" in note for note in notes["drawn"])


def test_an_evaluation_whose_robots_all_fail_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A program that calls it need not look for the best distance."""
    folder, out = write(tmp_path / "run"), tmp_path / "out"
    flags = f"--stepper.speed-limit-mm-per-s 1 --json --out {out}"
    assert run(f"evaluate {folder} {flags}".split()) == 1
    found = json.loads(capsys.readouterr().out)
    assert (found["status"], found["best_distance_cm"]) == ("no robot survived", None)
    assert run_json(f"evaluate {folder} --out {out}", capsys)["status"] == "completed"


def test_a_page_shows_no_walks_of_an_earlier_evaluation(tmp_path: Path) -> None:
    folder, out = write(tmp_path / "run"), tmp_path / "out"
    page, walk = out / "replay.html", out / "trajectory_reduced_L1.npz"
    assert run(f"evaluate {folder} --record --out {out}".split()) == 0
    assert page.exists()
    assert walk.exists()
    assert run(f"evaluate {folder} --physics.friction 0.5 --out {out}".split()) == 0
    assert not page.exists()
    assert not walk.exists()
