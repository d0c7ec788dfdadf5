"""Replay, watch and live pages from the command line, as a user calls them."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.run_json import run_json

from pneumorph.base.artefact import write_atomically
from pneumorph.cli import run
from pneumorph.hardware.marker_track import MarkerTrack, write_track
from pneumorph.trajectory import Trajectory

OpenPage = Callable[[Path | str], Any]
PLAYER = "pneumorphReplay.players[0]"


def _trial(folder: Path) -> Path:
    """A trial of 3 s whose marker moves 5 mm/s forward, half a second into its video."""
    folder.mkdir()
    rows = ["time_s,commanded_1_kPa,commanded_2_kPa,sensed_1_kPa,sensed_2_kPa,event"]
    rows += [f"{t:.2f},{30 * t:.2f},0,{29 * t:.2f},0," for t in np.arange(0.0, 3.01, 0.25)]
    content = ("\n".join(rows) + "\n").encode()
    write_atomically(folder / "log.csv", lambda stream: stream.write(content))
    time_s = np.arange(-0.5, 3.01, 0.1)
    path = np.column_stack([40.0 + 5.0 * time_s, np.full(len(time_s), 7.0)])
    write_track(folder / "track.csv", MarkerTrack(time_s, path))
    return folder


def test_replay_of_two_robots_and_a_trial_with_films(
    learned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], open_page: OpenPage
) -> None:
    trial = _trial(tmp_path / "trial_1")
    summary = run_json(
        f"replay learned={learned / 'best_trajectory.npz'} {learned / 'baseline_trajectory.npz'} "
        f"real={trial} --out {tmp_path / 'out'} --mp4 --gif --film.width 240 "
        "--film.frames-per-second 2",
        capsys,
    )
    assert summary["robots"] == ["learned", "baseline_trajectory", "real"]
    assert summary["largest_error_mm"] <= 0.01
    assert Path(summary["mp4"]).stat().st_size > 1000
    assert Path(summary["gif"]).stat().st_size > 1000
    page = open_page(Path(summary["page"]))
    assert page.evaluate(f"{PLAYER}.robots.map((each) => each.kind)") == [
        "simulated", "simulated", "measured",
    ]  # fmt: skip
    page.evaluate(f"{PLAYER}.seek(3)")
    # 5 mm/s for 3 s from the start of the gait, and what was sensed.
    assert page.evaluate(f"{PLAYER}.distance(2)") == pytest.approx(1.5)
    assert page.evaluate(f"{PLAYER}.pressures(2)") == pytest.approx([87.0, 0.0])


def test_a_run_is_replayed_by_what_it_recorded(
    learned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    summary = run_json(f"replay {learned} ours={learned} --out {tmp_path / 'out'}", capsys)
    assert summary["robots"] == [learned.name, "ours"]


def test_replay_refuses_what_holds_no_motion(
    learned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ["--out", str(tmp_path / "out")]
    assert run(["replay", str(learned / "phase_sweep.npz"), *out]) == 1
    assert "holds a PhaseSweep, expected a Trajectory" in capsys.readouterr().err
    assert run(["replay", str(learned / "training"), *out]) == 1
    assert "holds no track" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_watch_tells_the_moment(learned: Path, capsys: pytest.CaptureFixture[str]) -> None:
    summary = run_json(f"watch {learned}", capsys)
    found = json.loads((learned / "summary.json").read_text())
    assert summary["finished"]
    assert summary["timestep"] == summary["timesteps"] == 48
    assert summary["design_entropy_target"] == 2.0
    # The checkpoint is older than the evaluation at the end, which may add to the pairs.
    assert summary["best_designs"][0]["distance_cm"] <= found["best_distance_cm"]
    assert summary["page"] is None


def test_watch_once_writes_a_page_that_stands_alone(
    learned: Path, capsys: pytest.CaptureFixture[str], open_page: OpenPage
) -> None:
    summary = run_json(f"watch {learned} --once", capsys)
    page = open_page(Path(summary["page"]))
    assert "Finished: 48 of 48 timesteps" in page.locator("#status").inner_text()
    designs = page.locator("#designs figcaption").all_inner_texts()
    assert [text.split(",")[0] for text in designs] == [
        each["design"] for each in summary["best_designs"]
    ]
    pictures = page.locator("#figures img")
    assert pictures.count() == 2
    assert all(pictures.nth(i).evaluate("(each) => each.naturalWidth") > 100 for i in range(2))
    # The best robot crawls as far as training saw it crawl.
    page.evaluate(f"{PLAYER}.pause(); {PLAYER}.seek(1e3);")
    assert page.evaluate(f"{PLAYER}.distance()") == pytest.approx(
        summary["best_designs"][0]["distance_cm"], abs=1e-4
    )


def test_watch_needs_a_training(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["watch", str(tmp_path)]) == 1
    assert "holds no settings.json" in capsys.readouterr().err
    (tmp_path / "settings.json").write_text("{}")
    assert run(["watch", str(tmp_path)]) == 1
    assert "holds no training, expected the folder of a coopt run" in capsys.readouterr().err


@pytest.fixture
def started() -> Iterator[Callable[[list[str]], tuple[subprocess.Popen[str], str]]]:
    """Return a function that starts a verb and returns the process and the address it prints."""
    processes: list[subprocess.Popen[str]] = []

    # A shell that runs the tests in the background has their programs ignore the keyboard.
    program = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from pneumorph.cli import main; main()"
    )

    def start(arguments: list[str]) -> tuple[subprocess.Popen[str], str]:
        process = subprocess.Popen(
            [sys.executable, "-c", program, *arguments],
            stderr=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "OMP_NUM_THREADS": "1", "JAX_PLATFORMS": "cpu"},
        )
        processes.append(process)
        assert process.stderr is not None
        for line in process.stderr:
            if found := re.search(r"http://127\.0\.0\.1:\d+/", line):
                return process, found.group()
        raise AssertionError(f"no address printed, exit status {process.wait()}")

    yield start
    for process in processes:
        if process.poll() is None:
            process.kill()
            process.wait()


def test_watch_follows_a_run_that_is_still_written_and_ends_at_the_keyboard(
    learned: Path, tmp_path: Path, open_page: OpenPage, started: Any
) -> None:
    run_folder = tmp_path / "run"
    (run_folder / "training").mkdir(parents=True)
    (run_folder / "settings.json").write_bytes((learned / "settings.json").read_bytes())
    process, address = started(["watch", str(run_folder), "--interval-s", "0.1"])
    page = open_page(address)
    page.wait_for_function("document.getElementById('status').innerText.includes('No round yet')")
    lines = (learned / "training/metrics.jsonl").read_text().splitlines(keepends=True)
    metrics = run_folder / "training/metrics.jsonl"
    # A line that is only half written is not a round.
    metrics.write_text(lines[0] + lines[1][:40])
    page.wait_for_function("document.getElementById('status').innerText.includes('12 of 48')")
    assert page.evaluate("pneumorphReplay.players.length") == 0
    checkpoint = (learned / "training/checkpoint.npz").read_bytes()
    write_atomically(run_folder / "training/checkpoint.npz", lambda s: s.write(checkpoint))
    metrics.write_text("".join(lines))
    page.wait_for_function("document.getElementById('status').innerText.includes('48 of 48')")
    page.wait_for_function("pneumorphReplay.players.length === 1")
    assert page.locator("#designs figure").count() > 0
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=120) == 0
    summary = json.loads((run_folder / "watch/summary.json").read_text())
    assert summary["timestep"] == 48


def test_simulate_live_shows_the_robot_and_ends_when_the_page_has_it(
    leg: Path, tmp_path: Path, open_page: OpenPage, started: Any
) -> None:
    out = tmp_path / "out"
    process, address = started(
        ["simulate", "--part", str(leg), "--out", str(out), "--expert.duration-s", "4", "--live"]
    )
    page = open_page(address)
    assert process.wait(timeout=300) == 0
    page.wait_for_function(f"{PLAYER} && !{PLAYER}.live")
    trajectory = Trajectory.load(out / "trajectory.npz")
    assert page.evaluate(f"{PLAYER}.robots[0].frames") == len(trajectory.time_s) == 41
    page.evaluate(f"{PLAYER}.pause(); {PLAYER}.seek(2);")
    shown = np.array(page.evaluate(f"Array.from({PLAYER}.nodePositions())"))
    assert trajectory.node_positions_mm is not None
    # Sent as they are, in the single precision of the file.
    assert np.array_equal(shown.astype(np.float32), trajectory.node_positions_mm[20].ravel())
    assert json.loads((out / "summary.json").read_text())["live_page_read"]
    replay = open_page(out / "replay.html")
    assert replay.evaluate(f"{PLAYER}.duration") == pytest.approx(4.0)


def test_a_described_robot_is_simulated_replayed_and_explored(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The plate walks with its own design, hub and legs, and the page shows them."""
    plate = Path(__file__).parent.parent.parent / "examples" / "plate.toml"
    out = tmp_path / "walk"
    found = run_json(f"simulate --robot {plate} --expert.duration-s 1 --out {out}", capsys)
    assert found["design"] == "b1.0.2.2.0.b1"
    assert found["status"] == "completed"
    assert (out / "replay.html").stat().st_size > 100_000
    walked = Trajectory.load(out / "trajectory.npz")
    assert walked.shape is not None
    np.testing.assert_array_equal(walked.shape.leg_part, [0, 1, 1, 0])
    assert np.ptp(walked.shape.hub_nodes_mm, axis=0) == pytest.approx([150.0, 90.0, 10.0])
    assert walked.commanded_kPa.shape[1] == 4


def test_a_robot_of_a_file_is_made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Moulds for both kinds of legs, and a plate with a socket for each of four."""
    pytest.importorskip("netgen.occ")
    plate = Path(__file__).parent.parent.parent / "examples" / "plate.toml"
    out = tmp_path / "made"
    command = ["fabricate", "b1.0.2.2.0.b1", "--robot", str(plate), "--out", str(out), "--json"]
    # Fins between the teeth of the short leg are 0.75 mm thick.
    assert run(command) == 1
    refusal = "as thick as their gaps: short 0.75 mm, expected 0.8 mm or more"
    assert refusal in capsys.readouterr().err
    assert run([*command, "--mould.smallest-wall-mm", "0.75", "--surface-size-mm", "20"]) == 0
    summary = json.loads((out / "summary.json").read_text())
    short, long = summary["legs"]
    assert (short["name"], short["count"], long["name"], long["count"]) == ("short", 2, "long", 2)
    assert short["cast_volume_mm3"] == pytest.approx(0.75**3 * long["cast_volume_mm3"], rel=1e-6)
    assert long["mass_g"] == pytest.approx(46.8, abs=0.1)
    # The plate's own 81 g, and its sockets of the same stuff; less what legs and tubes take.
    assert summary["simulated_hub_mass_g"] == pytest.approx(81.0)
    assert 81.0 < summary["hub_mass_g"] < 1.1 * 81.0
    assert [each["location"] for each in summary["tubes"]] == [0, 2, 3, 5]
    for name in ("short_mould_upper", "long_core", "short_leg", "hub"):
        assert (out / f"{name}.stl").exists()
        assert (out / f"{name}.step").exists()
    assert (out / "drawing.pdf").exists()


def test_designs_that_a_file_forbids_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The usual one is refused; one that is asked for walks, and it is said."""
    plate = Path(__file__).parent.parent.parent / "examples" / "plate.toml"
    text = plate.read_text().replace("[designs]", '[designs]\nexclusions = ["0 5"]')
    file = tmp_path / "robot.toml"
    file.write_text(text)
    assert run(["simulate", "--robot", str(file)]) == 1
    refused = capsys.readouterr().err
    refusal = "designs.usual is b1.0.2.2.0.b1, expected a design that options, exclusions and"
    assert refusal in refused
    assert "it breaks exclusions[0] = '0 5'" in refused
    file.write_text(text.replace('usual = "b1.0.2.2.0.b1"', 'usual = "b1.1.2.2.1.0"'))
    short = ["--expert.duration-s", "0.1", "--out", str(tmp_path / "run")]
    assert run(["simulate", "--robot", str(file), "--design", "b1.0.2.2.0.b1", *short]) == 0
    said = capsys.readouterr()
    assert "design b1.0.2.2.0.b1 is none that [designs] of" in said.out + said.err


def test_a_description_says_itself_what_its_legs_are(
    capsys: pytest.CaptureFixture[str],
) -> None:
    plate = Path(__file__).parent.parent.parent / "examples" / "plate.toml"
    assert run(["simulate", "--robot", str(plate), "--leg", "hyperelastic"]) == 1
    assert "--leg is given beside --robot" in capsys.readouterr().err
    assert run(["fabricate", "1.0.0.2.2.0.0.1", "--robot", str(plate)]) == 1
    assert "8 locations, expected 6: one for each site of plate" in capsys.readouterr().err
    assert run(["fabricate", "1.0.2.2.0.1", "--check-hub", "--robot", str(plate)]) == 1
    assert "only the paper's hub is checked" in capsys.readouterr().err
    assert run(["simulate", "--robot", "no_such.toml"]) == 1
    assert "no_such.toml" in capsys.readouterr().err
