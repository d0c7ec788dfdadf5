"""What the certificate of a run says, beside walks of the same worlds one by one."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path

import numpy as np
import pytest
from helpers.run_json import run_json
from helpers.short_training import SHORT_FINETUNING

from pneumorph.base.result import result_from_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.workers import connected
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.cli import run
from pneumorph.gait.walk import walk
from pneumorph.learn.evaluation import EVALUATION_SEED
from pneumorph.physics.calibration import Calibration
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.randomised_simulator import simulator_in_worlds, worlds_of_round
from pneumorph.study import certificate
from pneumorph.study.certified_candidates import CertificateSettings, RoundSettings, unseen_worlds
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.certified_rounds import certify
from pneumorph.study.certified_walks import KeptWalk
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.robustness import KEPT_WALKS
from pneumorph.study.shown_worlds import SHOWN_WORLDS
from pneumorph.trajectory import Trajectory

_SHORT = (
    f"{SHORT_FINETUNING} --randomize --randomisation.damping-factor U(0.5,2) "
    "--objective.kind worst_share --objective.worlds-per-design 4 --objective.evaluation-worlds 4 "
    "--certified-world-count 6"
)
WORLDS = Randomisation(damping_factor="U(0.5,2)")


@pytest.fixture(scope="module")
def learned(leg: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose designs were ranked over worlds."""
    folder = tmp_path_factory.mktemp("coopt") / "run"
    assert run(f"coopt --part {leg} --out {folder} {_SHORT}".split()) == 0
    return folder


@pytest.fixture(scope="module")
def certified(learned: Path) -> Path:
    folder = learned.parent / "certified"
    asked = f"certify {learned} --world-count 6 --tuning-world-count 2 --cycle-s 0.4"
    assert run([*asked.split(), "--out", str(folder)]) == 0
    return folder


@pytest.mark.parametrize("verb", ["certify", "evaluate"])
def test_a_supply_below_the_gaits_is_refused(
    learned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    low = "--physics.air.law orifice --physics.air.supply-kPa 1"
    assert run(f"{verb} {learned} {low} --out {tmp_path / verb}".split()) != 0
    assert "from a supply of 1 kPa" in capsys.readouterr().err


def test_a_certificate_is_of_the_runs_worlds_unseen(learned: Path, certified: Path) -> None:
    content = json.loads((certified / "summary.json").read_text())
    found, source = result_from_dict(Certificate, content), FinishedRun.read(learned)
    assert not any((folder / KEPT_WALKS).exists() for folder in (learned, certified))
    worlds = unseen_worlds(WORLDS, 6, 0)
    seen = worlds_of_round(WORLDS, 0, EVALUATION_SEED, 4)
    assert found.distributions["damping_factor"] == "U(0.5,2)"
    assert found.numbers["friction"] == tuple(world.friction for world in worlds)
    assert set(found.numbers["friction"]).isdisjoint(world.friction for world in seen)
    assert [pair.label for pair in found.pairs] == ["L1", "L2"]
    spec, pairs, distances_cm = source.robot.spec(), source.pairs(), np.array(found.achieved)

    def distance(number: int, world) -> float:
        simulator = simulator_in_worlds(
            [spec.assembly(pairs[number].design)], [world], spec.physics, spec.stepper, 1
        )
        walked = walk(
            simulator, [pairs[number].gait], duration_s=pairs[number].gait.duration_s,
            time_step_s=0.01, record_step_count=100,
        )  # fmt: skip
        return float(walked.distance_cm[0])

    for number, pair in enumerate(found.pairs):
        alone = np.array([distance(number, world) for world in worlds])
        np.testing.assert_array_equal(distances_cm[:, number + 1], alone)
        assert pair.band.mean == pytest.approx(alone.mean())
        promised = np.mean([distance(number, world) for world in seen])
        assert pair.promised == pytest.approx(promised)
        assert pair.optimism == pytest.approx(promised - alone.mean())
        beyond = np.mean(alone > distances_cm[:, 0])
        assert pair.share_beyond_expert == pytest.approx(beyond)
        assert pair.full_order == ()
        # A short walk is no mean over time.
        assert -0.02 <= pair.hub_load_share <= 1.02
    best = max(found.pairs, key=lambda each: each.promised)
    assert found.best == best.label
    assert found.median == best.band.median
    assert found.tests == tuple(sorted(found.tests, key=lambda each: -each.narrowing))
    assert {each.number for each in found.tests} >= {"damping_factor", "mass_factor"}
    assert "`pneumorph certify RUN --full` makes them" in found.notes[-1]
    assert source.objective is not None
    training = json.loads((learned / "summary.json").read_text())
    assert training["ranked_by"] == "mean over the worst 25 % of 4 worlds"


def test_a_pair_has_its_distance_and_what_ranked_it(learned: Path, certified: Path) -> None:
    """The mean over the training's worlds is promised; ranked is the mean over the worst of them,
    which is less, unless they are all alike."""
    summary = json.loads((learned / "summary.json").read_text())
    pairs = json.loads((certified / "summary.json").read_text())["pairs"]
    for pair, ranked in zip(pairs, summary["pairs"], strict=True):
        assert ranked["distance_cm"] == pytest.approx(pair["promised_cm"], abs=1e-6)
        assert ranked["score_cm"] < ranked["distance_cm"]
    assert summary["pairs"][0]["score_cm"] >= summary["pairs"][1]["score_cm"]
    assert summary["best_distance_cm"] == summary["pairs"][0]["distance_cm"]


def test_a_training_ends_with_its_certificate(
    learned: Path, certified: Path, tmp_path: Path
) -> None:
    """As the verb says of it afterwards, but for the worlds that the expert is tuned in."""
    summary = json.loads((learned / "summary.json").read_text())
    later = json.loads((certified / "summary.json").read_text())
    pairs = [[row[1:] for row in each["distances_cm"]] for each in (summary["certificate"], later)]
    assert pairs[0] == pairs[1]
    assert summary["median_cm"] == later["median_cm"]
    assert summary["tenth_percentile_cm"] == later["tenth_percentile_cm"]
    assert summary["expert_median_cm"] == summary["certificate"]["expert"]["band"]["median_cm"]
    assert 0.0 <= summary["share_beyond_expert"] <= 1.0
    assert run(["report", str(learned), "--figure-files", "--out", str(tmp_path)]) == 0
    page = (tmp_path / "page.html").read_text()
    assert "How far, and how sure" in page
    assert "The best pairs, by mean over the worst 25 % of 4 worlds" in page
    assert f"Replay: {summary['certificate']['best']} in two worlds" in page
    remarks = summary["certificate"]["notes"]
    assert 0 < len(remarks) <= len(summary["notes"])
    assert summary["notes"][-len(remarks) :] == remarks
    assert all(escape(note) in page for note in summary["notes"])


def test_a_median_and_a_bad_world_are_recorded(learned: Path, certified: Path) -> None:
    """Each walk is the one that the band is of, to the rounding of robots side by side or alone."""
    for folder, key in ((learned, "certificate"), (certified, None)):
        summary = json.loads((folder / "summary.json").read_text())
        found = summary if key is None else summary[key]
        place = 1 + [pair["label"] for pair in found["pairs"]].index(found["best"])
        distances = np.array(found["distances_cm"])[:, place]
        for (file, _), rank in zip(SHOWN_WORLDS.values(), (2, 0), strict=True):
            walked = Trajectory.load(folder / file)
            # Of six worlds, the third worst and the worst.
            assert walked.metadata["world"] == np.argsort(distances)[rank]
            assert walked.distance_cm == pytest.approx(np.sort(distances)[rank], abs=1e-6)


def test_a_measurement_keeps_the_band_to_worlds_that_agree(
    learned: Path, certified: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = run_json(
        f"certify {learned} --world-count 4 --tuning-world-count 1 --pair-count 1 --cycle-s 0.4 "
        f"--randomisation.measured damping_factor 0.8 0.02 --out {tmp_path / 'told'}",
        capsys,
    )
    assert max(abs(value - 0.8) for value in found["numbers"]["damping_factor"]) < 0.1
    friction = [world.friction for world in unseen_worlds(WORLDS, 4, 0)]
    assert found["numbers"]["friction"] == friction
    assert found["distributions"]["measured"] == [["damping_factor", 0.8, 0.02]]
    assert any("agree with the tests of damping_factor;" in note for note in found["notes"])
    # What choosing made of it is told in worlds as the training's, which knew of no measurement.
    whole = json.loads((certified / "summary.json").read_text())
    alike = np.array(whole["distances_cm"])[:4, 1].mean()
    promised = found["pairs"][0]["promised_cm"]
    assert found["pairs"][0]["optimism_cm"] == pytest.approx(promised - alike, abs=1e-9)


def test_its_page_shows_bands_and_what_to_measure(certified: Path, tmp_path: Path) -> None:
    assert run(["report", str(certified), "--figure-files", "--out", str(tmp_path)]) == 0
    page = (tmp_path / "page.html").read_text()
    for words in ("How far, and how sure", "What to measure", "What the distance depends on"):
        assert words in page


def test_the_best_pair_walks_in_its_worst_worlds_as_finite_elements(
    learned: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the other one in the world as it stands; walks that differ are named."""
    asked = []

    def walked(spec, walks, folder, executor, goal):
        asked.extend((walker.label, world) for walker, world in walks)
        return [KeptWalk(10.0 if world is None else -10.0, "completed", 1.0) for _, world in walks]

    monkeypatch.setattr(certificate, "full_order_walks", walked)
    monkeypatch.setattr(RobotSpec, "check_reduction", lambda _: None)
    settings = CertificateSettings(
        world_count=6,
        tuning_world_count=2,
        cycle_s=0.4,
        full=True,
        rounds=RoundSettings(limit=0),
        randomisation=WORLDS,
    )
    found = certify(learned, settings, folder=RunFolder(tmp_path, "certify"))
    place = [pair.label for pair in found.pairs].index(found.best)
    far = np.array(found.achieved)[:, place + 1]
    worst = np.argsort(far, kind="stable")[:2]
    worlds = unseen_worlds(WORLDS, 6, 0)
    expected = [(pair.label, None) for pair in found.pairs]
    expected[place + 1 : place + 1] = [(found.best, worlds[number]) for number in worst]
    assert asked == expected
    walks = found.pairs[place].full_order
    assert [each.world for each in walks] == [None, *worst]
    assert [each.reduced for each in walks[1:]] == [far[number] for number in worst]
    assert [each.full for each in walks] == [10.0, -10.0, -10.0]
    assert sum("as finite elements in the world as it stands" in note for note in found.notes) == 2
    assert sum("as finite elements in the world number" in note for note in found.notes) == 2
    assert not any("`pneumorph certify RUN --full` makes them" in note for note in found.notes)


def test_a_calibrations_tests_narrow_the_worlds(learned: Path, tmp_path: Path) -> None:
    """As the same numbers by flag do: the same worlds and distances."""
    measured = Calibration(measured={"mass_factor": (0.95, 0.01)})
    file, asked = measured.save(tmp_path / "calibration.json"), f"certify {learned} --world-count 6"
    same = "--randomisation.measured mass_factor 0.95 0.01"
    for folder, flag in (("a", f"--calibration {file}"), ("b", same)):
        out = f"--tuning-world-count 2 --cycle-s 0.4 --out {tmp_path / folder}"
        assert run([*asked.split(), *flag.split(), *out.split()]) == 0
    by_file, by_flag = (
        result_from_dict(Certificate, json.loads((tmp_path / each / "summary.json").read_text()))
        for each in "ab"
    )
    masses = np.array(by_file.numbers["mass_factor"])
    assert np.all(np.abs(masses - 0.95) < 0.04)
    assert by_file.numbers == by_flag.numbers
    assert by_file.achieved == by_flag.achieved
    assert list(map(list, by_file.distributions["measured"])) == [["mass_factor", 0.95, 0.01]]


def test_a_training_on_rays_workers_is_the_same(learned: Path, leg: Path) -> None:
    """To the last digit, its certificate included; who goes on with it does so here."""
    pytest.importorskip("ray")
    folder = learned.parent / "shared"
    with connected(2, None):
        asked = f"coopt --part {leg} --out {folder} {_SHORT}"
        assert run([*asked.split(), *["--executor.backend", "ray"]]) == 0
    here, there = (json.loads((each / "summary.json").read_text()) for each in (learned, folder))
    for name in ("pairs", "baseline_best_distance_cm", "replayed_distance_cm"):
        assert there[name] == here[name]
    for name in ("distances_cm", "pairs", "numbers"):
        assert there["certificate"][name] == here["certificate"][name]
    source = FinishedRun.read(folder)
    assert source.robot.executor.backend == "ray"
    assert "executor" not in source.taken_over("robot")["robot"]


def test_valves_that_a_robot_has_not_are_not_to_be_measured(tmp_path: Path) -> None:
    """Drawn worlds may have them; without air that flows through them they have no effect."""
    run_folder = Path(__file__).parents[2] / "reproduce/fast_schedule/seed_0"
    out = tmp_path / "certificate"
    asked = f"certify {run_folder} --pair-count 1 --world-count 4 --tuning-world-count 1"
    drawn = "--randomisation.filling-factor U(0.5,2) --randomisation.venting-factor U(0.5,2)"
    assert run([*asked.split(), *drawn.split(), "--out", str(out)]) == 0
    found = json.loads((out / "summary.json").read_text())
    assert "modulus_factor" in found["numbers"]
    assert not {"filling_factor", "venting_factor"} & set(found["numbers"])


@pytest.mark.parametrize(
    ("asked", "name"),
    [
        ("certify {run} --rounds.limit 1", "rounds"),
        ("certify {run} --worst-world-count 7", "worst_world_count"),
        ("coopt --preset quick --rounds.budget-s 60", "rounds"),
    ],
)
def test_what_is_of_finite_elements_is_refused_without_them(
    asked: str, name: str, learned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before anything walks; it would be ignored."""
    assert run([*asked.format(run=learned).split(), "--out", str(tmp_path / "run")]) == 1
    said = capsys.readouterr().err
    assert f"{name} is " in said
    assert "left out without --full (--certify of coopt)" in said
    assert "walking" not in said
