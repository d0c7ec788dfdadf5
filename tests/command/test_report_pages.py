"""A page for a run of every verb: made from its files, whole, and saying how to repeat it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.few_snapshots import FEW_SNAPSHOTS
from helpers.published_pairs import PAPER_PAIRS

from pneumorph.cli import run

GAIT = "--expert.duration-s 4"
SWEEP = "phase-step-deg 90", "gait.duration-s 4"
TRAINING = (
    "--total-timesteps 48 --environment-count 4 --task.action-count 5 --learning-start-timestep 12 "
    "--updates 1 --sac.batch-size 8 --sac.hidden-sizes 8 8 --schedule.decay-start-timestep 12 "
    "--schedule.decay-end-timestep 36 --evaluated-design-count 4 --kept-pair-count 2 "
    "--objective.evaluation-worlds 4 --certified-world-count 4 "
    + " ".join(f"--baseline.{flag}" for flag in SWEEP)
)

COMMANDS = {
    "mesh": "mesh disk",
    "simulate": f"simulate {GAIT}",
    "baseline": "baseline " + " ".join(f"--{flag}" for flag in SWEEP),
    "coopt": f"coopt --restarts 2 {TRAINING}",
    "evaluate": "evaluate {runs}/coopt --record --randomize --world-count 3",
    "search": "search --method random --timesteps 40 --task.action-count 5 --environment-count 4 "
    "--random.population 4 --finalist-count 2 --objective.evaluation-worlds 4",
    "bench": "bench engine --robot-count 4 --action-count 1",
    "compare": "compare --animations --heldout-count 0 --floating-duration-s 0 --timed-steps 0",
    "calibrate": "calibrate --pairs {runs}/pairs.csv",
    "deploy": f"deploy --model reduced {GAIT} --trials 2",
    "transfer": "transfer B={runs}/deploy",
    "exchange": "exchange {runs}/coopt/training/gaits/L1.csv --to csv",
    "reduce": f"reduce --mesh {{mesh}} {FEW_SNAPSHOTS}",
    "fabricate": "fabricate 1.0.0.2.2.0.0.1 --physics published --surface-size-mm 20",
}
"""In the order in which one needs the other."""

SECTIONS = {
    "mesh": ["Regions"],
    "simulate": ["Replay", "Distance and path", "Gait", "Step by step", "How well the reduced leg"],
    "baseline": ["Replay", "The expert&#x27;s gait at every phase", "How well the reduced leg"],
    "coopt": ["Replay", "Training", "The best pairs", "How well the reduced leg"],
    "evaluate": ["Replay", "The best pairs", "Walked again", "In other worlds"],
    "search": ["The search", "The best pairs"],
    "bench": ["Where the time went", "How well the reduced leg"],
    "compare": ["Bend of one leg", "How well the reduced leg"],
    "calibrate": ["Fitted parameters"],
    "deploy": ["Trials", "How well the reduced leg"],
    "transfer": ["Simulated and measured", "Replay of B", "Step by step"],
    "exchange": ["What was written"],
    "reduce": ["Where the time went", "How well the reduced leg"],
    "fabricate": ["Drawing", "Masses", "Solids to print or mill", "Parts", "Tubes"],
}
WITH_FIGURE_FILES = {"coopt", "compare", "transfer", "reduce"}
"""Whose figures are saved beside the page; those of the others are of the same kinds."""
OpenPage = Callable[[Path | str], Any]


@pytest.fixture(scope="module")
def runs(mesh_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small run of every verb."""
    pytest.importorskip("netgen")
    folder = tmp_path_factory.mktemp("runs")
    (folder / "pairs.csv").write_text(PAPER_PAIRS)
    for name, command in COMMANDS.items():
        arguments = command.format(runs=folder, mesh=mesh_file).split()
        assert run([*arguments, "--out", str(folder / name)]) == 0, name
    return folder


@pytest.mark.parametrize("verb", COMMANDS)
def test_page_of_a_run(verb: str, runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    files = [] if verb in WITH_FIGURE_FILES else ["--figure-files"]
    assert run(["report", str(runs / verb), "--json", *files]) == 0
    summary = json.loads(capsys.readouterr().out)
    page = Path(summary["page"])
    content = page.read_text()
    assert page == runs / verb / "report" / "page.html"
    assert summary["page_bytes"] < 15_000_000
    for heading in [*SECTIONS[verb], "Results", "How to repeat it"]:
        assert f"<h2>{heading}" in content, heading
    made = json.loads((runs / verb / "summary.json").read_text())["made_by"]
    assert made["command"].startswith(f"pneumorph {verb} ")
    assert made["command"] in content.replace("&#x27;", "'")
    assert made["version"] in content
    # Nothing from outside: every source is in the page.
    sources = re.findall(r'<(?:img|script|link|iframe)[^>]*(?:src|href)="([^"]*)"', content)
    assert all(source.startswith("data:") for source in sources)
    # Each figure lies beside the page, for print and for the screen.
    expected = {".png", ".pdf"} if verb in WITH_FIGURE_FILES else set()
    assert {Path(each).suffix for each in summary["figures"]} == expected
    assert all(Path(each).stat().st_size > 1000 for each in summary["figures"])


def test_results_stand_beside_the_baseline(runs: Path, tmp_path: Path) -> None:
    """An evaluation knows the baseline of the run whose pairs it walked, and that it walked for
    another time than they did."""
    baseline = json.loads((runs / "coopt" / "summary.json").read_text())[
        "baseline_best_distance_cm"
    ]
    report = ["report", str(runs / "evaluate"), "--figure-files", "--out", str(tmp_path)]
    assert run(report) == 0
    content = (tmp_path / "page.html").read_text()
    label = "the expert&#x27;s best phase in the world as it stands, in 4 s"
    assert f"<b>{baseline:.1f} cm</b><span>{label}</span>" in content
    assert "<td>B, in 4 s</td><td>1.0.0.2.2.0.0.1</td>" in content


def test_an_evaluation_in_another_physics_is_not_compared_with_the_trainings_expert(
    runs: Path, tmp_path: Path
) -> None:
    """What the expert does there nobody walked; what it did in the training is told as that."""
    baseline = json.loads((runs / "coopt" / "summary.json").read_text())[
        "baseline_best_distance_cm"
    ]
    again = f"evaluate {runs / 'coopt'} --pair-count 1 --physics.friction 0.3 --out {tmp_path}"
    assert run(again.split()) == 0
    assert run(["report", str(tmp_path), "--figure-files"]) == 0
    content = (tmp_path / "report" / "page.html").read_text().replace("&#x27;", "'")
    label = "the expert's best phase in the training's physics, in 4 s"
    assert f"<b>{baseline:.1f} cm</b><span>{label}</span>" in content
    where = "in the training's physics, in 4 s"
    assert f"<td>B, {where}</td><td>1.0.0.2.2.0.0.1</td>" in content
    assert "over the baseline" not in content


def test_page_says_what_each_beginning_of_a_training_came_to(runs: Path) -> None:
    scores = json.loads((runs / "coopt" / "summary.json").read_text())["restart_scores_cm"]
    assert len(scores) == 2
    report = ["report", str(runs / "coopt"), "--figure-files"]
    assert run(report) == 0
    content = (runs / "coopt" / "report" / "page.html").read_text()
    said = ", ".join(f"{score:.1f}" for score in scores)
    assert f"Learning began 2 times, with best scores of {said} cm." in content


def test_built_and_simulated_masses_stand_side_by_side(runs: Path) -> None:
    """The published simulation weighs 2.2 and 2.5 times what is built; the page says what to do."""
    summary = json.loads((runs / "fabricate" / "summary.json").read_text())
    assert summary["leg_mass_g"] == pytest.approx(46.8, abs=0.1)
    assert summary["hub_mass_g"] == pytest.approx(30.0, rel=0.05)
    assert summary["simulated_leg_mass_g"] == pytest.approx(105.0)
    assert summary["simulated_hub_mass_g"] == pytest.approx(75.0)
    assert run(["report", str(runs / "fabricate"), "--figure-files"]) == 0
    content = (runs / "fabricate" / "report" / "page.html").read_text()
    assert summary["mass_warning"] in content
    assert "<td>leg</td>" in content


def test_settings_repeat_a_run(
    runs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the page says repeats it: the second of its commands."""
    first = json.loads((runs / "simulate" / "summary.json").read_text())
    settings = runs / "simulate" / "settings.json"
    assert run(["simulate", "--settings", str(settings), "--out", str(tmp_path / "again")]) == 0
    again = json.loads((tmp_path / "again" / "summary.json").read_text())
    assert again["distance_cm"] == first["distance_cm"]


def test_pages_open_without_a_network_and_their_replays_move(
    runs: Path, tmp_path: Path, open_page: OpenPage
) -> None:
    for verb in ("coopt", "transfer"):
        folder = tmp_path / verb
        assert run(["report", str(runs / verb), "--figure-files", "--out", str(folder)]) == 0
        page = open_page(folder / "page.html")
        start = page.evaluate("pneumorphReplay.players[0].trackedPoint(0)")
        page.evaluate("pneumorphReplay.players[0].seek(2)")
        assert page.evaluate("pneumorphReplay.players[0].trackedPoint(0)") != start
        if verb == "transfer":  # the marker of the trial beside the simulation
            assert page.evaluate("pneumorphReplay.players[0].robots[1].kind") == "measured"


def test_explore_shows_what_a_run_found(
    runs: Path, capsys: pytest.CaptureFixture[str], open_page: OpenPage
) -> None:
    capsys.readouterr()
    assert run(["explore", str(runs / "coopt"), "--pair-count", "1", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    best = json.loads((runs / "coopt" / "summary.json").read_text())["best_design"]
    assert summary["design_count"] == 6972
    assert summary["scored_count"] > 0
    page = open_page(Path(summary["page"]))
    page.evaluate(f"pneumorphExplorer.select('{best}')")
    assert page.evaluate("pneumorphExplorer.player().robots[0].label") == "L1"
    other = page.evaluate("pneumorphExplorer.names()[900]")
    page.evaluate(f"pneumorphExplorer.select('{other}')")
    policy = runs / "coopt" / "training" / "policy.npz"
    command = page.locator(".details pre").text_content()
    assert command == f"pneumorph simulate --gait {policy} --design {other} --out runs/{other}"
    # The command does walk it.
    _, *arguments = command.split()
    arguments[-1] = str(runs / "walked")
    assert run(arguments) == 0
    assert json.loads((runs / "walked" / "summary.json").read_text())["design"] == other


def test_explore_refuses_a_run_without_scores(
    runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["explore", str(runs / "mesh")]) == 1
    assert "expected one of coopt, demo or evaluate" in capsys.readouterr().err
