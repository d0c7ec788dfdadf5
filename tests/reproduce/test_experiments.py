"""The scripts of the experiments, from a short run to their figures and summaries."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from helpers.experiment_scripts import FEW_ACTIONS, REPRODUCE, call, script
from helpers.result_example import example
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.base.artefact import write_json
from pneumorph.base.run_folder import RunFolder, read_settings, read_summary
from pneumorph.base.settings import laid_over, load_settings, read_settings_file
from pneumorph.catalogue.full_options import FullOptions
from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import run
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.learn.policy_file import load_policy
from pneumorph.physics.air import Air
from pneumorph.physics.friction import FrictionPressure
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design import Design
from pneumorph.simulation.stepper_settings import StepperSettings
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.gait_source import find_gait
from pneumorph.study.gait_walks import GaitWalkSettings
from pneumorph.study.kept_run import keep_run
from pneumorph.study.learning_curve import learning_curve
from pneumorph.study.reduction import Reduction
from pneumorph.study.reduction_options import ReduceOptions
from pneumorph.study.training_result import LearnedPair, TrainingResult

_SHORT = (
    "--restarts 1 "
    "--total-timesteps 20 --environment-count 4 --task.action-count 5 --task.action-step-count 80 "
    "--learning-start-timestep 10 --updates 1 --sac.batch-size 8 --sac.hidden-sizes 8 8 "
    "--schedule.decay-start-timestep 5 --schedule.decay-end-timestep 18 "
    "--evaluated-design-count 4 --kept-pair-count 2 --finetuning.timesteps 20 "
    "--certified-world-count 0 "
    "--finetuning.finalist-count 2 --baseline.phase-step-deg 90 --baseline.gait.duration-s 4 "
    "--baseline.record-step-count 10"
)
_FEW_ACTIONS = laid_over(
    FEW_ACTIONS, {"certified_world_count": 4, "coopt": {"objective": {"evaluation_worlds": 4}}}
)
"""A training of a dozen actions in drawn worlds, as settings over a preset."""


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Path:
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    return part.save(tmp_path_factory.mktemp("leg") / "leg.npz")


@pytest.fixture(scope="module")
def runs(leg: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A short coopt run under each damping."""
    folder = tmp_path_factory.mktemp("runs")
    for damping in ("published", "objective"):
        asked = f"--preset fast --part {leg} --physics.damping {damping} {_SHORT}"
        assert run(["coopt", *asked.split(), "--out", str(folder / damping)]) == 0
    return {damping: folder / damping for damping in ("published", "objective")}


def test_the_published_physics_is_named_in_full() -> None:
    """Every field: one that is left out would follow the package's default wherever that goes."""
    named = read_settings_file(REPRODUCE / "published.toml")
    not_of_it = {"part", "threads", "executor", "calibration", "described", "file_text"}
    assert set(named) == {each.name for each in fields(RobotOptions)} - not_of_it
    for group, settings, left_out in (
        (named["physics"], Physics, {"ground", "start"}),  # a plane, upright on it
        # Nothing else of them counts beside this law and this exponent.
        (named["physics"]["air"], Air, {each.name for each in fields(Air)} - {"law"}),
        (
            named["physics"]["friction_pressure"],
            FrictionPressure,
            {each.name for each in fields(FrictionPressure)} - {"exponent"},
        ),
        (named["physics"]["pressure_map"], PressureMap, set()),
        (named["stepper"], StepperSettings, set()),
        # Nothing is weighed, and densities are of cast legs.
        (named["masses"], Masses, {"leg_mass_g", "hub_mass_g", "densities"}),
        (named["full"], FullOptions, {"mesh"}),
    ):
        assert set(group) == {each.name for each in fields(settings)} - left_out
    published = load_settings(RobotOptions, REPRODUCE / "published.toml")
    spec = published.spec()
    assert spec.physics == published.physics
    assert spec.stepper == published.stepper
    # What its names stand for, as its comments say.
    assert named["leg"] == named["masses"]["model"] == "published"
    part, materials = spec.module.full, leg_kind(published.leg).materials
    assert (materials.silicone.young_modulus_kPa, materials.silicone.poisson_ratio) == (1160.0, 0.2)
    assert (materials.sheet.young_modulus_kPa, materials.sheet.poisson_ratio) == (2320.0, 0.49)
    for leg_mass_kg in (part.mass_kg, spec.module.reduced.mass):
        assert leg_mass_kg == pytest.approx(0.105, rel=1e-9)
    assert spec.hub.rigid.mass == pytest.approx(0.075, rel=1e-12)


def test_everything_after_the_paper_scale_training(
    runs: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    learned_folder = runs["published"]
    learned = read_summary(learned_folder)
    learned_from = script("paper_scale").best_of_each_leg_count(
        FinishedRun.read(learned_folder).result(TrainingResult).pairs
    )
    kept_folder = ("--out", tmp_path, "--work", learned_folder / "paper_scale")
    call("paper_scale", monkeypatch, *kept_folder, "--run", learned_folder, "--steps", "keep")
    (tmp_path / "full_order").mkdir()
    walked = {
        f"L{rank}": pair["distance_cm"] - 0.25 for rank, pair in enumerate(learned["pairs"], 1)
    }
    for name, distance_cm in {"B": 2.0, **walked}.items():
        kept_walk = json.dumps({"distance_cm": distance_cm})
        (tmp_path / "full_order" / f"{name}.json").write_text(kept_walk)
    gaits = [tmp_path / "gaits" / f"L{place + 1}.csv" for place in learned_from]
    finer = synthetic_reduced_part(mode_count=6, cells=(4, 4, 4))

    def reduced(options: ReduceOptions, folder: RunFolder) -> Reduction:
        """Stand for the walks of finite elements, which take too long for a test."""
        assert options == replace(
            ReduceOptions(), snapshots=options.snapshots, reduction=options.reduction,
            walked=GaitWalkSettings(gaits=tuple(gaits), damping="published"),
        )  # fmt: skip
        part = str(finer.save(folder / "leg.npz"))
        return replace(example(Reduction), part=part)

    monkeypatch.setattr("pneumorph.study.reduction_options.reduce_as_asked", reduced)
    call("paper_scale", monkeypatch, *kept_folder)
    summary = json.loads((tmp_path / "summary.json").read_text())
    for name in ("timesteps", "wall_s", "best_design", "baseline_best_distance_cm"):
        assert summary[name] == learned[name]
    best = learned["best_distance_cm"]
    # The best pair is walked once more, from its file, alone.
    assert summary["best_distance_cm"] == pytest.approx(best, rel=1e-12)
    assert summary["best_distance_full_order_cm"] == best - 0.25
    again_cm = [pair["distance_learned_leg_cm"] for pair in summary["pairs"]]
    assert summary["best_distance_learned_leg_cm"] == again_cm[0]
    assert abs(again_cm[0] - best) > 0.01  # another leg
    assert summary["learned_leg"]["mode_count"] == 6
    assert [pair["leg_learned_from_it"] for pair in summary["pairs"]] == [
        place in learned_from for place in range(2)
    ]
    assert summary["times_the_baseline_full_order"] == pytest.approx((best - 0.25) / 2.0)
    # The mirrored robot takes other roundings alone.
    assert summary["mirror_image_distance_cm"] == pytest.approx(best, abs=1e-3)
    assert [pair["design"] for pair in summary["pairs"]] == [
        pair["design"] for pair in learned["pairs"]
    ]
    assert "processors" in summary["made_by"]["machine"]
    assert summary["settings"]["coopt"]["seed"] == 0
    # What is kept is a run: every verb that takes one takes it.
    again = FinishedRun.read(tmp_path)
    assert [pair.distance_cm for pair in again.pairs()] == pytest.approx(
        [pair["distance_cm"] for pair in learned["pairs"]], abs=1e-9
    )
    kept = {path.name for path in tmp_path.iterdir()}
    figures = ("baseline", "training", "distances", "steps", "margin", "friction", "pairs",
               "cycle_B", "cycle_L1")  # fmt: skip
    assert {*(f"{name}.png" for name in figures), "settings.json", "analysis.json"} <= kept


def test_a_leg_is_learned_from_the_best_pair_of_each_number_of_legs() -> None:
    designs = ("0.0.1.2.1.0.0.0", "0.0.1.2.3.0.0.0", "0.0.1.2.2.1.0.0", "1.1.1.0.1.0.0.0")
    pairs = [LearnedPair(design, 1.0, "policy") for design in designs]
    assert script("paper_scale").best_of_each_leg_count(pairs) == [0, 2]


def test_searches_beside_learning(
    runs: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    where = ("--out", tmp_path, "--work", tmp_path / "work")
    call("answer", monkeypatch, runs["published"], *where, "--gait-timesteps", 100)
    found = json.loads((tmp_path / "answer.json").read_text())
    assert found["timesteps"] == 20 + 2 * 20
    for method in ("random", "genetic"):
        assert found[method]["timesteps"] >= 60
        assert found[method]["best_distance_cm"] == max(
            pair["distance_cm"] for pair in found[method]["pairs"]
        )
    assert {"expert's design", "L1", "L2", "drawn at random"} == {
        row["why"] for row in found["gaits"]["designs"]
    }
    for name in ("own_gaits.png", "learning_curves.png"):
        assert (tmp_path / name).stat().st_size > 5000
    # What was searched earlier stays.
    call("answer", monkeypatch, runs["published"], *where, "--steps", "random")
    assert json.loads((tmp_path / "answer.json").read_text()) == found


@pytest.mark.parametrize(
    ("own_cm", "other_cm", "survives"),
    [(7.4, 7.9, True), (7.4, 6.6, True), (7.4, 11.4, False), (7.4, 5.8, False), (7.4, None, False)],
)
def test_a_distance_survives_neither_a_loss_nor_a_gain(
    own_cm: float, other_cm: float | None, survives: bool
) -> None:
    own, other = (SimpleNamespace(distance_cm=far) for far in (own_cm, other_cm))
    assert script("damping_gap").survives(own, other) is survives


def test_each_runs_pairs_under_the_other_damping(
    runs: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = [f"--{name}={folder}" for name, folder in runs.items()]
    arguments += ["--out", tmp_path, "--work", tmp_path / "work"]
    call("damping_gap", monkeypatch, *arguments)
    found = json.loads((tmp_path / "damping_gap.json").read_text())
    for damping, folder in runs.items():
        learned = read_summary(folder)
        for row, pair in zip(found[damping]["pairs"], learned["pairs"], strict=True):
            assert row["design"] == pair["design"]
            # Under its own damping a pair repeats what its run reported.
            assert row["own_distance_cm"] == pytest.approx(pair["distance_cm"], abs=1e-9)
            assert row["other_distance_cm"] != row["own_distance_cm"]
            close = abs(row["other_distance_cm"] - row["own_distance_cm"]) < 1.0
            assert row["survives"] == close
            for name in ("own_front_slipping_share", "other_front_slipping_share"):
                assert 0.0 <= row[name] <= 1.0
    kept = FinishedRun.read(tmp_path / "objective")
    assert kept.robot.physics.damping == "objective"
    with pytest.raises(SystemExit, match="was trained with objective damping"):
        call("damping_gap", monkeypatch, f"--published={runs['objective']}", *arguments[1:])


def test_seeds_of_the_fast_preset_beside_the_full_run(
    runs: dict[str, Path], leg: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = write_json(tmp_path / "short.json", {"run": read_settings(runs["published"])})
    call(
        "fast_schedule", monkeypatch, "--full", runs["published"], "--seeds", 0, 1,
        "--runs", tmp_path / "runs", "--out", tmp_path, "--settings", settings,
    )  # fmt: skip
    found = json.loads((tmp_path / "fast.json").read_text())
    learned = read_summary(runs["published"])
    first, second = found["runs"]
    # Seed 0 is the very run it is compared with.
    assert first["behind_cm"] == pytest.approx(0.0, abs=1e-9)
    assert first["reached"]
    assert first["share_of_timesteps"] == 1.0
    assert second["behind_cm"] == learned["best_distance_cm"] - second["best_distance_cm"]
    assert found["reached_count"] == first["reached"] + second["reached"]
    for row in (first, second):
        kept = FinishedRun.read(tmp_path / f"seed_{row['seed']}")
        assert kept.pairs()[0].distance_cm == row["best_distance_cm"]
        policy, _, _ = load_policy(kept.folder / "training" / "policy.npz")
        assert policy.action_size == kept.task.regulator_count


def test_the_demos_trainings_are_kept_by_seed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a dozen actions each; a finished training is read again."""
    settings = write_json(tmp_path / "short.json", _FEW_ACTIONS)
    asked = ("--seeds", 3, 4, "--work", tmp_path / "runs", "--out", tmp_path, "--threads", 1)
    for _ in range(2):
        call("demo", monkeypatch, *asked, "--settings", settings)
        found = json.loads((tmp_path / "demo.json").read_text())["seeds"]
        assert [row["seed"] for row in found] == [3, 4]
    for row in found:
        assert row["tenth_percentile_cm"] <= row["median_cm"] <= row["ninetieth_percentile_cm"]
        assert row["world_count"] == 4
        assert (tmp_path / f"seed_{row['seed']}.csv").exists()
        kept = read_summary(tmp_path / "runs" / f"seed_{row['seed']}")
        assert kept["median_cm"] == row["median_cm"]


def test_robots_of_ones_own_stand_beside_their_rivals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a dozen actions; what was made is read again, and what is not asked for stays."""
    settings = write_json(tmp_path / "short.json", _FEW_ACTIONS)
    asked = ("--examples", "plate", "--work", tmp_path / "runs", "--out", tmp_path,
             "--threads", 1, "--settings", settings)  # fmt: skip
    call("robots", monkeypatch, *asked, "--steps", "learn", "uniform")
    before = json.loads((tmp_path / "robots.json").read_text())["robots"]
    call("robots", monkeypatch, *asked, "--steps", "genetic")
    found = json.loads((tmp_path / "robots.json").read_text())["robots"]
    assert [row["example"] for row in found] == ["plate"]
    for row, earlier in zip(found, before, strict=True):
        assert {**row, "genetic": None} == {**earlier, "genetic": None}
        assert row["unit"] == "cm"
        assert row["world_count"] == 4
        for method in ("learned", "expert", "uniform", "genetic"):
            band = row[method]
            assert band["tenth_percentile"] <= band["median"] <= band["ninetieth_percentile"]
            assert method == "learned" or 0.0 <= band["learned_beyond"] <= 1.0
        assert (tmp_path / row["learned"]["gait"]).exists()
        walk = row["learned"]["walks"]["nominal"]
        assert 0.0 <= walk["mean_tilt_deg"] <= walk["largest_tilt_deg"]
    assert (tmp_path / "robots.png").stat().st_size > 5000
    robots = script("robots")
    plate, rough = (robots.EXAMPLES[name].options(0, {}) for name in ("plate", "rough_ground"))
    assert len(plate.coopt.space) >= 10_000_000
    assert rough.randomisation.ground_roughness_mm == "U(1, 5)"


def test_robots_of_two_chambers_turn_and_walk_in_the_measured_physics() -> None:
    robots = script("robots")
    turning, heading = (robots.EXAMPLES[name].options(1, {}) for name in ("turning", "heading"))
    for options in (turning, heading):
        assert options.robot.leg_name == "measured"
        # Chambers side by side grow otherwise than the paper's leg's, which its own part says.
        measured, grown = leg_kind("measured").physics, options.robot.spec().modules[0].reduced
        air = replace(measured.air, chamber_growth=grown.chamber_growth)
        assert options.robot.physics == replace(measured, regulator_count=4, air=air) != measured
        assert options.coopt.seed == 1
        for name in ("turning", "heading"):
            for design in robots.EXAMPLES[name].uniform:
                options.coopt.space.check(Design.parse(design))
    by_hand = find_gait(robots.EXAMPLES["turning"].by_hand, None, ExpertGait())
    turning.coopt.space.check(by_hand.design)
    assert by_hand.gait.duration_s == turning.coopt.task.action_count * 1.0
    for name, asked in robots.EXAMPLES.items():
        space = asked.options(1, {}).coopt.space
        for design in asked.uniform:
            assert space.holds(Design.parse(design)), name
    assert robots.EXAMPLES["climbing"].options(1, {}).robot.physics.floor_slope_deg == 10.0
    described = RobotDescription.read(REPRODUCE.parent / "examples" / "two_chambers.toml")
    # On the printed hub, whose top is 0.02 mm higher.
    hub = described.hub.spec(described.folder).rigid
    printed = RobotOptions.of("measured").spec().hub.rigid
    for name in ("mass", "first_moment", "second_moment"):
        assert getattr(hub, name) == pytest.approx(getattr(printed, name), rel=1e-6, abs=1e-9), name
    assert hub.tracked_point == pytest.approx(printed.tracked_point, abs=0.02)
    # Who turns in place has no front: robots that are turned by a quarter count once there.
    assert turning.coopt.space.symmetries
    assert not heading.coopt.space.symmetries
    assert turning.coopt.task.goal.unit == "degrees"
    assert heading.coopt.task.reward.heading_deg == 90.0


@pytest.mark.parametrize("kept", ["paper_scale", "fast_schedule/seed_0"])
def test_kept_runs_have_a_page(kept: str, tmp_path: Path) -> None:
    report = ["report", str(REPRODUCE / kept), "--figure-files", "--out", str(tmp_path)]
    assert run(report) == 0
    page = (tmp_path / "page.html").read_text()
    for heading in ("Training", "The best pairs", "How to repeat it"):
        assert f"<h2>{heading}" in page


def test_keeping_a_run_in_its_own_folder_is_refused(runs: dict[str, Path]) -> None:
    with pytest.raises(ValueError, match="is the run itself"):
        keep_run(runs["published"], runs["published"])
    assert FinishedRun.read(runs["published"]).pairs()


def test_a_learning_curve_ends_with_the_finetuned_best(runs: dict[str, Path]) -> None:
    learned = read_summary(runs["published"])
    simulated_s, best_cm = learning_curve(runs["published"])
    # 20 timesteps and twice 20 of fine-tuning, of 80 steps of 0.01 s.
    assert simulated_s == pytest.approx([16.0, 48.0])
    assert best_cm[-1] == max(learned["best_distance_cm"], best_cm[0])


def test_teeth_are_walked_with_and_without_contact(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One pair in two worlds."""
    module = script("teeth")
    monkeypatch.setattr(module, "PRESSURES_KPA", (25, 50))
    monkeypatch.setattr(module, "FRAMES", 50)
    module.main(module.RUNS[:1], 1, 2, tmp_path, tmp_path)
    found = json.loads((tmp_path / "teeth.json").read_text())
    through, touching = (found["blocked"][name] for name in ("through", "touching"))
    assert touching["force_mN"][1] > through["force_mN"][1]
    assert touching["gap_mm"][1] > through["gap_mm"][1]
    (row,) = found["pairs"]
    assert row["design"] == "0.1.0.1.0.2.0.3"
    assert row["through"]["share_crossing"] > 0.0
    assert row["touching"]["least_gap_mm"] > row["through"]["least_gap_mm"]
    assert abs(row["touching"]["median_cm"] - row["through"]["median_cm"]) < 5.0
    assert len(ReducedPart.load(tmp_path / "leg.npz").wall_pair) > 100
