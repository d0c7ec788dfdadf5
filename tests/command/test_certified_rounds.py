"""A leg that is reduced again where it parts from its finite elements, with gaits learned on it."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.few_snapshots import FEW_SNAPSHOTS

from pneumorph.base.executor import ExecutorSettings
from pneumorph.base.run_folder import RunFolder
from pneumorph.cli import run
from pneumorph.gait.gait_file import read_gait
from pneumorph.geometry.mesh import Mesh
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.finetuning import Finetuned
from pneumorph.physics.calibration import Calibration
from pneumorph.reduction.collect import SnapshotSettings
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.snapshot_files import SnapshotFiles
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study import certified_rounds, certified_walks, learned_again
from pneumorph.study.certified_candidates import CertificateSettings, RoundSettings
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.certified_rounds import certify
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.learned_again import Trained
from pneumorph.study.reduce_settings import ReduceSettings

_SHORT = (
    "--restarts 2 --pooled-restarts 0 "
    "--total-timesteps 16 --environment-count 4 --task.action-count 4 --task.action-step-count 10 "
    "--learning-start-timestep 12 --updates 1 --sac.batch-size 8 --sac.hidden-sizes 8 8 "
    "--schedule.decay-start-timestep 12 --schedule.decay-end-timestep 16 "
    "--evaluated-design-count 4 --kept-pair-count 2 --checkpoint-interval-timesteps 20 "
    "--finetuning.timesteps 16 --finetuning.finalist-count 2 --baseline.phase-step-deg 180 "
    "--baseline.gait.duration-s 0.4 --baseline.gait.period-s 0.4 --baseline.record-step-count 10 "
    "--space.maximum-legs 4 --full.hub rigid --executor.process-count 1"
)
MODULUS_FACTOR = 1.2
SETTINGS = CertificateSettings(
    world_count=4,
    tuning_world_count=1,
    worst_world_count=1,
    cycle_s=0.4,
    full=True,
    rounds=RoundSettings(limit=1),
    randomisation=Randomisation(),
)
REDUCTION = ReduceSettings(
    SnapshotSettings(
        static=StaticSnapshotSettings(
            bend_count=4,
            bend_pressure_kPa=40.0,
            load_count=4,
            load_pressure_kPa=20.0,
            load_limit_mN=50.0,
        ),
        walk=WalkSnapshotSettings(leg_counts=()),
        executor=ExecutorSettings(process_count=1),
    ),
    reduction=ReductionSettings(mode_limit=8),
)


@pytest.fixture(scope="module")
def learned(mesh_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose leg of four modes stands for a small mesh, of a measured modulus."""
    folder = tmp_path_factory.mktemp("rounds")
    stiff = "--hub rigid --materials.silicone.young-modulus-kPa 6000"
    assert (
        run(f"reduce --mesh {mesh_file} {FEW_SNAPSHOTS} {stiff} --out {folder / 'leg'}".split())
        == 0
    )
    Calibration(modulus_factor=MODULUS_FACTOR).save(folder / "calibration.json")
    leg = f"--part {folder / 'leg/leg.npz'} --full.mesh {mesh_file}"
    leg += f" --calibration {folder / 'calibration.json'}"
    assert run(f"coopt --preset fast {leg} --out {folder / 'run'} {_SHORT}".split()) == 0
    return folder / "run"


@pytest.fixture(scope="module")
def certified(learned: Path) -> Certificate:
    """Of models that are to agree better than any two of so few modes do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(certified_walks, "AGREED", {"cm": 1e-9})
        patch.setattr(certified_walks, "AGREED_SHARE", 0.0)
        return certify(learned, SETTINGS, reduction=REDUCTION)


def test_a_leg_that_parts_is_reduced_again_from_its_walks(
    learned: Path, certified: Certificate
) -> None:
    """The new leg can be where the robots were: of these states its modes leave less than a
    hundredth of what the old ones leave."""
    first, second = certified.rounds
    assert [each.agrees for each in certified.rounds] == [False, False]
    assert (first.leg.mode_count, second.leg.mode_count) == (4, 8)
    assert (first.made_s, second.made_s > 0.0) == (0.0, True)
    assert [len(pair.full_order) for pair in first.pairs] in ([2, 1], [1, 2])
    folder = learned / "certificate"
    legs = [ReducedPart.load(each.leg.part) for each in certified.rounds]
    walked = [f"walk {pair.design}" for pair in first.pairs for _ in pair.full_order]
    sources = legs[1].metadata["snapshots"]["sources"]
    assert sources == ["bend", *(s for s in sources if s.startswith("load")), *walked]
    assert legs[1].metadata["materials"] == legs[0].metadata["materials"]
    left = []
    for leg in legs:
        walks = [walk for pair in first.pairs for walk in pair.full_order]
        files = SnapshotFiles([folder / str(walk.states) for walk in walks])
        states = files.states(np.arange(len(files)))
        modes = leg.modes.reshape(-1, leg.mode_count)
        flat = states.reshape(len(states), -1)
        residual = flat - (modes @ np.linalg.lstsq(modes, flat.T, rcond=None)[0]).T
        left.append(np.linalg.norm(residual) ** 2)
    assert left[1] < 0.01 * left[0]


def test_a_rounds_leg_is_as_stiff_where_it_is_named_beside_the_runs_calibration(
    learned: Path, certified: Certificate
) -> None:
    """Its file is of the leg under it, which counts once."""
    file = Path(certified.rounds[-1].leg.part)
    inside = ReducedPart.load(file)
    asked = replace(FinishedRun.read(learned).robot, part=file)
    read = asked.spec().module
    assert read.reduced.tetrahedron_material == inside.tetrahedron_material
    assert read.modulus_factor == MODULUS_FACTOR
    rest = np.zeros(inside.mode_count)
    np.testing.assert_allclose(
        read.reduced.stiffness(rest), inside.stiffness(rest), rtol=1e-9, atol=1e-6
    )
    read.check_reduction()


def test_gaits_are_learned_again_on_the_new_leg(learned: Path, certified: Certificate) -> None:
    first, second = certified.rounds
    assert {pair.design for pair in second.pairs} == {pair.design for pair in first.pairs}
    assert all("round_1/learned/gaits" in pair.gait for pair in second.pairs)
    # What a certificate says is of its last round.
    assert certified.leg == second.leg
    assert [pair.gait for pair in certified.pairs] == [pair.gait for pair in second.pairs]
    assert [pair.full_order for pair in certified.pairs] == [
        pair.full_order for pair in second.pairs
    ]
    content = json.loads((learned / "certificate" / "certificate.json").read_text())
    assert len(content["rounds"]) == 2
    assert content["median_cm"] == certified.median
    (best,) = [pair for pair in second.pairs if pair.label == certified.best]
    assert f"--part {second.leg.part} --design {best.design} --gait {best.gait}" in str(
        certified.notes[-2]
    )
    # Whether so short a fine-tuning changes a gait is chance; if it does, its walk is a new one.
    old, new = (
        {walk.states for pair in each.pairs for walk in pair.full_order} for each in (first, second)
    )
    again, most = "on walks that the leg was made from", "there were 1 new reductions at most"
    end = again if new <= old else most
    assert certified.notes[-1].startswith("the two models part still")
    assert end in certified.notes[-1]


@pytest.mark.parametrize("score_cm", [-100.0, 100.0])
def test_the_better_gait_of_a_design_is_kept(
    learned: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, score_cm: float
) -> None:
    """Fine-tuning that does worse changes no gait, one that does better changes all of them."""
    run = FinishedRun.read(learned)
    trained, pairs = Trained.of_run(run), run.pairs()
    assert trained is not None
    still = np.zeros((trained.settings.task.action_count, 3))

    def finetuned(_: object, designs: list[int], *__: object) -> Finetuned:
        found = [
            DesignGaitPair(design, still, score_cm, score_cm, "policy", 0, score_cm)
            for design in designs
        ]
        return Finetuned(found, 0, 0.0)

    monkeypatch.setattr(learned_again, "finetune", finetuned)
    folder = RunFolder(tmp_path, "finetune")
    kept = learned_again.learned_again(trained, run.robot.spec(), pairs, folder).pairs
    assert sorted(pair.design for pair in kept) == sorted(str(pair.design) for pair in pairs)
    for pair in kept:
        (before,) = [each for each in pairs if str(each.design) == pair.design]
        gait, _ = read_gait(tmp_path / str(pair.gait))
        same = np.allclose(gait.held_kPa, before.gait.held_kPa, atol=1e-3)
        assert same == (score_cm < 0.0)
        if same:  # walks as it did in its run, with the same legs in the same worlds
            assert pair.distance_cm == pytest.approx(before.distance_cm, abs=0.01)
        else:
            assert (pair.distance_cm, gait.held_kPa.max()) == (score_cm, 0.0)


def test_what_was_made_is_made_once(
    learned: Path, certified: Certificate, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("made again")

    monkeypatch.setattr(certified_walks, "AGREED", {"cm": 1e-9})
    monkeypatch.setattr(certified_walks, "AGREED_SHARE", 0.0)
    monkeypatch.setattr(certified_walks, "_walk", never)
    monkeypatch.setattr(certified_rounds, "reduce", never)
    monkeypatch.setattr(learned_again, "finetune", never)
    assert certify(learned, SETTINGS, reduction=REDUCTION).rounds == certified.rounds
    other = replace(REDUCTION, reduction=ReductionSettings(mode_limit=7))
    with pytest.raises(ValueError, match=r"round_1 holds a run of other settings \(reduction"):
        certify(learned, SETTINGS, reduction=other)
    # With half of what was spent, no second round is begun; with models that agree, none either.
    spent_s = sum(w.wall_s for pair in certified.rounds[0].pairs for w in pair.full_order)
    budget = RoundSettings(budget_s=0.5 * spent_s)
    found = certify(learned, replace(SETTINGS, rounds=budget), reduction=REDUCTION)
    assert len(found.rounds) == 1
    assert f"s of {budget.budget_s:.0f} were spent" in found.notes[-1]
    monkeypatch.setattr(certified_walks, "AGREED", {"cm": 10.0})
    found = certify(learned, SETTINGS, reduction=REDUCTION)
    assert [each.agrees for each in found.rounds] == [True]
    assert "agree, after 0 new reductions" in found.notes[-1]


def test_no_leg_is_made_again_from_the_same_walks(
    learned: Path, certified: Certificate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Gaits that stay as they were walk as they did, so a second new leg would be the first."""
    monkeypatch.setattr(certified_walks, "AGREED", {"cm": 1e-9})
    monkeypatch.setattr(certified_walks, "AGREED_SHARE", 0.0)
    monkeypatch.setattr(Trained, "of_run", lambda *_: None)
    for made in ("full_order", "snapshots"):
        shutil.copytree(learned / "certificate" / made, tmp_path / made)
    settings = replace(SETTINGS, worst_world_count=0, rounds=RoundSettings(limit=3))
    found = certify(learned, settings, folder=RunFolder(tmp_path, "certify"), reduction=REDUCTION)
    assert [each.agrees for each in found.rounds] == [False, False]
    assert "walks that the leg was made from" in found.notes[-2]
    command = str(found.notes[-3]).split()
    part, gait = (Path(command[command.index(name) + 1]) for name in ("--part", "--gait"))
    assert part.is_file()
    assert gait.is_file()
    assert "gaits stayed as they were" in found.notes[-1]


def test_the_verb_and_its_page_list_the_rounds(
    learned: Path, certified: Certificate, mesh_file: Path, tmp_path: Path
) -> None:
    asked = "--world-count 4 --tuning-world-count 1 --pair-count 1 --worst-world-count 0 --full"
    friction = "--randomisation.friction-by-surface --cycle-s 0.4 --rounds.limit 0"
    out = tmp_path / "certified"
    assert run(f"certify {learned} {asked} {friction} --out {out}".split()) == 0
    summary = json.loads((out / "summary.json").read_text())
    (only,) = summary["rounds"]
    assert [pair["label"] for pair in only["pairs"]] == ["L1"]
    assert only["pairs"][0]["full_order"][0]["full_cm"] == pytest.approx(
        certified.rounds[0].pairs[0].full_order[0].full, abs=1e-9
    )
    assert run(["report", str(out), "--figure-files", "--out", str(tmp_path / "page")]) == 0
    page = (tmp_path / "page" / "page.html").read_text()
    for words in ("As finite elements", "new reductions", "difference (cm)"):
        assert words in page
    assert Mesh.load(mesh_file).digest() == only["leg"]["mesh_digest"]


def test_a_training_ends_with_its_certificate_of_finite_elements(
    learned: Path, certified: Certificate, tmp_path: Path
) -> None:
    """Those of the same gaits in the world as it stands."""
    again = tmp_path / "run"
    shutil.copytree(learned, again, ignore=shutil.ignore_patterns("certificate"))
    asked = "--certify --rounds.limit 0 --certified-world-count 4 --resume"
    settings = json.loads((learned / "settings.json").read_text())["robot"]
    leg = f"--part {settings['part']} --full.mesh {settings['full']['mesh']}"
    leg += f" --calibration {settings['calibration']}"
    assert run(f"coopt --preset fast {leg} --out {again} {_SHORT} {asked}".split()) == 0
    found = json.loads((again / "summary.json").read_text())["certificate"]
    assert len(found["rounds"]) == 1

    def nominal(pairs) -> dict[str, float]:
        return {
            str(pair["design"]): each["full_cm"]
            for pair in pairs
            for each in pair["full_order"]
            if each["world"] is None
        }

    kept = json.loads((learned / "certificate" / "certificate.json").read_text())["rounds"][0]
    assert nominal(found["rounds"][0]["pairs"]) == pytest.approx(nominal(kept["pairs"]), abs=1e-9)
    assert (again / "certificate" / "certificate.json").is_file()
    # Its page shows the best pair's walks in a median and in a bad world, which lie there too.
    assert " in two worlds<" in (again / "report" / "page.html").read_text()
