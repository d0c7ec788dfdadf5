"""A run whose robots are to turn is ranked, certified and told in degrees."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.result import result_from_dict, result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.cli import run
from pneumorph.environment.goal import FORWARD
from pneumorph.hardware.marker_track import VideoSettings, read_track, write_track
from pneumorph.report.replay.replayed_motions import motion
from pneumorph.report.scene import Actor
from pneumorph.study.certified_candidates import CertificateSettings, unseen_worlds
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.robustness import walks_in_worlds
from pneumorph.study.shown_worlds import SHOWN_WORLDS
from pneumorph.trajectory import Trajectory

_SHORT = (
    "--restarts 1 "
    "--total-timesteps 48 --environment-count 4 --task.action-count 5 --task.action-step-count 20 "
    "--learning-start-timestep 12 --updates 1 --sac.batch-size 8 --sac.hidden-sizes 8 8 "
    "--schedule.decay-start-timestep 12 --schedule.decay-end-timestep 36 "
    "--evaluated-design-count 4 --kept-pair-count 3 --checkpoint-interval-timesteps 20 "
    "--finetuning.timesteps 0 --baseline.phase-step-deg 90 --baseline.gait.duration-s 4 "
    "--baseline.record-step-count 10 --task.reward.goal turn_left"
)
WORLDS = 5


@pytest.fixture(scope="module")
def learned(leg: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("turning") / "run"
    assert run(f"coopt --preset fast --part {leg} --out {folder} {_SHORT}".split()) == 0
    return folder


@pytest.fixture(scope="module")
def certified(learned: Path) -> Path:
    folder = learned.parent / "certified"
    asked = f"certify {learned} --world-count {WORLDS} --tuning-world-count 2 --cycle-s 0.4"
    assert run([*asked.split(), "--out", str(folder)]) == 0
    return folder


def _summary(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return content


def test_a_training_says_what_its_robots_turned(learned: Path) -> None:
    """A degree is worth 0.1 cm of reward, and nothing is taken off here."""
    found = _summary(learned)
    assert (found["goal"]["name"], found["unit"]) == ("turn_left", "degrees")
    for pair in found["pairs"]:
        assert pair["achieved"] == pytest.approx(10.0 * pair["score_cm"])
    assert found["best_achieved"] == found["pairs"][0]["achieved"]
    walked = Trajectory.load(learned / "best_trajectory.npz")
    assert found["replayed_achieved"] == pytest.approx(float(walked.turned_deg[-1]))
    assert found["replayed_achieved"] == pytest.approx(found["best_achieved"], abs=0.05)
    assert found["best_distance_cm"] == pytest.approx(walked.forward_distance_cm, abs=0.01)
    phase = int(np.argmax(found["phases_achieved"]))
    assert found["baseline_best_phase_deg"] == found["phases_deg"][phase]


def test_a_certificate_is_of_the_yaw_of_recorded_walks(learned: Path, certified: Path) -> None:
    content = _summary(certified)
    found = result_from_dict(Certificate, content)
    for file, _ in SHOWN_WORLDS.values():
        walked = Trajectory.load(certified / file)
        told = found.achieved[walked.metadata["world"]][1 + int(found.best[1:]) - 1]
        assert told == pytest.approx(float(walked.turned_deg[-1]), abs=0.02)
    chosen = next(pair for pair in found.pairs if pair.label == found.best)
    turned = np.array(found.achieved)[:, int(found.best[1:])]
    assert found.median == chosen.band.median == pytest.approx(float(np.median(turned)))
    reported = _summary(learned)["pairs"][int(found.best[1:]) - 1]["achieved"]
    assert chosen.promised == reported
    assert chosen.nominal == pytest.approx(reported, abs=0.05)


def test_nothing_in_degrees_is_called_cm(certified: Path) -> None:
    content = _summary(certified)
    assert content["unit"] == "degrees"
    assert {"median", "tenth_percentile", "optimism", "achieved"} <= set(content)
    assert set(content["pairs"][0]["band"]) == {
        "low", "median", "high", "mean", "deviation", "failed_count",
        "low_error", "median_error", "high_error",
    }  # fmt: skip
    numbers = {name: content[name] for name in ("pairs", "expert", "tests", "achieved")}
    assert "_cm" not in json.dumps(numbers)
    found = result_from_dict(Certificate, content)
    told = result_to_dict(found)
    assert told == {name: content[name] for name in told}


def test_names_are_in_cm_where_that_is_the_unit(certified: Path) -> None:
    """As those of the certificates of crawling robots always were."""
    found = result_from_dict(Certificate, _summary(certified))
    told = result_to_dict(replace(found, goal=FORWARD))
    assert told["unit"] == "cm"
    assert {"median_cm", "tenth_percentile_cm", "distances_cm", "optimism_cm"} <= set(told)
    assert told["pairs"][0]["band"]["median_cm"] == found.pairs[0].band.median
    assert result_from_dict(Certificate, told) == replace(found, goal=FORWARD)


def test_a_mirror_image_turns_to_the_other_side_in_every_world(learned: Path) -> None:
    """Friction is solved to 0.01 mm/s: a second parts images by thousandths of a degree."""
    source = FinishedRun.read(learned)
    pair, goal = source.pairs(1)[0], source.goal
    worlds = unseen_worlds(CertificateSettings().randomisation, 2, 0)
    folder = RunFolder(learned.parent / "mirrored", "certify")
    spec = source.robot.spec()
    designs = [pair.design, pair.design.mirror()]
    achieved, *_ = walks_in_worlds(
        spec, designs, [pair.gait] * 2, worlds, source.task.settling_step_count, folder, goal
    )
    np.testing.assert_allclose(achieved[:, 1], -achieved[:, 0], atol=0.01)
    assert np.abs(achieved).max() > 0.1


def test_a_replay_of_a_runs_file_tells_what_counts_there(learned: Path, tmp_path: Path) -> None:
    goal = FinishedRun.read(learned).goal
    shown = motion(f"L={learned / 'best_trajectory.npz'}", VideoSettings())
    assert isinstance(shown, Actor)
    assert shown.goal == goal != FORWARD
    alone = shutil.copy(learned / "best_trajectory.npz", tmp_path)
    assert motion(str(alone), VideoSettings()).goal == FORWARD  # type: ignore[union-attr]


def test_a_rig_tells_how_far_the_robot_turned(learned: Path, tmp_path: Path) -> None:
    """As its camera saw it, without what it does when the rig vents at the end."""
    out = tmp_path / "deployed"
    asked = f"deploy {learned} --trials 1 --model reduced --virtual.marker-noise-mm 0 --out {out}"
    assert run(asked.split()) == 0
    found = _summary(out)
    assert (found["goal"]["name"], found["unit"]) == ("turn_left", "degrees")
    track = read_track(out / "trial_1" / "track.csv")
    assert track.turned_deg is not None
    start, end = np.interp([0.0, found["duration_s"]], track.time_s, track.turned_deg)
    assert abs(end - start) > 1e-3
    assert found["mean_achieved"] == found["trials"][0]["achieved"]
    # Six digits are written.
    assert found["mean_achieved"] == pytest.approx(end - start, rel=1e-4)
    assert found["trials"][0]["turned_deg"] == found["mean_achieved"]
    page = tmp_path / "page"
    assert run(["report", str(out), "--figure-files", "--out", str(page)]) == 0
    assert "turn to the left on the rig" in (page / "page.html").read_text()
    compared = tmp_path / "transfer"
    assert run(f"transfer {out} --out {compared}".split()) == 0
    (robot,) = _summary(compared)["robots"]
    assert robot["mean_turned_deg"] == pytest.approx(end - start, rel=0.05)
    walked = Trajectory.load(compared / robot["trajectory"])
    assert robot["simulated_turned_deg"] == pytest.approx(float(walked.turned_deg[-1]))
    # What was taught counts, and the page says it in its unit.
    assert robot["simulated_achieved"] == pytest.approx(robot["simulated_turned_deg"])
    assert robot["mean_achieved"] == pytest.approx(robot["mean_turned_deg"])
    # A robot that learned for a few rounds hardly turns.
    assert abs(robot["simulated_achieved"]) < 1.0
    assert _summary(compared)["transfer_ratio"] is None
    (told,) = (each for each in _summary(compared)["notes"] if "no ratio" in each)
    assert "degrees, less than 1" in told
    page = tmp_path / "transfer_page"
    assert run(["report", str(compared), "--figure-files", "--out", str(page)]) == 0
    assert "turn to the left, measured (°)" in (page / "page.html").read_text()
    unknown, other = tmp_path / "unknown", tmp_path / "other"
    for copied in (unknown, other):
        shutil.copytree(out, copied)
    (unknown / "summary.json").unlink()
    (other / "summary.json").write_text(json.dumps({**_summary(out), "goal": {"name": "forward"}}))
    among = tmp_path / "among"
    assert run(f"transfer {unknown} {other} {out} --out {among}".split()) == 0
    told = _summary(among)
    assert told["goal"]["name"] == "turn_left"
    # They were deployed in the published physics, as those know that have a summary.
    *physics, unknown_note, other_note = (each for each in told["notes"] if "no ratio" not in each)
    assert [each.split(" was deployed")[0] for each in physics] == [str(other), str(out)]
    taught = [each.split(" was taught")[0] for each in (unknown_note, other_note)]
    assert taught == ["what unknown", "other"]
    shares = told["robots"][2]["distance_over_first"]
    assert shares == {"simulated": None, "measured": None}  # of less than a degree there is none
    _forget_the_turn(out / "trial_1" / "track.csv")
    assert run(f"transfer {out} --out {tmp_path / 'one_marker'}".split()) == 0
    blind = _summary(tmp_path / "one_marker")
    assert blind["goal"]["name"] == "forward"
    physics_note, blind_note = (each for each in blind["notes"] if "no ratio" not in each)
    assert "was deployed in the published physics" in physics_note
    assert "do not tell it: distances forward are compared" in blind_note
    policy = learned / "training" / "policy.npz"
    asked = f"deploy {policy} --design {found['design']} --trials 1 --model reduced --dry-run"
    assert run([*asked.split(), "--out", str(tmp_path / "policy")]) == 0
    assert _summary(tmp_path / "policy")["goal"]["name"] == "turn_left"


def _forget_the_turn(track: Path) -> None:
    """As of one marker alone."""
    write_track(track, replace(read_track(track), turned_deg=None))


def test_verbs_rank_by_the_turn(learned: Path, tmp_path: Path) -> None:
    for verb in ("evaluate --record", "analyse --cycle-s 0.4 --friction-step 0.8"):
        name, *flags = verb.split()
        out = tmp_path / name
        assert run([name, str(learned), *flags, "--pair-count", "3", "--out", str(out)]) == 0
        found = _summary(out)
        pairs = found["pairs"] if name == "evaluate" else found["robots"][1:]
        best = max(pairs, key=lambda each: each["achieved"])
        assert (found["best_design"], found["best_achieved"]) == (best["design"], best["achieved"])
        assert found["unit"] == "degrees"
    for robot in found["robots"][1:]:
        assert sum(robot["step_rewards"]) == pytest.approx(robot["achieved"], abs=1e-6)
    recorded = Trajectory.load(tmp_path / "evaluate/trajectory_reduced_L1.npz")
    first = _summary(tmp_path / "evaluate")["pairs"][0]
    assert first["achieved"] == pytest.approx(float(recorded.turned_deg[-1]))
    assert first["distance_cm"] == pytest.approx(recorded.forward_distance_cm)


def test_pages_tell_degrees(learned: Path, certified: Path, tmp_path: Path) -> None:
    for folder in (learned, certified):
        out = tmp_path / folder.name
        assert run(["report", str(folder), "--figure-files", "--out", str(out)]) == 0
    page = (tmp_path / "run/page.html").read_text()
    assert "A robot learned to turn to the left" in page
    assert "learned to crawl" not in page
    assert "turn to the left (°)" in page
    sure = (tmp_path / "certified/page.html").read_text()
    for words in ("How much it turns, and how sure", "median (°)", "of the best pair, median"):
        assert words in sure
    assert "median (cm)" not in sure
