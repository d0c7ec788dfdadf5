"""Gaits or designs searched without learning a policy, to see how good the learned ones are."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.checked import Checked, Count, CountOrNone
from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.idle_numbers import idle_notes
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_identity import reduction_digest, resume_identity
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.space_check import check_space
from pneumorph.catalogue.unseen_pressure import say_unseen_pressure
from pneumorph.catalogue.worlds_check import check_worlds
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.equal_designs import (
    check_equal_designs,
    check_equal_starts,
    lost_mirror_note,
)
from pneumorph.environment.equal_grounds import check_equal_grounds
from pneumorph.environment.goal import Goal
from pneumorph.gait.walk import walk
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.gait_search import GaitSearch, GaitSearchSettings
from pneumorph.learn.genetic_algorithm import GeneticAlgorithm, GeneticSettings
from pneumorph.learn.objective import Objective, check_worlds_fit
from pneumorph.learn.random_search import RandomSearch, RandomSearchSettings
from pneumorph.learn.search_run import CURVE_FILE, SearchResult, run_search
from pneumorph.learn.searcher import Searcher
from pneumorph.reduction.snapshot_range import known_ratio, range_note
from pneumorph.robot.design import BASELINE_DESIGN, Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.certified_candidates import own_task_notes
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.run_beside_search import (
    PAIRS_OF_RUN,
    own_pairs,
    policy_pairs,
    same_worlds_note,
)
from pneumorph.study.search_findings import (
    DesignsBestGait,
    FoundPair,
    PolicyGap,
    SearchCurve,
    SearchFindings,
)
from pneumorph.study.survived import status_of
from pneumorph.study.training_worlds import TrainingWorlds, simulator_factory

_GAITS_OF_EACH_DESIGN = 960
_TIMESTEPS = 1_000_000


@dataclass(frozen=True)
class SearchSettings(Checked):
    """What is searched, and for how long."""

    method: Literal["gaits", "random", "genetic"] = "gaits"
    """`gaits`: the best gait of each design. `random`, `genetic`: designs and gaits together."""
    usual_design: str = BASELINE_DESIGN
    """Design that is always included in a search of gaits: the expert's, or the usual one of a
    robot's file."""
    designs: tuple[str, ...] = ()
    """Additional designs whose gaits are searched."""
    random_design_count: CountOrNone = 30
    """Number of designs, drawn at random, whose gaits are searched."""
    timesteps: Count | None = None
    """Actions of all robots together, to the end of the generation that reaches them; those of a
    final evaluation come on top. None: one million, and for --method gaits 960 gaits of each
    design."""
    seed: CountOrNone = 0
    """Seed of every random number."""
    environment_count: Count = 96
    """Robots simulated side by side."""
    kept_pair_count: Count = 5
    """Number of best pairs reported by a search of designs."""
    gaits: GaitSearchSettings = field(default_factory=GaitSearchSettings)
    random: RandomSearchSettings = field(default_factory=RandomSearchSettings)
    genetic: GeneticSettings = field(default_factory=GeneticSettings)
    space: DesignSpace = field(default_factory=DesignSpace)
    task: CrawlingTask = field(default_factory=CrawlingTask)
    objective: Objective = field(default_factory=Objective)
    """How distances in several worlds become one score; if it asks for one world, the nominal world
    is used. Of its options --objective.centring-rounds has no effect."""
    finalist_count: Count = 24
    """Number of pairs that walk in the worlds of a final evaluation, if candidates walked in
    several; at least one for each searched design."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_worlds_fit(self.environment_count, self.objective)


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
        folder: Receives ``search.jsonl``, ``learning_curve.json`` and the best gaits; a search that
            is there already goes on.
        learned: A coopt run whose best designs are searched as well and whose policy and pairs
            stand beside, in the same worlds as what is found; task, space and objective of the
            settings must be its own.
        randomisation: What worlds are drawn from where the objective asks for several; None for
            those of the measured physics.

    Raises:
        ArtefactError: The run is damaged.
        FileNotFoundError: The run has lost its policy.
        ValueError: The folder holds a search of other settings, designs count as one that the
            goal or the start tells apart, no design uses one of the regulators, or the robot cannot
            be in the worlds (as of `check_worlds`).
    """
    start = time.monotonic()
    task, space = settings.task, settings.space
    own_task = own_task_notes(None if learned is None else learned.own_task, task.goal)
    for told in own_task:
        folder.progress.say(told)
    check_space(robot, space)
    poses = [site.pose for site in robot.sites]
    check_equal_designs(space, task.goal, poses=poses)
    check_equal_starts(space, robot.physics.start, poses)
    check_equal_grounds(space, robot.physics, poses)
    lost = lost_mirror_note(space, robot.physics.start, robot.allowed_designs)
    before = () if lost is None else (lost,)
    for note in before:
        folder.progress.say(note)
    robot.physics.air.check_supply(task.maximum_pressure_kPa)
    say_unseen_pressure(robot, task.maximum_pressure_kPa, folder.progress.say)
    objective, worlds = settings.objective, None
    idle: tuple[str, ...] = ()
    if objective.is_robust:
        drawn = measured_worlds() if randomisation is None else randomisation
        check_worlds(robot, drawn)
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
    designs = _designs(settings, learned) if gaits else {}
    if (long := _long_generation(settings, designs)) is not None:
        folder.progress.say(long)
    # Before the search, which takes hours: a run that lost its policy ends here.
    by_policy, without = policy_pairs(environment, space, learned, list(designs), folder, objective)
    action_s = task.action_s(robot.physics.time_step_s)
    own = own_pairs(environment, space, learned, list(designs), action_s, folder, objective)
    folder.progress.stage(f"searching ({settings.method})")
    found = run_search(
        _searcher(settings, list(designs)),
        environment,
        space,
        _timesteps(settings, len(designs)),
        folder.path,
        objective=objective,
        finalist_count=max(settings.finalist_count, len(designs)),
        every_design=gaits,
        description=_description(settings, robot, list(designs), worlds),
        progress=folder.progress,
    )
    _write_curve(folder, found, action_s, task.goal)
    gait_files = _GaitFiles(folder, space, task, action_s)
    pairs: tuple[FoundPair, ...] | None = None
    rows: tuple[DesignsBestGait, ...] | None = None
    if gaits:
        walked = [pair for design in designs if (pair := found.best.get(design)) is not None]
        rows = _rows(designs, found, gait_files, by_policy, own)
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
        policy_gaps=None if rows is None else _gaps(rows),
        pairs=pairs,
        timesteps=int(found.timesteps[-1]),
        simulated_s=float(found.timesteps[-1]) * action_s,
        notes=(
            *own_task,
            *before,
            *idle,
            *without,
            *same_worlds_note(own, objective),
            *_notes(resumed, int(found.timesteps[-1]), _timesteps(settings, len(designs))),
            *_range_notes(robot, space, task, walked),
        ),
        seed=settings.seed,
        goal=task.goal,
        best_achieved=None if best is None else best.achieved,
        finalist_timesteps=found.finalist_timesteps,
        **robot.describe(reduced=False),
        wall_s=time.monotonic() - start,
        status=status_of(walked or None),
    )


def _long_generation(settings: SearchSettings, designs: Mapping[int, str]) -> str | None:
    """What to say, before anything walks, of a limit that the first generation goes beyond; None of
    others."""
    gaits = settings.method == "gaits"
    population = getattr(settings, settings.method).population
    count = population * (len(designs) if gaits else 1)
    worlds, actions = settings.objective.worlds_at(0), settings.task.action_count
    least, asked = count * worlds * actions, _timesteps(settings, len(designs))
    if least <= asked:
        return None
    drawn = f"--random-design-count 0 in place of {settings.random_design_count}, "
    return (
        f"{least} timesteps will be made at least, and {asked} are asked for: one generation is of "
        f"{count} candidates, each of {actions} actions in {worlds} world{'s'[: worlds > 1]}; for "
        f"fewer: {drawn if gaits and settings.random_design_count else ''}"
        f"--{settings.method}.population, now {population}, or --task.action-count"
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


def _timesteps(settings: SearchSettings, design_count: int) -> int:
    if settings.timesteps is not None or settings.method != "gaits":
        return settings.timesteps or _TIMESTEPS
    worlds = settings.objective.worlds_per_design
    return design_count * _GAITS_OF_EACH_DESIGN * worlds * settings.task.action_count


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


def _designs(settings: SearchSettings, learned: FinishedRun | None) -> dict[int, str]:
    """Designs whose gaits are searched, and why each is among them."""
    space, chosen = settings.space, dict[int, str]()
    usual = Design.parse(settings.usual_design)
    asked = [(str(usual), "expert's design")] if _is_one_of(space, usual) else []
    if learned is not None:
        pairs = learned.pairs(PAIRS_OF_RUN)
        asked += [(str(pair.design), f"L{rank}") for rank, pair in enumerate(pairs, 1)]
    asked += [(design, "asked for") for design in settings.designs]
    for text, why in asked:
        chosen.setdefault(space.index(Design.parse(text)), why)
    # A stream of its own: which designs are drawn does not depend on the others.
    rng = np.random.default_rng([settings.seed, 1])
    drawn = (
        rng.permutation(len(space))[: settings.random_design_count]
        if space.is_listed
        else space.drawn(settings.random_design_count, rng)
    )
    for design in drawn:
        chosen.setdefault(int(design), "drawn at random")
    return chosen


def _is_one_of(space: DesignSpace, design: Design) -> bool:
    try:
        _ = space.index(design)
    except ValueError:
        return False
    return True


def _searcher(settings: SearchSettings, designs: list[int]) -> Searcher:
    space, task = settings.space, settings.task
    if settings.method == "gaits":
        return GaitSearch(designs, task, settings.gaits, settings.seed)
    if settings.method == "random":
        return RandomSearch(space, task, settings.random, settings.seed)
    return GeneticAlgorithm(space, task, settings.genetic, settings.seed)


@dataclass(frozen=True)
class _GaitFiles:
    folder: RunFolder
    space: DesignSpace
    task: CrawlingTask
    action_s: float

    def write(self, design: int, pair: DesignGaitPair | None) -> FoundPair:
        """Write the gait of a pair, and return what is said of it."""
        name = str(self.space[design])
        if pair is None:
            return FoundPair(name, None, None, None)
        file = f"gaits/{name}.csv"
        pair.write(self.folder / file, self.space[design], self.action_s, self.task)
        return FoundPair(name, pair.distance_cm, file, pair.timestep, pair.score_cm, pair.achieved)


def _rows(
    designs: Mapping[int, str],
    found: SearchResult,
    gait_files: _GaitFiles,
    by_policy: Mapping[int, DesignGaitPair],
    of_run: Mapping[int, DesignGaitPair],
) -> tuple[DesignsBestGait, ...]:
    rows = []
    for design, why in designs.items():
        best = gait_files.write(design, found.best.get(design))
        policy, own = by_policy.get(design), of_run.get(design)
        rows.append(
            DesignsBestGait(
                **asdict(best),
                why=why,
                late_gain_cm=found.late_gain_cm.get(design),
                policy_distance_cm=None if policy is None else policy.distance_cm,
                learned_distance_cm=None if own is None else own.distance_cm,
                policy_achieved=None if policy is None else policy.achieved,
                learned_achieved=None if own is None else own.achieved,
            )
        )
    return tuple(rows)


def _score(pair: FoundPair) -> float:
    return -np.inf if pair.score_cm is None else pair.score_cm


def _gaps(rows: Sequence[DesignsBestGait]) -> dict[str, PolicyGap]:
    groups: dict[str, list[float]] = {}
    for row in rows:
        if row.achieved is not None and row.policy_achieved is not None:
            group = "best pairs" if row.why.startswith("L") else row.why
            groups.setdefault(group, []).append(row.achieved - row.policy_achieved)
    return {
        group: PolicyGap(len(gaps), float(np.mean(gaps)), max(gaps))
        for group, gaps in groups.items()
    }


def _write_curve(folder: RunFolder, found: SearchResult, action_s: float, goal: Goal) -> None:
    curve = SearchCurve(
        tuple(found.timesteps.tolist()),
        tuple((found.timesteps * action_s).tolist()),
        tuple(found.best_achieved.tolist()),
        goal,
    )
    write_json(folder / CURVE_FILE, result_to_dict(curve))
