"""Gaits or designs searched without learning a policy, to see how good the learned ones are."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np

from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.base.spent_time import spent_s
from pneumorph.catalogue.idle_numbers import idle_notes
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_identity import reduction_digest, resume_identity
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.walk import walk
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.gait_search import GaitSearch
from pneumorph.learn.genetic_algorithm import GeneticAlgorithm
from pneumorph.learn.random_search import RandomSearch
from pneumorph.learn.search_run import LOG_FILE, run_search
from pneumorph.learn.searcher import Searcher
from pneumorph.reduction.snapshot_range import known_ratio, range_note
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.certified_candidates import own_task_notes
from pneumorph.study.checked_designs import check_designs
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.run_beside_search import (
    own_pairs,
    policy_pairs,
    same_worlds_note,
)
from pneumorph.study.search_files import GaitFiles, best_gaits, policy_gaps, write_curve
from pneumorph.study.search_findings import (
    DesignsBestGait,
    FoundPair,
    SearchFindings,
)
from pneumorph.study.search_settings import (
    SearchSettings,
    asked_timesteps,
    long_generation_note,
    searched_designs,
)
from pneumorph.study.survived import status_of
from pneumorph.study.training_worlds import TrainingWorlds, simulator_factory

SPENT_FILE = "spent.json"
"""What a search has taken so far, so that processes that were stopped count."""


def search(
    settings: SearchSettings,
    robot: RobotSpec,
    folder: RunFolder,
    learned: FinishedRun | None = None,
    randomisation: Randomisation | None = None,
) -> SearchFindings:
    """Search, and return the best of each design or of all.

    Args:
        settings: What is searched.
        robot: What walks.
        folder: Receives ``search.jsonl``, ``learning_curve.json``, ``spent.json`` (the seconds that
            the search has taken) and the best gaits; a search that is there already goes on.
        learned: A coopt run whose best designs are searched as well and whose policy and pairs
            stand beside, in the same worlds as what is found; task, space and objective of the
            settings must be its own.
        randomisation: What worlds are drawn from where the objective asks for several; None for
            those of the measured physics.

    Raises:
        ArtefactError: The run is damaged, or a reduction that worlds may have is none.
        FileNotFoundError: The run has lost its policy, or there is no file of the ground or of such
            a reduction.
        ValueError: The folder holds a search of other settings, or designs, task, robot and worlds
            do not go together (as of `check_designs`).
    """
    start = time.monotonic()
    task, space, objective = settings.task, settings.space, settings.objective
    own_task = own_task_notes(None if learned is None else learned.own_task, task.goal)
    for told in own_task:
        folder.progress.say(told)
    drawn = None
    if objective.is_robust:
        drawn = measured_worlds() if randomisation is None else randomisation
    checked = check_designs(
        robot,
        space,
        task,
        folder.progress.say,
        worlds=drawn,
        ranks_images=settings.method != "gaits" and task.reward.is_symmetric,
        learns=False,
    )
    worlds: TrainingWorlds | None = None
    idle: tuple[str, ...] = ()
    if drawn is not None:
        agreeing = robot.agreeing_worlds(drawn)
        idle = idle_notes(robot, agreeing)
        worlds = TrainingWorlds.of_objective(agreeing, objective, objective.worlds_per_design)
    environment = CrawlingEnvironment(
        space.some(settings.environment_count),
        robot.assembly,
        simulator_factory(robot, worlds, settings.seed),
        task,
        space.module_count,
        space.cavity_count,
    )
    gaits = settings.method == "gaits"
    designs = searched_designs(settings, learned) if gaits else {}
    asked = asked_timesteps(settings, len(designs))
    if (long := long_generation_note(settings, len(designs))) is not None:
        folder.progress.say(long)
    # Before the search, which takes hours: a run that lost its policy ends here.
    by_policy, without = policy_pairs(environment, space, learned, list(designs), folder, objective)
    action_s = task.action_s(robot.physics.time_step_s)
    own = own_pairs(environment, space, learned, list(designs), action_s, folder, objective)
    folder.progress.stage(f"searching ({settings.method})")
    earlier_s: list[float] = []
    with ExitStack() as clock:

        def told_progress(done: int, total: int, message: str) -> None:
            if not earlier_s:  # only now is the folder known to be of this very search
                earlier_s.append(clock.enter_context(spent_s(folder / SPENT_FILE)))
            folder.progress(done, total, message)

        if not (folder.path / LOG_FILE).exists():  # nothing is gone on with
            (folder.path / SPENT_FILE).unlink(missing_ok=True)
        found = run_search(
            _searcher(settings, list(designs)),
            environment,
            space,
            asked,
            folder.path,
            objective=objective,
            finalist_count=max(settings.finalist_count, len(designs)),
            every_design=gaits,
            description=_description(settings, robot, list(designs), worlds),
            progress=told_progress,
        )
    write_curve(folder, found, action_s, task.goal)
    gait_files = GaitFiles(folder, space, task, action_s)
    pairs: tuple[FoundPair, ...] | None = None
    rows: tuple[DesignsBestGait, ...] | None = None
    if gaits:
        walked = [pair for design in designs if (pair := found.best.get(design)) is not None]
        rows = best_gaits(designs, found, gait_files, by_policy, own)
        best: FoundPair | None = max(rows, key=_score)
    else:
        walked = found.ranked(space, task.reward.is_symmetric)[: settings.kept_pair_count]
        pairs = tuple(gait_files.write(pair.design, pair) for pair in walked)
        best = pairs[0] if pairs else None
    resumed = found.resumed_timesteps
    return SearchFindings(
        method=settings.method,
        best_design=None if best is None else best.design,
        best_distance_cm=None if best is None else best.distance_cm,
        designs=rows,
        policy_gaps=None if rows is None else policy_gaps(rows),
        pairs=pairs,
        timesteps=int(found.timesteps[-1]),
        simulated_s=float(found.timesteps[-1]) * action_s,
        notes=(
            *own_task,
            *checked,
            *idle,
            *without,
            *same_worlds_note(own, objective),
            *_notes(resumed, int(found.timesteps[-1]), asked),
            *_range_notes(robot, space, task, walked),
        ),
        seed=settings.seed,
        goal=task.goal,
        best_achieved=None if best is None else best.achieved,
        finalist_timesteps=found.finalist_timesteps,
        **robot.describe(reduced=False),
        wall_s=sum(earlier_s) + time.monotonic() - start,
        status=status_of(walked or None),
    )


def _notes(resumed: int, made: int, asked: int) -> tuple[str, ...]:
    notes = [f"resumed at timestep {resumed}"] if resumed else []
    if made >= 1.5 * asked:
        notes.append(
            f"{made} timesteps were made where {asked} were asked for: a search ends with the "
            "generation that reaches them, each candidate in as many worlds as the objective asks "
            "for; a smaller population makes shorter generations"
        )
    return tuple(notes)


def _range_notes(
    robot: RobotSpec, space: DesignSpace, task: CrawlingTask, pairs: Sequence[DesignGaitPair]
) -> list[str]:
    """What to tell of found pairs that leave the range of their legs in the world as it stands."""
    if not pairs or not any(module.reduced.knows_range for module in robot.modules):
        return []
    action_s = task.action_s(robot.physics.time_step_s)
    gaits = [pair.gait(action_s, task) for pair in pairs]
    designs = [space[pair.design] for pair in pairs]
    ratios = walk(
        robot.simulator_in_worlds([robot.assembly(design) for design in designs], None),
        gaits,
        duration_s=gaits[0].duration_s,
        time_step_s=robot.physics.time_step_s,
        settling_step_count=task.settling_step_count,
        record_step_count=task.action_step_count,
    ).range_ratio
    told = map(range_note, map(str, designs), map(known_ratio, ratios))
    return [note for note in told if note is not None]


def _description(
    settings: SearchSettings,
    robot: RobotSpec,
    designs: Sequence[int],
    worlds: TrainingWorlds | None,
) -> dict[str, Any]:
    """What a search that goes on must have in common with its beginning."""
    asked = settings_to_dict(settings)
    same = ("method", "seed", "gaits", "random", "genetic", "space", "task")
    return {
        **{name: asked[name] for name in same},
        "designs": [str(settings.space[design]) for design in designs],
        "simulation": robot.settings,
        "leg": reduction_digest(robot),
        **resume_identity(robot, None if worlds is None else worlds.randomisation),
        **({} if worlds is None else {"objective": asked["objective"], **worlds.as_dict()}),
    }


def _searcher(settings: SearchSettings, designs: list[int]) -> Searcher:
    space, task = settings.space, settings.task
    if settings.method == "gaits":
        return GaitSearch(designs, task, settings.gaits, settings.seed)
    if settings.method == "random":
        return RandomSearch(space, task, settings.random, settings.seed)
    return GeneticAlgorithm(space, task, settings.genetic, settings.seed)


def _score(pair: FoundPair) -> float:
    return -np.inf if pair.score_cm is None else pair.score_cm
