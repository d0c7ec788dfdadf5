"""What an earlier call left in a folder is not shown as the next one's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.result_example import example

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.report.analysis_figures import draw_analysis
from pneumorph.report.hardware_sections import calibration_sections
from pneumorph.report.trial_figures import save_calibration_figures
from pneumorph.study import comparison
from pneumorph.study.analysis import Analysis, AnalysisSettings
from pneumorph.study.comparison import ComparisonSettings, compare
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.fitted_calibration import FittedCalibration
from pneumorph.study.recorded_trajectories import recorded_trajectories


class _WalksError(Exception):
    """Stands for the walks of a comparison, which are not looked at here."""


def _made(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).write_bytes(b"earlier")


def _left(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


def test_twelve_pairs_are_in_order_and_walks_of_a_transfer_are_no_models(
    make_trajectory, tmp_path: Path
) -> None:
    """Whatever a transfer calls its robots."""
    walk = make_trajectory()
    for label in ("B", *(f"L{rank}" for rank in range(12, 0, -1))):
        walk.save(tmp_path / f"trajectory_{label}.npz")
    for label in ("full", "reduced", "B"):
        walk.save(tmp_path / f"simulated_{label}.npz")
    np.savez(tmp_path / "phase_sweep.npz", a=1)
    (robots,) = recorded_trajectories(tmp_path).values()
    assert list(robots) == ["B", *(f"L{rank}" for rank in range(1, 13))]


def test_figures_of_an_analysis_go_where_no_robot_walked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _made(tmp_path, "steps.png", "cycle_B.png", "cycle_L12.png", "own.png", "cycle_own.png")
    fallen = replace(example(Analysis).robots[0], label="L1", status="diverged")
    found = replace(example(Analysis), robots=(fallen,))
    walker = SimpleNamespace(label="L1")
    monkeypatch.setattr("pneumorph.report.analysis_figures.walkers", lambda *_: [walker])
    nothing: Any = None
    draw_analysis(found, AnalysisSettings(), nothing, nothing, RunFolder(tmp_path, "analyse"))
    assert _left(tmp_path) == ["cycle_own.png", "own.png"]


def test_a_comparison_begins_without_earlier_reduced_walks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorded = ("baseline", "heldout_03", "periodic_00", "floating_two_leg")
    _made(tmp_path, "own_reduced.npz", *(f"{name}_reduced.npz" for name in recorded))

    def walk(*_: object) -> None:
        raise _WalksError

    monkeypatch.setattr(comparison, "FullOrderStore", walk)
    with pytest.raises(_WalksError):
        compare(ComparisonSettings(), RobotOptions().spec(), RunFolder(tmp_path, "compare"))
    assert _left(tmp_path) == ["own_reduced.npz"]


def test_figures_of_earlier_fits_go_and_the_calibration_stays(tmp_path: Path) -> None:
    """It may be what this fit began with."""
    pictures = ("calibration.png", "calibration.pdf", "air_fit.png", "path_fit.pdf")
    _made(tmp_path, "calibration.json", "pairs.csv", *pictures)
    found = example(FittedCalibration)
    study: Any = SimpleNamespace(found=found, pairs=None, path=None, filled=None)
    save_calibration_figures(study, tmp_path)
    assert _left(tmp_path) == ["calibration.json", "pairs.csv"]


@pytest.mark.parametrize("fit", ["pressure", "air", "trajectories"])
def test_a_calibrations_page_shows_the_pictures_of_its_own_fits(fit: str, tmp_path: Path) -> None:
    captions = {"pressure": "of equal bend", "air": "fitted valves", "trajectories": "path, before"}
    _made(tmp_path, "calibration.png", "air_fit.png", "path_fit.png")
    found = replace(example(FittedCalibration), fit={fit: {"r_squared": 0.9}})
    nothing: Any = None
    (section,) = calibration_sections(found, FinishedRun(tmp_path, {}, {}), nothing)
    assert section.body.count("<img") == 1
    assert captions[fit] in section.body
