"""The robust experiment, from a short training to its summary and figures."""

from __future__ import annotations

import importlib
import json
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.catalogue.leg_kinds import paper_leg_mesh
from pneumorph.cli import run
from pneumorph.robot.scaled_part import scaled_part
from pneumorph.study.certified_walks import KeptWalk

HERE = Path(__file__).parent.parent.parent / "reproduce" / "robust"
_SHORT = (
    "--restarts 2 "
    "--total-timesteps 40 --environment-count 4 --task.action-count 5 --task.action-step-count 20 "
    "--learning-start-timestep 12 --updates 1 --sac.batch-size 8 --sac.hidden-sizes 8 8 "
    "--schedule.decay-start-timestep 12 --schedule.decay-end-timestep 36 "
    "--evaluated-design-count 4 --kept-pair-count 2 --finetuning.timesteps 20 "
    "--finetuning.finalist-count 2 --baseline.phase-step-deg 90 --baseline.gait.duration-s 4 "
    "--baseline.record-step-count 10 --randomize --randomisation.mass-factor U(0.8,1.2) "
    "--randomisation.floor-slope-deg N(0,2) --randomisation.modulus-factor 1 "
    "--objective.kind mean_minus_deviations --objective.worlds-per-design 4 "
    "--objective.evaluation-worlds 4 --certified-world-count 0"
)


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Path:
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    return part.save(tmp_path_factory.mktemp("leg") / "leg.npz")


@pytest.fixture(scope="module")
def learned(leg: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("coopt") / "run"
    assert run(f"coopt --preset fast --part {leg} --out {folder} {_SHORT}".split()) == 0
    return folder


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch):
    """Imports modules of the experiment, which others of the same names are not taken for."""
    names = [path.stem for path in HERE.glob("*.py")]
    for name in names:
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(str(HERE))
    yield importlib.import_module
    for name in names:
        sys.modules.pop(name, None)


def test_all_steps_end_in_one_summary(
    script, learned: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of few worlds; what was made is not made again, and what was not made is null."""
    stiffer, mesh = tmp_path / "other.npz", paper_leg_mesh()
    part = scaled_part(synthetic_reduced_part(mode_count=5, cells=(4, 4, 4)), 1.05, 1.0)
    replace(part, metadata={**part.metadata, "mesh_digest": mesh.digest()}).save(stiffer)
    mesh.save(tmp_path / "mesh.npz")  # beside it, as other_leg.py writes it
    robust: ModuleType = script("run")

    def made(*steps: str, work: str = "work") -> dict:
        robust.main(learned, (), stiffer, tmp_path / "out", tmp_path / work, steps, hidden_count=3)
        return json.loads((tmp_path / "out" / "summary.json").read_text())

    found = made("damping", "hidden", "hidden_own", "repeats")
    assert found["seeds"] is found["rivals"] is found["bench"] is None
    assert found["world_count"] == 200
    assert found["tenth_percentile_cm"] <= found["median_cm"]
    far = np.array(found["hidden"]["distances_cm"])
    within = (far >= found["tenth_percentile_cm"]) & (far <= found["ninetieth_percentile_cm"])
    assert found["band_coverage"] == pytest.approx(within.mean())
    own = np.array(found["hidden_own"]["distances_cm"])  # of another leg in the same worlds
    assert own.shape == far.shape
    assert not np.any(own == far)
    usual = found["damping"]["loss_factor_times_1"]["median_cm"]
    assert usual == pytest.approx(found["median_cm"])
    changes = [f"{name}_change_cm" for name in ("median", "ninetieth_percentile", "largest")]
    repeats = [found["repeats"][name] for name in changes]
    # Robots that hardly move do nothing chaotic; another world is another walk all the same.
    assert 0.0 < repeats[0] <= repeats[1] <= repeats[2] < 0.3
    assert found["repeats"]["chaotic_share"] == 0.0
    again = made("seeds")
    assert again["hidden"] == found["hidden"]
    assert again["full_order_cm"] == []
    asked = []

    def full_order_walks(_: object, walks: list, folder: object) -> list[KeptWalk]:
        asked.extend(walks)
        return [KeptWalk(10.0 * len(asked), "completed", 1.0, "states.npz")]

    monkeypatch.setattr(robust, "full_order_walks", full_order_walks)
    walked = made("walks")
    assert walked["full_order_cm"] == [10.0, 20.0, 30.0]
    of_best, of_other = asked[:3], asked[3:]
    assert {str(walker.design) for walker, _ in of_best} == {walked["best_design"]}
    assert of_best[0][1] is None  # the world as it stands, then the two worst
    assert [world for _, world in of_other] == [None]  # of two pairs that were kept
    assert [walk["full_cm"] for walk in walked["walks"]] == [10.0, 20.0, 30.0, 40.0]
    for walk in walked["walks"]:
        assert walk["near_low_cm"] < walk["near_high_cm"]
        assert walk["near_low_cm"] == pytest.approx(walk["reduced_cm"], abs=0.3)
    assert len({walk["pair"] for walk in walked["walks"][2:]}) == 2
    certificate = json.loads((tmp_path / "out" / "certificate.json").read_text())
    place = int(certificate["best"].removeprefix("L"))
    far = sorted(row[place] for row in certificate["distances_cm"])
    assert walked["reduced_cm"][1:] == pytest.approx(far[:2])
    (seed,) = again["seeds"]
    assert seed["band"]["median_cm"] == pytest.approx(usual)
    assert seed["share_beyond_expert"] == found["share_beyond_expert"]
    # Where the work is lost, what the summary of this leg has is taken.
    elsewhere = made("walks", work="elsewhere")
    assert elsewhere == walked
    assert len(asked) == 4
    # Of another leg nothing is, but for the walks of finite elements, beside its own distances.
    softer = scaled_part(synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)), 0.97, 1.0)
    robust.main(
        learned, (), stiffer, tmp_path / "out", tmp_path / "work", (), 3,
        part=softer.save(tmp_path / "softer.npz"),
    )  # fmt: skip
    other = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert other["leg_digest"] != walked["leg_digest"]
    assert other["hidden"] is other["damping"] is None
    assert other["best_design"] == walked["best_design"]
    assert other["full_order_cm"] == [10.0, 20.0, 30.0]
    assert other["reduced_cm"] != walked["reduced_cm"]
    assert len(asked) == 4


def test_the_tests_that_a_certificate_names_narrow_its_band(
    script, learned: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench, worlds = script("bench_tests"), script("hidden_worlds")
    source = bench.FinishedRun.read(learned)
    settings = bench.CertificateSettings(randomisation=source.worlds, world_count=40)
    monkeypatch.setattr(bench, "CertificateSettings", lambda **_: settings)
    certificate = bench.certify(source, settings)
    rig = worlds.hidden_rig(source.worlds, 7)
    found = bench.narrowed(source, certificate, source.robot, rig, 1.5, tmp_path)
    assert (
        found.measured.keys() == found.true.keys() <= {"friction", "mass_factor", "floor_slope_deg"}
    )
    assert found.measured
    for name, (value, spread) in found.measured.items():
        assert abs(value - found.true[name]) < 4.0 * spread
    before = certificate.pairs[int(certificate.best.removeprefix("L")) - 1].band
    assert found.after.high - found.after.low < before.high - before.low
    assert found.rig_cm == 1.5


def test_the_kept_summary_says_all_that_was_made() -> None:
    """Of the best pair the nominal and its two worst worlds, the seeds, and the hidden worlds."""
    kept = json.loads((HERE / "summary.json").read_text())
    assert len(kept["full_order_cm"]) == len(kept["reduced_cm"]) == 3
    assert len(kept["seeds"]) == 3
    assert 0.0 < kept["band_coverage"] < 1.0
    of_best = [walk for walk in kept["walks"] if walk["pair"] == "L1"]
    assert [walk["full_cm"] for walk in of_best] == kept["full_order_cm"]
    for walk in kept["walks"]:
        assert walk["error_cm"] == pytest.approx(walk["reduced_cm"] - walk["full_cm"])
