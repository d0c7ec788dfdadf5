"""What a search is asked for: its settings, and the designs and timesteps that follow from them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.learn.gait_search import GaitSearchSettings
from pneumorph.learn.genetic_algorithm import GeneticSettings
from pneumorph.learn.objective import Objective, check_worlds_fit
from pneumorph.learn.random_search import RandomSearchSettings
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.run_beside_search import PAIRS_OF_RUN

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


def searched_designs(settings: SearchSettings, learned: FinishedRun | None) -> dict[int, str]:
    """Designs whose gaits are searched, and why each is among them.

    Args:
        settings: Of the search.
        learned: A run whose best designs are among them; None for none.

    Returns:
        The reasons by the designs' indices in the space.

    Raises:
        ArtefactError: The run is damaged.
        ValueError: A design that is asked for is none of the space.
    """
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


def asked_timesteps(settings: SearchSettings, design_count: int) -> int:
    """Actions of all robots together that a search is asked for.

    Args:
        settings: Of the search.
        design_count: Number of designs whose gaits are searched.
    """
    if settings.timesteps is not None or settings.method != "gaits":
        return settings.timesteps or _TIMESTEPS
    worlds = settings.objective.worlds_per_design
    return design_count * _GAITS_OF_EACH_DESIGN * worlds * settings.task.action_count


def long_generation_note(settings: SearchSettings, design_count: int) -> str | None:
    """What to say, before anything walks, of a limit that the first generation goes beyond; None of
    others. Arguments as of `asked_timesteps`."""
    gaits = settings.method == "gaits"
    population = getattr(settings, settings.method).population
    count = population * (design_count if gaits else 1)
    worlds, actions = settings.objective.worlds_at(0), settings.task.action_count
    least, asked = count * worlds * actions, asked_timesteps(settings, design_count)
    if least <= asked:
        return None
    drawn = f"--random-design-count 0 in place of {settings.random_design_count}, "
    return (
        f"{least} timesteps will be made at least, and {asked} are asked for: one generation is of "
        f"{count} candidates, each of {actions} actions in {worlds} world{'s'[: worlds > 1]}; for "
        f"fewer: {drawn if gaits and settings.random_design_count else ''}"
        f"--{settings.method}.population, now {population}, or --task.action-count"
    )
