"""Verbs from a reduced leg to a page, small and in the order a user runs them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.run_json import run_json
from helpers.short_training import SHORT_SWEEP

from pneumorph.base.progress import Progress
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.shipped_data import data_folder
from pneumorph.cli import run
from pneumorph.command import coopt
from pneumorph.study.training_options import TrainingOptions
from pneumorph.trajectory import Trajectory


def test_coopt_says_what_it_found_beside_the_baseline(learned: Path) -> None:
    summary = json.loads((learned / "summary.json").read_text())
    assert re.fullmatch(r"[0-3](\.[0-3]){7}", summary["best_design"])
    assert summary["timesteps"] == 48
    assert summary["preset"] == "quick"
    assert summary["peak_memory_mb"] > 50
    assert summary["wall_s"] > summary["training_wall_s"] > 0
    assert summary["baseline_best_distance_cm"] == max(summary["distances_cm"])
    assert summary["phases_deg"] == [0.0, 90.0, 180.0]
    # The best pair's gait file walks the same distance again, to the rounding of the file's sums.
    assert summary["replayed_distance_cm"] == pytest.approx(summary["best_distance_cm"], abs=1e-9)
    assert summary["damping"] == "published"


def test_where_there_is_nothing_to_resume_a_new_training_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(coopt, "train_as_asked", lambda options, folder: None)
    for resume in (False, True):
        coopt.run(
            TrainingOptions(resume=resume, page=False), RunFolder(tmp_path, "coopt", Progress())
        )
        said = capsys.readouterr().err
        assert (f"{tmp_path} has no checkpoint to go on from" in said) == resume


def test_coopt_refuses_a_folder_with_a_run_and_resumes_it(
    learned: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again = ["coopt", "--settings", str(learned / "settings.json"), "--out", str(learned)]
    before = (learned / "settings.json").read_text()
    assert run([*again, "--seed", "7"]) == 1
    assert "holds a training run already" in capsys.readouterr().err
    assert (learned / "settings.json").read_text() == before
    summary = run_json(" ".join([*again, "--resume"]), capsys)
    assert "resumed at timestep 48" in summary["notes"]


def test_what_is_printed_for_a_person_says_in_which_physics_it_is(
    learned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = f"evaluate {learned} --physics.friction-by-surface hub 0.3 --out {tmp_path / 'e'}"
    assert run(asked.split()) == 0
    assert "friction 1.2, of hub 0.3, pressures by 150 kPa/s" in capsys.readouterr().out


def test_evaluate_repeats_the_distances(
    learned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The leg and the physics are those of the run, but for what a flag changes."""
    found = run_json(f"evaluate {learned} --out {tmp_path / 'e'}", capsys)
    assert len(found["pairs"]) == 2
    assert found["notes"] == []
    icy = run_json(f"evaluate {learned} --physics.friction 0.1 --out {tmp_path / 'i'}", capsys)
    assert icy["best_distance_cm"] != found["best_distance_cm"]
    assert "the run reported" in icy["notes"][0]
    for pair in found["pairs"]:
        assert pair["distance_cm"] == pytest.approx(pair["reported_distance_cm"], abs=1e-9)
    recorded = run_json(
        f"evaluate {learned} --record --pair-count 1 --out {tmp_path / 'r'}", capsys
    )
    assert recorded["best_distance_cm"] == pytest.approx(found["best_distance_cm"], abs=1e-9)
    assert (tmp_path / "r" / "trajectory_reduced_L1.npz").exists()


def test_simulate_walks_a_gait_file_and_films_it(
    learned: Path, leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gait = learned / "training" / "gaits" / "L1.csv"
    summary = run_json(
        f"simulate --gait {gait} --part {leg} --film --film-settings.width 240 --out {tmp_path}",
        capsys,
    )
    learned_summary = json.loads((learned / "summary.json").read_text())
    assert summary["design"] == learned_summary["best_design"]
    assert summary["distance_cm"] == pytest.approx(learned_summary["best_distance_cm"], abs=1e-9)
    trajectory = Trajectory.load(tmp_path / "trajectory.npz")
    assert trajectory.forward_distance_cm == summary["distance_cm"]
    aside_mm = trajectory.tracked_point_mm[[0, -1], 1]
    assert 10.0 * summary["left_cm"] == pytest.approx(aside_mm[1] - aside_mm[0])
    axis = trajectory.hub_rotation[[0, -1], :2, 0]
    turned_deg = np.degrees(np.arctan2(axis[:, 1], axis[:, 0]))
    assert summary["turned_deg"] == pytest.approx(turned_deg[1] - turned_deg[0])
    assert (tmp_path / "film.mp4").stat().st_size > 1000


def test_regulators_that_a_gait_leaves_out_stay_empty(
    leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    header, empty = "time_s,regulator_1_kPa", ",regulator_2_kPa,regulator_3_kPa"
    rows = ("0.0,0.0", "0.1,60.0", "1.0,60.0")
    distances = []
    for columns, zeros in (("", ""), (empty, ",0.0,0.0")):
        gait = tmp_path / "gait.csv"
        lines = [header + columns, *(row + zeros for row in rows)]
        gait.write_text("# design: 1.0.0.1.0.1.0.0\n" + "\n".join(lines) + "\n")
        summary = run_json(f"simulate --gait {gait} --part {leg} --out {tmp_path / 's'}", capsys)
        distances.append(summary["distance_cm"])
    assert distances[0] == distances[1] != 0.0


def test_simulate_takes_a_full_robot_of_any_design(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two legs and five steps of 10 ms: the contact law, and that no step failed, are reported."""
    summary = run_json(
        "simulate --physics published --model full --design 1.0.0.0.2.0.0.0 --record-every 2 "
        f"--expert.duration-s 0.05 --full.hub rigid --out {tmp_path}",
        capsys,
    )
    assert summary["status"] == "completed"
    assert summary["steps"] == {"count": 5, "halved": 0, "mean_iterations": 1.0}
    assert summary["contact"]["worst_residual_mm_per_s"] < 1e-6
    trajectory = Trajectory.load(tmp_path / "trajectory.npz")
    assert trajectory.time_s == pytest.approx([0.0, 0.02, 0.04, 0.05])
    assert trajectory.cavity_volume_mm3 is not None
    assert trajectory.cavity_volume_mm3.shape == (4, 2)
    assert not (tmp_path / "checkpoint.npz").exists()


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ("--design 0.0.0.0.0.0.0.0", "has no legs, expected at least one"),
        ("--design 1.0.0.4.4.0.0.1", "regulator 4, expected 1 to 3"),
        ("--design 1.a.2", "not whole numbers joined by dots"),
        ("--design 1.1.1", "3 locations, expected 8"),
        ("--gait none.csv", "none.csv does not exist"),
        ("--part none.npz", "none.npz does not exist"),
        ("--full.integrator implicit_euler", "full.integrator is 'implicit_euler'"),
    ],
)
def test_simulate_refuses_bad_input(
    flags: str, message: str, leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = "" if "--part" in flags else f"--part {leg}"
    assert run(f"simulate {flags} {part} --out {tmp_path / 's'}".split()) == 1
    error = capsys.readouterr().err
    assert message in error.splitlines()[-1]


def test_report_is_one_page_of_the_run(learned: Path, capsys: pytest.CaptureFixture[str]) -> None:
    summary = run_json(f"report {learned} --replay.frame-interval-s 0.5 --figure-files", capsys)
    content = Path(summary["page"]).read_text()
    assert Path(summary["page"]) == learned / "report" / "page.html"
    for heading in ("Replay", "Distance and path", "Gait", "The expert&#x27;s gait", "Training",
                    "The best pairs", "How to repeat it"):  # fmt: skip
        assert f"<h2>{heading}" in content
    assert all(source.startswith("data:") for source in re.findall(r'src="([^"]*)"', content))
    # The report leaves the run's own files alone.
    assert json.loads((learned / "summary.json").read_text())["verb"] == "coopt"


def test_report_refuses_what_is_no_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["report", str(tmp_path)]) == 1
    assert "not the folder of a finished pneumorph run" in capsys.readouterr().err


def test_compare_refuses_a_reduction_of_another_mesh(
    leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(f"compare --part {leg} --out {tmp_path / 'c'}".split()) == 1
    assert "of another mesh than the leg that ships; give the mesh" in capsys.readouterr().err


def test_compare_walks_a_grid_of_reductions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A grid of the leg that ships alone errs as that leg does; its full walks ship too."""
    shipped = data_folder("leg_published.npz")
    command = (
        "compare --physics published --animations two_leg --heldout-count 0 "
        "--periodic-count 1 --periodic-duration-s 0.1 "
        f"--floating-duration-s 0 --timed-steps 0 --grid {shipped} --out {tmp_path}"
    )
    summary = run_json(command, capsys)
    walked = summary["periodic"]["periodic_00"]
    apart_cm = abs(walked["forward_reduced_cm"] - walked["forward_full_cm"])
    assert summary["periodic_distance_error_cm"] == pytest.approx(apart_cm)
    (point,) = summary["tolerance_grid"]
    assert point["mean_node_error_mm"] == summary["animations_mean_node_error_mm"]
    assert point["mode_count"] == summary["leg"]["mode_count"]
    assert 0.0 < point["s_per_step"] < 0.1
    assert (tmp_path / "tolerances.png").is_file()


def test_baseline_and_bench(leg: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sweep = " ".join(f"--{flag}" for flag in SHORT_SWEEP)
    sweep += " --settling-step-count 40"
    swept = run_json(f"baseline --part {leg} {sweep} --out {tmp_path / 'b'}", capsys)
    assert swept["baseline_best_phase_deg"] in swept["phases_deg"]
    recorded = Trajectory.load(tmp_path / "b" / "baseline_trajectory.npz")
    assert recorded.time_s[-1] == 4.0
    # The recorded walk is the swept one, settling included.
    swept_cm = swept["baseline_best_distance_cm"]
    assert recorded.forward_distance_cm == pytest.approx(swept_cm, abs=1e-6)
    bench = run_json(
        f"bench engine --part {leg} --robot-count 4 --action-count 1 --out {tmp_path / 'e'}", capsys
    )
    assert bench["env_steps_per_s"] > 0
    assert bench["modes"] == 4
    assert set(bench) >= {"threads", "elements", "mean_contacts", "stage_seconds", "gemm_gflops",
                          "gemm_threads", "gemm_precision"}  # fmt: skip


def test_bench_full_times_the_stages_of_a_step(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flag = "--full-benchmark"
    short = f"{flag}.settling-steps 2 {flag}.walking-steps 1 {flag}.timed-steps 3"
    robot = "--physics published --design 1.0.0.0.2.0.0.0"
    asked = f"{robot} {short} {flag}.repetitions 1 --out {tmp_path / 'f'}"
    bench = run_json(f"bench full {asked}", capsys)
    stages = ("assembly", "factorisation", "contact", "other")
    total = sum(bench[f"{stage}_seconds"] for stage in stages)
    assert total == pytest.approx(bench["seconds_per_step"])
    assert bench["leg_factorisation_seconds"] > 0
    assert bench["legs"] == 2
    assert bench["contact_count"] > 0
    assert bench["threads"] == 1
