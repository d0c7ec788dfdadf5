"""Which phase of the expert's gait, and which pair, is the best over worlds where some walks
fail."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.run_folders import write_run

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.study import certificate
from pneumorph.study.analysis import Walker
from pneumorph.study.certificate import best_on_average, certify_once, means_over_worlds
from pneumorph.study.certified_candidates import Candidates, CertificateSettings
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.robustness import WalksInWorlds
from pneumorph.study.training_options import TrainingOptions


def test_a_phase_that_fails_is_not_the_best_where_all_go_backward() -> None:
    """Once a failed walk counted as 0 cm: more than what came to its end."""
    failing = np.array([[np.nan, -5.0, np.nan], [np.nan, -5.0, -6.0]])
    assert best_on_average(failing) == 1
    assert best_on_average(np.array([[1.0, 2.0], [1.0, 2.0]])) == 1
    # A walk that failed counts for nothing, which is less than what goes forward.
    assert best_on_average(np.array([[3.0, np.nan], [3.0, 4.0]])) == 0


def test_one_that_failed_everywhere_is_behind_all_others() -> None:
    """Also where one alone survived, and came after it."""
    lost = np.array([[np.nan, -0.5]] * 4)
    assert best_on_average(lost) == 1
    assert best_on_average(lost[:, ::-1]) == 0
    assert best_on_average(np.full((4, 2), np.nan)) == 0
    part = np.array([[-0.5, 2.0], [np.nan, np.nan]])
    assert means_over_worlds(part).tolist() == [-0.5, 1.0]


def test_a_certificate_counts_failed_walks_as_a_training_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pair that failed in all worlds is not the best because the other goes backward, and what
    the other is promised is no better for the world in which it failed."""
    robot = RobotOptions.of("published", threads=1)
    designs = (BASELINE_DESIGN, BASELINE_DESIGN)
    run = write_run(tmp_path / "run", "coopt", TrainingOptions(robot=robot), designs)
    drawn = Randomisation(friction="0.9")
    settings = CertificateSettings(world_count=4, tuning_world_count=4, randomisation=drawn)
    candidates = Candidates.of_run(FinishedRun.read(run), settings)
    one = candidates.pairs[0]
    expert = Walker("B", one.design, one.gait, 15)

    def walked(_: Any, walkers: Any, worlds: Any, *__: Any) -> WalksInWorlds:
        achieved = np.full((len(worlds), len(walkers)), -0.5)
        if len(walkers) == 2:
            achieved[:, 0] = achieved[0, 1] = np.nan
        return WalksInWorlds(achieved, np.ones_like(achieved), np.zeros_like(achieved))

    tuned_in: list[World] = []

    def tuned(_: Any, __: Any, worlds: Sequence[World], *___: Any) -> tuple[Walker, float]:
        tuned_in.extend(worlds)
        return expert, 0.0

    monkeypatch.setattr(certificate, "_tuned_expert", tuned)
    monkeypatch.setattr(certificate, "_walked", walked)
    monkeypatch.setattr(certificate, "record_shown_worlds", lambda *_: None)
    folder, spec = RunFolder(tmp_path / "out", "certify"), robot.spec()
    assert not candidates.ranked_there
    assert certify_once(candidates, settings, spec, folder).best == "L2"
    there = replace(candidates, ranked_there=True)
    lost, other = certify_once(there, settings, spec, folder).pairs
    assert (lost.promised, lost.optimism) == (0.0, 0.0)
    assert (other.promised, other.optimism) == (-0.5, 0.0)
    assert other.band.mean == -0.5
    assert [world.friction for world in tuned_in] == [0.9] * 8
    # What was measured since narrows the worlds, also those that the expert is tuned in.
    wide = Randomisation(friction="0.4")
    narrowed = replace(there, drawn=wide, seen=(wide.draw(np.random.default_rng(0)),) * 4)
    tuned_in.clear()
    assert certify_once(narrowed, settings, spec, folder).expert.tuned_as_drawn
    assert [world.friction for world in tuned_in] == [0.9] * 4
