"""Verbs around a coopt run: fine-tuning, analysis, searches, campaigns."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.dying_run import dies_once
from helpers.run_json import run_json
from helpers.short_training import SHORT_FINETUNING

from pneumorph.base.executor import Backend, ExecutorSettings, run_tasks
from pneumorph.base.settings import load_settings, settings_to_dict
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.cli import run
from pneumorph.gait.gait_file import read_gait
from pneumorph.report import analysis_figures
from pneumorph.report.robustness_figures import friction_figure, margin_figure
from pneumorph.robot.design import Design
from pneumorph.study import analysis, campaign
from pneumorph.study.campaign import run_one
from pneumorph.study.kept_run import keep_run
from pneumorph.study.training_options import TrainingOptions
from pneumorph.trajectory import Trajectory

_SHORT = f"{SHORT_FINETUNING} --certified-world-count 0"


@pytest.fixture(scope="module")
def learned(leg: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished coopt run with fine-tuning."""
    folder = tmp_path_factory.mktemp("coopt") / "run"
    assert run(f"coopt --part {leg} --out {folder} {_SHORT}".split()) == 0
    return folder


def test_coopt_reports_finetuned_pairs_and_where_the_time_went(learned: Path) -> None:
    summary = json.loads((learned / "summary.json").read_text())
    # Fine-tuning adds to what was seen, and takes nothing away.
    kept, seen = ([pair["score_cm"] for pair in summary[name]] for name in ("pairs", "seen_pairs"))
    assert len(kept) == 2
    assert all(mine >= before for mine, before in zip(kept, seen, strict=True))
    assert summary["finetuning_timesteps"] == 40
    assert summary["finetuning_wall_s"] > 0.0
    spent = ("simulate_s", "learn_s", "log_s", "evaluate_s", "other_s")
    assert sum(summary[name] for name in spent) == pytest.approx(summary["training_wall_s"])
    assert len(list((learned / "training" / "finetuned").iterdir())) == 2


def test_evaluate_can_take_the_usual_physics_again(
    learned: Path, leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = json.loads((learned / "settings.json").read_text())
    settings["robot"]["physics"]["friction"] = 0.1
    (tmp_path / "run" / "training").mkdir(parents=True)
    for name in ("summary.json", "training/gaits"):
        (tmp_path / "run" / name).symlink_to(learned / name)
    (tmp_path / "run" / "settings.json").write_text(json.dumps(settings))
    icy = run_json(f"evaluate {tmp_path / 'run'} --out {tmp_path / 'icy'}", capsys)
    usual = run_json(
        f"evaluate {tmp_path / 'run'} --afresh --part {leg} --out {tmp_path / 'usual'}", capsys
    )
    reported = usual["reported_distance_cm"]
    assert usual["best_distance_cm"] == pytest.approx(reported, abs=1e-9)
    assert icy["best_distance_cm"] != pytest.approx(reported, abs=1e-3)


def test_analyse_tells_steps_legs_and_friction(
    learned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = run_json(
        f"analyse {learned} --cycle-s 0.4 --record-every 1 --friction-step 0.3 "
        f"--highest-friction 1.2 --out {tmp_path}",
        capsys,
    )
    assert found["frictions"] == [0.6, 0.9, 1.2]
    assert [robot["label"] for robot in found["robots"]] == ["B", "L1", "L2"]
    summary = json.loads((learned / "summary.json").read_text())
    for robot, pair in zip(found["robots"][1:], summary["pairs"], strict=True):
        assert robot["distance_cm"] == pytest.approx(pair["distance_cm"], abs=1e-9)
        # Rewards of the steps add up to the distance, and the walk at the run's own friction is it.
        assert sum(robot["step_rewards_cm"]) == pytest.approx(robot["distance_cm"], abs=1e-9)
        assert len(robot["step_rewards_cm"]) == 5
        assert robot["distances_over_friction_cm"][2] == pytest.approx(pair["distance_cm"], 1e-9)
        assert robot["distances_over_friction_cm"][0] != robot["distances_over_friction_cm"][2]
        for leg in robot["legs"]:
            assert 0.0 <= leg["used_share"] <= 1.0 + 1e-5
    assert found["robots"][0]["distance_cm"] == pytest.approx(
        summary["baseline_best_distance_cm"], abs=1e-6
    )
    assert (tmp_path / "friction.png").stat().st_size > 5000
    recorded = Trajectory.load(tmp_path / "trajectory_L1.npz")
    assert recorded.contact_force_mN is not None
    # Over time the floor carries the robot's weight: twenty seconds of the expert's robot, whose
    # hub hangs over the floor, are a mean, five short actions are not.
    assert found["robots"][0]["hub_load_share"] == pytest.approx(0.0, abs=0.02)
    assert sum(leg["mean_load_mN"] for leg in found["robots"][1]["legs"]) > 0.0


def test_figures_of_an_analysis_know_the_friction_of_each_surface(
    learned: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drawn: dict[str, Any] = {}

    def margins(robots: Any, cycle_s: float) -> Any:
        drawn["margins"] = {label: margin for label, (_, margin) in robots.items()}
        return margin_figure(robots, cycle_s)

    def over_friction(frictions: Any, distances_cm: Any, own: float | None, *rest: Any) -> Any:
        drawn["own"] = own
        return friction_figure(frictions, distances_cm, own, *rest)

    monkeypatch.setattr(analysis_figures, "margin_figure", margins)
    monkeypatch.setattr(analysis_figures, "friction_figure", over_friction)
    surfaces = "--physics.friction-by-surface sheet 0.3 hub 0.2"
    asked = f"analyse {learned} --cycle-s 0.4 --record-every 1 --friction-step 0.8 --out {tmp_path}"
    found = run_json(f"{asked} {surfaces}", capsys)
    for robot in found["robots"]:
        margin = drawn["margins"][robot["label"]]
        for number, leg in enumerate(robot["legs"]):
            assert margin.of_leg(number)["used_share"] == pytest.approx(leg["used_share"], 1e-12)
    # No one coefficient of all surfaces is that of the walks.
    assert drawn["own"] is None


@pytest.mark.parametrize("diverging_count", [1, 2])
def test_analyse_goes_on_where_robots_diverge(
    diverging_count: int,
    learned: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The best is the furthest of those that came to their end."""
    recorded, walked = analysis.recorded_walk, []

    def diverging(spec: RobotSpec, design: Design, *arguments: Any, **options: Any) -> Trajectory:
        whole = recorded(spec, design, *arguments, **options)
        walked.append(design)
        if not 1 < len(walked) <= 1 + diverging_count:  # the expert's robot is the first
            return whole
        names = [name for name, array in whole.arrays().items() if len(array) == len(whole.time_s)]
        start = {name: getattr(whole, name)[:2] for name in names}
        return replace(whole, status="diverged", **start)

    monkeypatch.setattr(analysis, "recorded_walk", diverging)
    found = run_json(f"analyse {learned} --cycle-s 0.4 --out {tmp_path}", capsys)
    ends = ["completed", *["diverged"] * diverging_count, "completed"][:3]
    assert [robot["status"] for robot in found["robots"]] == ends
    best = found["robots"][1 if diverging_count == 2 else 2]
    assert found["best_design"] == best["design"]
    assert found["best_distance_cm"] == best["distance_cm"]
    assert (found["best_distance_cm"] is None) == (diverging_count == 2)
    assert found["robots"][1]["step_rewards_cm"] is None
    assert (tmp_path / "cycle_B.png").exists()
    assert not (tmp_path / "cycle_L1.png").exists()


@pytest.mark.parametrize("method", ["random", "genetic"])
def test_search_of_designs_reports_pairs_that_walk_again(
    method: str, leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = (
        f"search --method {method} --part {leg} --timesteps 60 --environment-count 4 "
        f"--{method}.population 4 --task.action-count 5 --task.action-step-count 20 "
        "--kept-pair-count 2 "
        f"--out {tmp_path / 'search'}"
    )
    found = run_json(command, capsys)
    assert found["timesteps"] == 60
    assert found["simulated_s"] == pytest.approx(60 * 0.2)
    curve = json.loads((tmp_path / "search" / "learning_curve.json").read_text())
    assert curve["timesteps"] == [20, 40, 60]
    assert curve["best_distance_cm"][-1] == found["best_distance_cm"]
    best = found["pairs"][0]
    again = run_json(
        f"simulate --gait {tmp_path / 'search' / best['gait']} --part {leg} --out {tmp_path / 's'}",
        capsys,
    )
    assert again["distance_cm"] == pytest.approx(best["distance_cm"], abs=1e-9)
    # With the same folder the finished search is read again.
    repeated = run_json(command, capsys)
    assert repeated["pairs"] == found["pairs"]
    assert repeated["notes"] == ["resumed at timestep 60"]


def test_search_of_gaits_stands_beside_the_policy(
    learned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = run_json(
        f"search --run {learned} --random-design-count 2 --timesteps 200 --environment-count 8 "
        f"--gaits.population 4 --out {tmp_path}",
        capsys,
    )
    designs = found["designs"]
    assert designs[0]["why"] == "expert's design"
    assert {"L1", "L2"} <= {row["why"] for row in designs}
    assert len({row["design"] for row in designs}) == len(designs)
    for row in designs:
        assert row["policy_distance_cm"] is not None
        gait, comments = read_gait(tmp_path / row["gait"])
        assert comments["design"] == row["design"]
        assert gait.held_kPa.shape == (5, 3)
        assert row["late_gain_cm"] >= 0.0
        reported = row["learned_distance_cm"]
        assert (reported is not None) == row["why"].startswith("L")
    drawn = [row for row in designs if row["why"] == "drawn at random"]
    gaps = [row["distance_cm"] - row["policy_distance_cm"] for row in drawn]
    assert found["policy_gaps_cm"]["drawn at random"] == {
        "count": 2, "mean": pytest.approx(np.mean(gaps)), "largest": max(gaps)
    }  # fmt: skip
    assert set(found["policy_gaps_cm"]) == {"expert's design", "best pairs", "drawn at random"}
    assert not any("in no file of the run" in note for note in found["notes"])


def test_a_search_beside_a_task_of_ones_own_says_that_it_ranks_otherwise(
    learned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = tmp_path / "own"
    keep_run(learned, own)
    summary = json.loads((own / "summary.json").read_text())
    (own / "summary.json").write_text(json.dumps({**summary, "own_task": "Straight"}))
    found = run_json(
        f"search --run {own} --method random --timesteps 20 --environment-count 4 "
        f"--out {tmp_path / 'search'}",
        capsys,
    )
    assert found["notes"][0].startswith("ranked by distance: Straight, the task that was")


def test_search_of_gaits_does_without_the_expert_where_it_has_too_many_legs(
    leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = run_json(
        f"search --part {leg} --space.maximum-legs 3 --designs 0.0.1.2.1.0.0.0 "
        "--random-design-count 0 --timesteps 20 --environment-count 4 --gaits.population 4 "
        f"--task.action-count 5 --task.action-step-count 20 --out {tmp_path}",
        capsys,
    )
    assert [row["design"] for row in found["designs"]] == ["0.0.1.2.1.0.0.0"]


def test_a_run_that_lost_its_policy_is_refused_before_the_search(
    learned: Path, tmp_path: Path
) -> None:
    keep_run(learned, tmp_path / "kept")
    (tmp_path / "kept" / "training" / "policy.npz").unlink()
    command = f"search --run {tmp_path / 'kept'} --timesteps 200 --out {tmp_path / 'search'}"
    assert run(command.split()) == 1
    assert not (tmp_path / "search" / "search.jsonl").exists()


def _seeded(base: TrainingOptions, seed: int) -> dict[str, Any]:
    return settings_to_dict(replace(base, coopt=replace(base.coopt, seed=seed)))


@pytest.mark.parametrize("backend", ["processes", "ray"])
def test_a_campaigns_dead_worker_costs_its_own_run_nothing_but_time(
    backend: Backend, learned: Path, tmp_path: Path
) -> None:
    """A run in a process of its own dies once and ends as the run that did not."""
    if backend == "ray":
        pytest.importorskip("ray")
    base = load_settings(TrainingOptions, learned / "settings.json")
    tasks = [("a", _seeded(base, 0))]
    settings = ExecutorSettings(backend, process_count=2)
    answers = list(run_tasks(dies_once, (str(tmp_path), None, 1), tasks, settings))
    assert answers == [(0, None)]
    assert (tmp_path / "a.died").exists()
    alone, died = (
        json.loads((folder / "summary.json").read_text()) for folder in (learned, tmp_path / "a")
    )
    assert died["notes"] == ["resumed at timestep 40"]
    # What the process that died spent on learning counts.
    assert died["wall_s"] >= died["training_wall_s"] + died["finetuning_wall_s"]
    assert died["pairs"] == alone["pairs"]
    # A finished run is left alone; one of other settings is not written over.
    assert run_one((str(tmp_path), None, 1), tasks[0]) is None
    for _ in ("finished", "stopped"):
        assert "holds a run of other settings" in str(
            run_one((str(tmp_path), None, 1), ("a", _seeded(base, 5)))
        )
        assert json.loads((tmp_path / "a" / "settings.json").read_text())["coopt"]["seed"] == 0
        (tmp_path / "a" / "summary.json").unlink(missing_ok=True)


def test_campaign_compares_seeds_and_variants(
    leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Made in this process; tests/reproduce has a campaign whose runs have processes of their own,
    which take longer to begin than such runs take."""

    def here(make: Any, shared: Any, tasks: Any, *_: Any, **__: Any) -> Any:
        return ((number, make(shared, task)) for number, task in enumerate(tasks))

    monkeypatch.setattr(campaign, "run_tasks", here)
    (tmp_path / "slippery.toml").write_text("[robot.physics]\nfriction = 0.3\n")
    (tmp_path / "usual.json").write_text("{}")
    found = run_json(
        f"campaign --preset fast --seeds 0 1 --part {leg} {_SHORT} --out {tmp_path / 'runs'} "
        f"--variants {tmp_path / 'slippery.toml'} {tmp_path / 'usual.json'}",
        capsys,
    )
    names = ["slippery-0", "slippery-1", "usual-0", "usual-1"]
    assert [each["name"] for each in found["runs"]] == names
    assert found["failures"] == {}
    far = {each["name"]: each["best_distance_cm"] for each in found["runs"]}
    assert "their physics differ (slippery-0, usual-0)" in found["notes"][0]
    assert found["best_run"] is None
    usual = found["variants"]["usual"]
    assert usual["mean_best_distance_cm"] == pytest.approx((far["usual-0"] + far["usual-1"]) / 2)
    assert far["usual-0"] != far["slippery-0"]
    saved = json.loads((tmp_path / "runs" / "slippery-1" / "settings.json").read_text())
    assert saved["robot"]["physics"]["friction"] == 0.3
    assert saved["coopt"]["seed"] == 1
