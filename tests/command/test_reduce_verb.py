"""The verb reduce on a small leg of one's own: a hollow box with a sheet under it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from few_snapshots import FEW_SNAPSHOTS

from pneumorph.cli import run
from pneumorph.geometry.mesh import Mesh
from pneumorph.reduction.reduced_part import ReducedPart


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


def test_greedy_search_adds_a_random_robot(
    mesh_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    search = (
        "--hub rigid --greedy.round-limit 1 --greedy.additions-per-round 1 --greedy.tolerance 1e-6 "
        "--candidates.training-count 2 --candidates.heldout-count 1 --candidates.duration-s 1 "
        "--candidates.state-count 2 --materials.silicone.young-modulus-kPa 20000"
    )
    command = f"reduce --mesh {mesh_file} {FEW_SNAPSHOTS} {search} --out {tmp_path} --json"
    assert run(command.split()) == 0
    summary = json.loads(capsys.readouterr().out)
    assert not summary["greedy_converged"]
    first, last = summary["greedy_rounds"]
    assert len(first["chosen"]) == 1
    assert last["chosen"] == []
    assert last["snapshot_count"] == summary["snapshot_count"] > first["snapshot_count"]
    written = [path.name for path in (tmp_path / "greedy").glob("greedy_*.npz")]
    assert len(written) == 1
    part = ReducedPart.load(summary["part"])
    assert part.metadata["snapshots"]["sources"][-1] == f"greedy {first['chosen'][0]}"
