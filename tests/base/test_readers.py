"""Whatever a file holds, it is read or refused with its name; no other error ever comes of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.corruption import (
    Reader,
    any_bytes,
    damaged,
    damaged_json,
    damaged_npz,
    damaged_text,
    few,
)
from helpers.run_folders import write_run
from helpers.synthetic_part import synthetic_mesh, synthetic_reduced_part
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.base.settings import load_settings, save_settings
from pneumorph.exchange.sorotraj import read_sorotraj, write_sorotraj
from pneumorph.gait.gait_file import read_gait, write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mesh_file import read_mesh_file
from pneumorph.hardware.deployment_log import DeploymentLog, read_log
from pneumorph.hardware.marker_track import MarkerTrack, read_track, write_track
from pneumorph.hardware.measured_table import read_measured_table
from pneumorph.hardware.rig import RigSettings, load_rig
from pneumorph.physics.calibration import Calibration
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_options import TrainingOptions
from pneumorph.trajectory import Trajectory

GAIT = HeldGait.evenly(np.array([[0.0, 45.0, 90.0], [90.0, 12.5, 0.0]]))
TRACK = MarkerTrack(np.arange(4.0), np.arange(8.0).reshape(4, 2))
VTK = """# vtk DataFile Version 3.0
a tetrahedron
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 4 double
0 0 0  1 0 0  0 1 0  0 0 1
CELLS 1 5
4 0 1 2 3
CELL_TYPES 1
10
"""


def _toml(path: Path) -> None:
    path.write_text("randomize = true\n[coopt.task]\naction_count = 3\n[robot]\nthreads = 2\n")


def _log(path: Path) -> None:
    with DeploymentLog(path, 2, {"design": "1.2"}) as log:
        log.event(0.0, "begin")
        for step in range(3):
            log.command(0.1 * step, np.array([10.0, 20.0]))
            log.row(0.1 * step, np.array([10.0, 20.0]), np.array([9.0, np.nan]))


def _trajectory(path: Path) -> None:
    Trajectory(
        np.arange(3.0), np.zeros((3, 3)), np.stack([np.eye(3)] * 3), np.zeros((3, 3)),
        np.zeros((3, 2)), np.zeros((3, 2)), np.zeros(3), np.zeros((3, 2, 4, 3)),
    ).save(path)  # fmt: skip


def _run_file(name: str) -> Reader:
    """One file of a run's folder; the folder's other files are whole."""

    def read(path: Path) -> None:
        folder = write_run(
            path.parent / "run", "coopt", TrainingOptions(), baseline_best_phase_deg=60.0
        )
        (folder / name).write_bytes(path.read_bytes())
        run = FinishedRun.read(folder)
        _ = run.verb, run.robot, run.task, run.space, run.pairs(), run.best_expert, run.digest()

    def write(path: Path) -> None:
        folder = write_run(
            path.parent / "made", "coopt", TrainingOptions(), baseline_best_phase_deg=60.0
        )
        path.write_bytes((folder / name).read_bytes())

    return Reader(Path(name).name, write, read)


TEXT = [
    Reader("gait.csv", lambda path: write_gait(path, GAIT, {"design": "1.2"}), read_gait),
    Reader("gait.yaml", lambda path: write_sorotraj(path, GAIT), read_sorotraj),
    Reader("log.csv", _log, read_log),
    Reader("track.csv", lambda path: write_track(path, TRACK), read_track),
    Reader(
        "bends.csv",
        lambda path: path.write_text("pressure_psi,bend_rad\n1,0.1\n2,0.2\n"),
        lambda path: read_measured_table(path, {"pressure": "kPa", "bend": "deg"}),
    ),
    Reader("settings.toml", _toml, lambda path: load_settings(TrainingOptions, path)),
    _run_file("training/gaits/L1.csv"),
]
JSON = [
    Reader(
        "settings.json",
        lambda path: save_settings(path, TrainingOptions()),
        lambda path: load_settings(TrainingOptions, path),
    ),
    Reader("rig.json", lambda path: save_settings(path, RigSettings()), load_rig),
    Reader("calibration.json", lambda path: Calibration().save(path), Calibration.load),
    _run_file("summary.json"),
    _run_file("settings.json"),
]
NPZ = [
    Reader("mesh.npz", lambda path: synthetic_mesh((2, 2, 2)).save(path), Mesh.load),
    Reader(
        "part.npz",
        lambda path: synthetic_reduced_part(mode_count=2, cells=(4, 4, 4)).save(path),
        ReducedPart.load,
    ),
    Reader("trajectory.npz", _trajectory, Trajectory.load),
]
MESH_FILE = [
    Reader(
        "mesh.vtk",
        lambda path: path.write_text(VTK),
        lambda path: read_mesh_file(path, surfaces=(), node_sets=()),
    )
]


def _name(reader: Reader) -> str:
    return reader.name


@pytest.mark.parametrize("reader", TEXT + JSON + NPZ + MESH_FILE, ids=_name)
@few
@given(content=any_bytes())
def test_any_bytes_are_read_or_refused_by_name(reader: Reader, content: bytes) -> None:
    reader.refusal(content)


@pytest.mark.parametrize("reader", TEXT + JSON + NPZ + MESH_FILE, ids=_name)
@few
@given(data=st.data())
def test_damaged_bytes_are_read_or_refused_by_name(reader: Reader, data: st.DataObject) -> None:
    reader.refusal(data.draw(damaged(reader.whole)))


@pytest.mark.parametrize(
    ("reader", "damage"),
    [
        *((each, damaged_text) for each in TEXT + MESH_FILE),
        *((each, damaged_json) for each in JSON),
        *((each, damaged_npz) for each in NPZ),
    ],
    ids=lambda each: each.name if isinstance(each, Reader) else "",
)
@few
@given(data=st.data())
def test_files_that_lack_or_mistake_something_are_read_or_refused_by_name(
    reader: Reader, damage: object, data: st.DataObject
) -> None:
    reader.refusal(data.draw(damage(reader.whole)))  # type: ignore[operator]
