"""Search for gaits or designs without learning a policy, to see how good the learned ones are.

--method gaits looks for the best gait of each design alone, by CMA-ES over all numbers of the gait:
of the expert's design, of a coopt run's best pairs (--run), of --designs, and of designs drawn at
random. With --run the policy's own distance stands beside each. --method random and --method
genetic search designs and gaits together, with as much simulated time as a coopt run of equal
--timesteps; their learning curves compare with its own. All robots walk side by side in the reduced
model. A stopped search goes on with the same --out.

Writes search.jsonl, learning_curve.json and the best gaits as gaits/DESIGN.csv.

Example: pneumorph search --method genetic --timesteps 1000000 --out runs/genetic
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro

from pneumorph.artefact import write_json
from pneumorph.command.coopt import TRAINING_FOLDER
from pneumorph.command.learned_run import LearnedRun, read_learned_run
from pneumorph.command.robots import RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder, read_settings
from pneumorph.command.verb import Verb
from pneumorph.coopt.cooptimise import POLICY_FILE
from pneumorph.coopt.design_gait_pair import DesignGaitPair
from pneumorph.coopt.evaluation import evaluate_policy
from pneumorph.coopt.policy_file import load_policy
from pneumorph.coopt.sac import Sac
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.expert_gait import BASELINE_DESIGN
from pneumorph.gait.gait_file import write_gait
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.search.gait_search import GaitSearch, GaitSearchSettings
from pneumorph.search.genetic_algorithm import GeneticAlgorithm, GeneticSettings
from pneumorph.search.random_search import RandomSearch, RandomSearchSettings
from pneumorph.search.search_run import SearchResult, run_search
from pneumorph.search.searcher import Searcher
from pneumorph.settings import settings_from_dict, settings_to_dict

flat = tyro.conf.arg(name="")

_GAITS_OF_EACH_DESIGN = 960
_TIMESTEPS = 1_000_000
CURVE_FILE = "learning_curve.json"


@dataclass(frozen=True)
class SearchOptions:
    """What is searched, and for how long."""

    method: Literal["gaits", "random", "genetic"] = "gaits"
    """The best gait of each design, or designs and gaits together."""
    run: Path | None = None
    """A coopt run, whose robots, task and space are taken over."""
    designs: tuple[str, ...] = ()
    """More designs whose gaits are searched."""
    random_design_count: int = 30
    """Designs drawn at random whose gaits are searched."""
    timesteps: int | None = None
    """Actions of all robots together; by default one million, and for gaits 960 of each design."""
    seed: int = 0
    """Seed of every random number."""
    environment_count: int = 96
    """Robots simulated side by side."""
    kept_pair_count: int = 5
    """Best pairs reported by a search of designs."""
    gaits: GaitSearchSettings = field(default_factory=GaitSearchSettings)
    random: RandomSearchSettings = field(default_factory=RandomSearchSettings)
    genetic: GeneticSettings = field(default_factory=GeneticSettings)
    space: DesignSpace = field(default_factory=DesignSpace)
    task: CrawlingTask = field(default_factory=CrawlingTask)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    def __post_init__(self) -> None:
        for name, least in (
            ("random_design_count", 0),
            ("timesteps", 1),
            ("seed", 0),
            ("environment_count", 1),
            ("kept_pair_count", 1),
        ):
            value = getattr(self, name)
            if value is not None and value < least:
                raise ValueError(f"{name} is {value}, expected at least {least}")


def search(options: SearchOptions, folder: RunFolder) -> dict[str, Any]:
    """Search, and return the best of each design or of all."""
    start = time.monotonic()
    learned = None if options.run is None else read_learned_run(options.run, options.robot)
    task, space = options.task, options.space
    if learned is not None:
        task = learned.task
        space = settings_from_dict(DesignSpace, read_settings(learned.folder)["coopt"]["space"])
    workshop = Workshop(options.robot if learned is None else learned.robot)
    environment = CrawlingEnvironment(
        [space[place % len(space)] for place in range(options.environment_count)],
        workshop.robot,
        workshop.simulator,
        task,
    )
    gaits = options.method == "gaits"
    designs = _designs(options, learned, space) if gaits else {}
    # Before the search, which takes hours: a run that lost its policy ends here.
    policy_cm = _policy_distances(environment, space, learned, list(designs), folder)
    searcher = _searcher(options, space, task, list(designs))
    timesteps = options.timesteps or _TIMESTEPS
    if gaits and options.timesteps is None:
        timesteps = len(designs) * _GAITS_OF_EACH_DESIGN * task.action_count
    folder.progress.stage(f"searching ({options.method})")
    found = run_search(
        searcher,
        environment,
        space,
        timesteps,
        folder.path,
        description={
            **{name: settings_to_dict(options)[name] for name in ("method", "seed", "gaits",
                                                                  "random", "genetic")},
            "designs": [str(space[design]) for design in designs],
            "space": settings_to_dict(space),
            "task": settings_to_dict(task),
            "simulation": settings_to_dict(workshop.simulation),
            "leg": workshop.leg.digest(),
        },
        progress=folder.progress,
    )  # fmt: skip
    action_s = task.action_step_count * workshop.simulation.time_step_s
    _write_curve(folder, found, action_s)
    if gaits:
        learned_cm = _learned_distances(learned)
        rows = [
            {**_described(found.best.get(design), space, action_s, task, folder),
             "design": str(space[design]), "why": why,
             "late_gain_cm": found.late_gain_cm.get(design),
             "policy_distance_cm": policy_cm.get(design),
             "learned_distance_cm": learned_cm.get(str(space[design]))}
            for design, why in designs.items()
        ]  # fmt: skip
        result = {"designs": rows, "policy_gaps_cm": _gaps(rows)}
        walked = [row for row in rows if row["distance_cm"] is not None]
        best = max(walked or rows, key=lambda row: row["distance_cm"] or 0.0)
    else:
        ranked = found.ranked(space)[: options.kept_pair_count]
        rows = [_described(pair, space, action_s, task, folder) for pair in ranked]
        result = {"pairs": rows}
        best = rows[0] if rows else {"design": None, "distance_cm": None}
    return {
        "method": options.method,
        "best_design": best["design"],
        "best_distance_cm": best["distance_cm"],
        **result,
        "timesteps": int(found.timesteps[-1]),
        "simulated_s": float(found.timesteps[-1]) * action_s,
        "notes": [f"resumed at timestep {found.resumed_timesteps}"]
        if found.resumed_timesteps
        else [],
        "seed": options.seed,
        "damping": workshop.simulation.damping,
        "calibration": workshop.calibration_description,
        "wall_s": time.monotonic() - start,
    }


def _designs(
    options: SearchOptions, learned: LearnedRun | None, space: DesignSpace
) -> dict[int, str]:
    """Designs whose gaits are searched, and why each is among them."""
    chosen: dict[int, str] = {}
    expert = Design.parse(BASELINE_DESIGN)
    asked = [(BASELINE_DESIGN, "expert's design")] if expert.canonical() in space else []
    if learned is not None:
        asked += [(str(design), f"L{rank}") for rank, design in enumerate(learned.designs, start=1)]
    asked += [(design, "asked for") for design in options.designs]
    for text, why in asked:
        chosen.setdefault(space.index(Design.parse(text)), why)
    # A stream of its own: which designs are drawn does not depend on the others.
    drawn = np.random.default_rng([options.seed, 1]).permutation(len(space))
    for design in drawn[: options.random_design_count]:
        chosen.setdefault(int(design), "drawn at random")
    return chosen


def _searcher(
    options: SearchOptions, space: DesignSpace, task: CrawlingTask, designs: list[int]
) -> Searcher:
    if options.method == "gaits":
        return GaitSearch(designs, task, options.gaits, options.seed)
    if options.method == "random":
        return RandomSearch(space, task, options.random, options.seed)
    return GeneticAlgorithm(space, task, options.genetic, options.seed)


def _policy_distances(
    environment: CrawlingEnvironment,
    space: DesignSpace,
    learned: LearnedRun | None,
    designs: list[int],
    folder: RunFolder,
) -> dict[int, float]:
    """How far the run's one policy carries each design without noise [cm]."""
    if learned is None or not designs:
        return {}
    folder.progress.stage("walking the designs with the learned policy")
    policy, settings, _ = load_policy(learned.folder / TRAINING_FOLDER / POLICY_FILE)
    learner = Sac(
        settings.task.state_size + space.one_hot.shape[1],
        settings.task.regulator_count,
        settings.sac,
    )
    pairs = evaluate_policy(
        environment, space, policy, learner, np.array(designs), progress=folder.progress
    )
    return {pair.design: pair.distance_cm for pair in pairs}


def _learned_distances(learned: LearnedRun | None) -> dict[str, float]:
    """How far the run's own pairs came, each with the policy that was fine-tuned for it [cm]."""
    return {} if learned is None else {p["design"]: p["distance_cm"] for p in learned.pairs}


def _described(
    pair: DesignGaitPair | None,
    space: DesignSpace,
    action_s: float,
    task: CrawlingTask,
    folder: RunFolder,
) -> dict[str, Any]:
    """What a summary says of a pair, whose gait is written."""
    if pair is None:
        return {"distance_cm": None, "gait": None, "timestep": None}
    name = f"gaits/{space[pair.design]}.csv"
    comments = {
        "design": str(space[pair.design]),
        "distance_cm": f"{pair.distance_cm:.3f}",
        "source": pair.source,
    }
    write_gait(folder / name, pair.gait(action_s, task), comments)
    return {
        "design": str(space[pair.design]),
        "distance_cm": pair.distance_cm,
        "gait": name,
        "timestep": pair.timestep,
    }


def _gaps(rows: list[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """How much further designs' own gaits carry them than the shared policy does [cm], by group."""
    groups: dict[str, list[float]] = {}
    for row in rows:
        if row["distance_cm"] is not None and row["policy_distance_cm"] is not None:
            group = "best pairs" if row["why"].startswith("L") else row["why"]
            gap = row["distance_cm"] - row["policy_distance_cm"]
            groups.setdefault(group, []).append(gap)
    return {
        group: {"count": len(gaps), "mean": float(np.mean(gaps)), "largest": max(gaps)}
        for group, gaps in groups.items()
    }


def _write_curve(folder: RunFolder, found: SearchResult, action_s: float) -> None:
    content = {
        "timesteps": found.timesteps.tolist(),
        "simulated_s": (found.timesteps * action_s).tolist(),
        "best_distance_cm": found.best_distance_cm.tolist(),
    }
    write_json(folder / CURVE_FILE, content)


VERB = Verb(SearchOptions, search)
