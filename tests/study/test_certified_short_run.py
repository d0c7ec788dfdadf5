"""What is said of a short training: no certificate of something else lies beside the one that is
made now, and tests that change nothing are told apart."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.short_training import SHORT_FINETUNING
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.base.artefact import write_json
from pneumorph.base.result import finite, result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.cli import run
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study import certified_rounds
from pneumorph.study.certified_candidates import CertificateSettings, RoundSettings
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.certified_rounds import CERTIFICATE_FILE, certify
from pneumorph.study.finished_run import FinishedRun

PLAIN = CertificateSettings(
    pair_count=1, world_count=4, tuning_world_count=1, randomisation=Randomisation()
)
FULL = replace(PLAIN, full=True, rounds=RoundSettings(limit=0))


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> FinishedRun:
    folder = tmp_path_factory.mktemp("learned")
    leg = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)).save(folder / "leg.npz")
    asked = f"coopt --part {leg} --out {folder / 'run'} {SHORT_FINETUNING}"
    assert run([*asked.split(), "--certified-world-count", "0"]) == 0
    return FinishedRun.read(folder / "run")


@pytest.fixture
def stopped(learned: FinishedRun, tmp_path: Path) -> Path:
    """The certificate of a call with finite elements that was stopped in its second round."""
    found = certify(learned, PLAIN, folder=RunFolder(tmp_path / "plain", "certify"))
    first = certified_rounds._round_of(found, 0.0)
    content = result_to_dict(replace(found, rounds=(first,)))
    return write_json(tmp_path / "out" / CERTIFICATE_FILE, finite(content))


def test_none_is_left_beside_one_without_finite_elements(
    learned: FinishedRun, stopped: Path
) -> None:
    found = certify(learned, PLAIN, folder=RunFolder(stopped.parent, "certify"))
    assert isinstance(found, Certificate)
    assert not stopped.exists()


def test_none_is_left_beside_a_training_that_ends_without(
    learned: FinishedRun, tmp_path: Path
) -> None:
    """What was walked as finite elements stays."""
    again = tmp_path / "run"
    shutil.copytree(learned.folder, again)
    folder = RunFolder(again / "certificate", "certify")
    for name in (CERTIFICATE_FILE, "median_world_trajectory.npz", "full_order/a.json"):
        (folder / name).write_text("{}")
    leg = learned.folder.parent / "leg.npz"
    asked = f"coopt --part {leg} --out {again} {SHORT_FINETUNING} --certified-world-count 0"
    assert run([*asked.split(), "--resume"]) == 0
    left = [file.name for file in folder.path.rglob("*") if file.is_file()]
    assert left == ["a.json"]


def test_one_with_finite_elements_stays_beside_a_run_that_learned_nothing_more(
    learned: FinishedRun, stopped: Path, tmp_path: Path
) -> None:
    """It took hours, and is of the run's pairs until there are others."""
    again = tmp_path / "run"
    shutil.copytree(learned.folder, again)
    folder = RunFolder(again / "certificate", "certify")
    certificate = folder / CERTIFICATE_FILE
    shutil.copy(stopped, certificate)
    leg = learned.folder.parent / "leg.npz"
    asked = f"coopt --part {leg} --out {again} {SHORT_FINETUNING} --certified-world-count 0"
    assert run([*asked.split(), "--resume"]) == 0
    assert certificate.read_bytes() == stopped.read_bytes()
    summary = again / "training" / "summary.json"
    told = json.loads(summary.read_text())
    told["pairs"][0]["distance_cm"] += 1.0  # of another training that had ended there
    summary.write_text(json.dumps(told))
    assert run([*asked.split(), "--resume"]) == 0
    assert not certificate.exists()


def test_a_test_of_valves_that_the_robot_has_not_is_told(
    learned: FinishedRun, tmp_path: Path
) -> None:
    """Worlds agree with the other test alone."""
    measured = ("filling_factor", 1.0, 0.05), ("mass_factor", 1.0, 0.01)
    drawn = Randomisation(filling_factor="LogU(0.5, 2)", measured=measured)
    settings = replace(PLAIN, randomisation=drawn)
    notes = certify(learned, settings, folder=RunFolder(tmp_path, "certify")).notes
    assert "the test of filling_factor changes nothing: the robot's air has no valves" in notes
    (agreed,) = [note for note in notes if note.startswith("bands agree with the tests of")]
    assert agreed.startswith("bands agree with the tests of mass_factor;")
