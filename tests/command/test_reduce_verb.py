"""The verb reduce on a small leg of one's own: a hollow box with a sheet under it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from box_mesh import box_mesh

from pneumorph.cli import run
from pneumorph.geometry.mesh import Mesh
from pneumorph.reduction.reduced_part import ReducedPart

_FEW_SNAPSHOTS = (
    "--snapshots.executor.process-count 1 --snapshots.walk.leg-counts "
    "--snapshots.static.bend-count 4 --snapshots.static.bend-pressure-kPa 40 "
    "--snapshots.static.load-count 4 --snapshots.static.load-pressure-kPa 20 "
    "--snapshots.static.load-limit-mN 50 --reduction.mode-limit 4"
)


@pytest.fixture(scope="module")
def mesh_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    box = box_mesh((40.0, 12.0, 9.0), (6, 3, 3), hollow=True)
    leg = Mesh(
        box.nodes - np.array([20.0, 6.0, 0.0]),
        box.tetrahedra,
        {**box.surfaces, "paper": box.surfaces["bottom"]},
        {"attachment": box.node_sets["left"], "outer_end_face": box.node_sets["right"]},
        contact_points=np.array([[20.0, -6.0, 0.0], [20.0, 6.0, 0.0]]),
    )
    return leg.save(tmp_path_factory.mktemp("mesh") / "mesh.npz")


def test_a_mesh_of_ones_own_becomes_a_reduced_part(
    mesh_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = f"reduce --mesh {mesh_file} {_FEW_SNAPSHOTS} --out {tmp_path} --json".split()
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
        "--greedy.round-limit 1 --greedy.additions-per-round 1 --greedy.tolerance 1e-6 "
        "--candidates.training-count 2 --candidates.heldout-count 1 --candidates.duration-s 1 "
        "--candidates.state-count 2 --materials.silicone.young-modulus-kPa 20000"
    )
    command = f"reduce --mesh {mesh_file} {_FEW_SNAPSHOTS} {search} --out {tmp_path} --json"
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
