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
    # Once more: the snapshots are there already.
    before = (tmp_path / "snapshots" / "bend.npz").stat().st_mtime_ns
    assert run(command) == 0
    assert (tmp_path / "snapshots" / "bend.npz").stat().st_mtime_ns == before
