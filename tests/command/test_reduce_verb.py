"""The verb reduce on a small leg of one's own: a hollow box with a sheet under it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.few_snapshots import FEW_SNAPSHOTS

from pneumorph.cli import run
from pneumorph.geometry.mesh import Mesh
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.snapshot_files import SnapshotFiles
from pneumorph.reduction.snapshots import Snapshots


def test_a_mesh_of_ones_own_becomes_a_reduced_part(
    mesh_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = f"reduce --mesh {mesh_file} {FEW_SNAPSHOTS} --out {tmp_path} --json".split()
    assert run(command) == 0
    summary = json.loads(capsys.readouterr().out)
    part = ReducedPart.load(summary["part"])
    assert part.mode_count == summary["mode_count"] <= 4
    part.check_mesh(Mesh.load(mesh_file))
    assert summary["leg"]["errors"]["bend_error_percent"] == summary["bend_error_percent"]
    assert summary["snapshot_processor_s"] > 0.0
    assert summary["snapshot_files_without_time"] == 0
    # Once more: the snapshots are there already, and so is what they cost.
    before = (tmp_path / "snapshots" / "bend.npz").stat().st_mtime_ns
    assert run(command) == 0
    assert (tmp_path / "snapshots" / "bend.npz").stat().st_mtime_ns == before
    again = json.loads(capsys.readouterr().out)
    assert again["snapshot_wall_s"] == summary["snapshot_wall_s"]


def test_given_gaits_are_walked_once_and_learned_from(
    mesh_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gait = tmp_path / "gait.csv"
    gait.write_text(
        "# design: 1.0.0.1.0.1.0.0\ntime_s,regulator_1_kPa\n0.0,0.0\n0.1,10.0\n1.0,10.0\n"
    )
    out = tmp_path / "leg"
    command = (
        f"reduce --mesh {mesh_file} {FEW_SNAPSHOTS} --hub rigid --out {out} --json "
        "--materials.silicone.young-modulus-kPa 20000 "
        f"--walked.gaits {gait} {gait} --walked.duration-s 0.4 --walked.record-every 4"
    ).split()
    assert run(command) == 0
    summary = json.loads(capsys.readouterr().out)
    part = ReducedPart.load(summary["part"])
    assert part.metadata["snapshots"]["sources"][-1] == f"gait 1.0.0.1.0.1.0.0 {gait}"
    (walk,) = (out / "snapshots").glob("gait_*.npz")
    # 40 steps, every fourth of them, of three legs; and what the other tests have.
    assert SnapshotFiles([walk]).source.shape == (30,)
    assert np.ptp(SnapshotFiles([walk]).pressure_kPa) > 10.0  # it did what the gait says
    # Once more with another gait beside it: the first stays as it is.
    before = walk.stat().st_mtime_ns
    other = tmp_path / "other.csv"
    other.write_text(gait.read_text().replace("10.0", "12.0"))
    assert run([*command, "--walked.gaits", str(gait), str(other)]) == 0
    assert walk.stat().st_mtime_ns == before
    assert len(list((out / "snapshots").glob("gait_*.npz"))) == 2
    assert json.loads(capsys.readouterr().out)["snapshot_count"] == summary["snapshot_count"] + 30


def test_a_missing_gait_is_told_before_anything_is_computed(
    mesh_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "leg"
    command = f"reduce --mesh {mesh_file} {FEW_SNAPSHOTS} --out {out} --walked.gaits none.csv"
    assert run(command.split()) != 0
    assert "none.csv" in capsys.readouterr().err
    assert not out.exists()
    nameless = tmp_path / "nameless.csv"
    nameless.write_text("time_s,regulator_1_kPa\n0.0,0.0\n1.0,0.0\n")
    command = f"reduce --mesh {mesh_file} {FEW_SNAPSHOTS} --out {out} --walked.gaits"
    assert run([*command.split(), str(nameless)]) != 0
    assert "nameless.csv names no design" in capsys.readouterr().err
    assert run([*command.split(), str(tmp_path)]) != 0
    assert "is a folder, expected a gait file" in capsys.readouterr().err


def test_a_walk_that_diverges_is_told_and_left_out(
    mesh_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gait = tmp_path / "gait.csv"
    gait.write_text("# design: 1.0.0.1.0.1.0.0\ntime_s,regulator_1_kPa\n0.0,90.0\n1.0,90.0\n")
    command = (
        f"reduce --mesh {mesh_file} {FEW_SNAPSHOTS} --hub rigid --out {tmp_path / 'leg'} --json "
        "--materials.silicone.young-modulus-kPa 20 --materials.sheet.young-modulus-kPa 20 "
        "--snapshots.static.bend-pressure-kPa 0.01 --snapshots.static.load-count 0 "
        f"--walked.gaits {gait} --walked.duration-s 1.0"
    )
    assert run(command.split()) == 0
    printed = capsys.readouterr()
    assert "diverged and is left out" in printed.err
    assert json.loads(printed.out)["walked_gait_count"] == 0


def test_robots_that_walk_for_snapshots_and_do_not_come_to_the_end_are_left_out(
    mesh_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Their legs were flung anywhere before they stopped."""
    command = (
        f"reduce --mesh {mesh_file} {FEW_SNAPSHOTS} --hub rigid --out {tmp_path / 'leg'} --json "
        "--materials.silicone.young-modulus-kPa 20000 --snapshots.walk.leg-counts 1 2 "
        "--snapshots.walk.corner-limit 1 --snapshots.walk.hold-s 0.04 "
        "--snapshots.walk.amplitude-kPa 5 --snapshots.walk.settling-steps 2"
    ).split()
    assert run(command) == 0
    before = json.loads(capsys.readouterr().out)
    assert not any("walked" in note for note in before["notes"])
    file = tmp_path / "leg/snapshots/walk_1.npz"
    walked = Snapshots.load(file)
    walked.metadata["details"]["status"] = "diverged"
    walked.save(file)
    assert run(command) == 0
    printed = capsys.readouterr()
    summary = json.loads(printed.out)
    (note,) = [note for note in summary["notes"] if "walked for snapshots" in note]
    (name,) = walked.sources
    assert note.endswith(f"and are left out: {name} (diverged)")
    assert note in printed.err
    assert summary["snapshot_count"] == before["snapshot_count"] - len(walked)
    assert name not in ReducedPart.load(summary["part"]).metadata["snapshots"]["sources"]
    # Where none came to its end there is no leg for robots that walk.
    assert run([*command, "--snapshots.walk.leg-counts", "1"]) == 0
    capsys.readouterr()
    file = tmp_path / "leg/snapshots/walk_0.npz"
    walked = Snapshots.load(file)
    walked.metadata["details"]["status"] = "diverged"
    walked.save(file)
    assert run([*command, "--snapshots.walk.leg-counts", "1"]) != 0
    assert "none of the robots that walk for snapshots came to its end" in capsys.readouterr().err


def test_bends_beyond_the_usual_pressure_are_reported_and_no_balloon_is_told(
    mesh_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = (
        f"reduce --mesh {mesh_file} {FEW_SNAPSHOTS} --hub rigid --out {tmp_path} --json "
        "--materials.silicone.young-modulus-kPa 20000 --materials.sheet.young-modulus-kPa 40000 "
        "--snapshots.static.bend-pressure-kPa 600 --snapshots.static.load-count 0"
    )
    assert run(command.split()) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["bend"]["pressure_kPa"] == [150.0, 300.0, 450.0, 600.0]
    assert ReducedPart.load(summary["part"]).seen_pressure_kPa == 600.0
    assert not any("free bends" in note for note in summary["notes"])
