"""A robot of more designs than anyone can list trains, is searched and is shown."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.learn.design_distribution import EntropySchedule
from pneumorph.learn.factored_distribution import FactoredDistribution
from pneumorph.learn.genetic_algorithm import GeneticSettings
from pneumorph.learn.sac import SacSettings
from pneumorph.learn.settings import quick_settings
from pneumorph.physics.start_pose import StartPose
from pneumorph.robot.design import Design
from pneumorph.study.search import search
from pneumorph.study.search_settings import SearchSettings
from pneumorph.study.training_run import run_training

PLATE = Path(__file__).parent.parent.parent / "examples" / "large_plate.toml"


@pytest.fixture(scope="module")
def plate() -> RobotDescription:
    return RobotDescription.read(PLATE)


def test_the_large_plate_trains(plate: RobotDescription, tmp_path: Path) -> None:
    """Two rounds, stopped nowhere: what is found walks again as far as it did."""
    assert len(plate.space) == 24_640_000
    quick = quick_settings()
    settings = replace(
        quick,
        space=plate.space,
        task=replace(quick.task, regulator_count=4, action_count=3),
        sac=SacSettings(hidden_sizes=(16,), batch_size=16),
        schedule=EntropySchedule(6, 60),
        environment_count=6,
        total_timesteps=36,
        learning_start_timestep=10,
        updates=1,
        evaluated_design_count=6,
    )
    baseline = PhaseSweepSettings(
        design=plate.usual_design,
        phase_step_deg=180.0,
        gait=ExpertGait(regulator_count=4, duration_s=4.0),
    )
    folder = RunFolder(tmp_path, "coopt")
    found = run_training(settings, folder, plate.spec(), baseline=baseline)
    assert found.best_design is not None
    assert Design.parse(found.best_design) in plate.space
    assert found.replayed_distance_cm == pytest.approx(found.best_distance_cm, abs=1e-9)
    # Going on with other settings is refused before the baseline walks over the run's own.
    swept = (tmp_path / "phase_sweep.npz").read_bytes()
    other = replace(baseline, phase_step_deg=90.0)
    with pytest.raises(ValueError, match=r"trained with other settings \(.*seed"):
        run_training(replace(settings, seed=3), folder, plate.spec(), baseline=other, resume=True)
    assert (tmp_path / "phase_sweep.npz").read_bytes() == swept


def test_a_lopsided_space_is_refused_before_anything_walks(tmp_path: Path) -> None:
    """Exclusions whose images are none: mirrored transitions would be of no design."""
    small = RobotDescription.read(PLATE.with_name("plate.toml"))
    quick = quick_settings()
    settings = replace(
        quick,
        space=replace(small.space, exclusions=("0 2",)),
        task=replace(quick.task, regulator_count=4),
    )
    assert settings.mirror_transitions
    baseline = PhaseSweepSettings(
        design=small.usual_design, gait=ExpertGait(regulator_count=4, duration_s=4.0)
    )
    with pytest.raises(ValueError, match=r"the mirror takes .* no mirror"):
        run_training(settings, RunFolder(tmp_path, "coopt"), small.spec(), baseline=baseline)
    spec = small.spec()
    turned = replace(spec.physics, start=StartPose(heading_deg=20.0))
    symmetric = replace(settings, space=small.space)
    with pytest.raises(ValueError, match=r"designs have mirror images, and robots start"):
        run_training(
            symmetric,
            RunFolder(tmp_path, "coopt"),
            replace(spec, physics=turned),
            baseline=baseline,
        )
    assert not list(tmp_path.iterdir())


def test_the_genetic_algorithm_keeps_to_the_rules_of_options(
    plate: RobotDescription, tmp_path: Path
) -> None:
    """Every child is one of the space; what walked furthest is found again under its name."""
    settings = SearchSettings(
        method="genetic",
        timesteps=3 * 6 * 3,
        environment_count=6,
        kept_pair_count=3,
        genetic=GeneticSettings(population=6, location_mutation_probability=0.4),
        space=plate.space,
        task=replace(SearchSettings().task, regulator_count=4, action_count=3),
    )
    found = search(settings, plate.spec(), RunFolder(tmp_path, "search"))
    assert found.timesteps == 54
    assert all("left the range of its legs' snapshots" in note for note in found.notes)
    assert found.pairs is not None
    assert len({pair.design for pair in found.pairs}) == 3
    for pair in found.pairs:
        assert Design.parse(pair.design) in plate.space


def test_a_search_says_that_it_ends_with_a_generation(
    plate: RobotDescription, tmp_path: Path
) -> None:
    settings = SearchSettings(
        method="genetic",
        timesteps=4,
        environment_count=6,
        genetic=GeneticSettings(population=6),
        space=plate.space,
        task=replace(SearchSettings().task, regulator_count=4, action_count=3),
    )
    found = search(settings, plate.spec(), RunFolder(tmp_path, "search"))
    assert found.timesteps == 18
    assert found.notes[0].split(":")[0] == "18 timesteps were made where 4 were asked for"
    assert all("left the range of its legs' snapshots" in note for note in found.notes[1:])


def test_a_belief_of_the_large_plate_is_even_at_first(plate: RobotDescription) -> None:
    """Each kind of module and each number of legs is drawn as often as there are designs of it."""
    space = plate.space
    distribution = FactoredDistribution(space, EntropySchedule(), mirrored=True)
    assert distribution.entropy == pytest.approx(np.log(24_640_000), rel=1e-12)
    drawn = distribution.sample(400, np.random.default_rng(0))
    legs = np.array([space[int(index)].leg_count for index in drawn])
    # C(8, L) 4^L (Stirling numbers up to 4): 0.01, 0.12 and 0.87 of all have 4, 5 and 6 legs. Six
    # standard deviations of a binomial.
    shares = np.array([70 * 256 * 15, 56 * 1024 * 51, 28 * 4096 * 187]) / 24_640_000
    for leg_count, share in zip((4, 5, 6), shares, strict=True):
        deviation = np.sqrt(400 * share * (1.0 - share))
        assert abs(np.sum(legs == leg_count) - 400 * share) < 6.0 * deviation
