"""What a search leaves: gaits, what each design's own has beyond learned ones, and its curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.goal import Goal
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.search_run import CURVE_FILE, SearchResult
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.search_findings import DesignsBestGait, FoundPair, PolicyGap, SearchCurve


@dataclass(frozen=True)
class GaitFiles:
    """Writes the gaits that a search found."""

    folder: RunFolder
    space: DesignSpace
    task: CrawlingTask
    action_s: float
    """How long an action is held [s]."""

    def write(self, design: int, pair: DesignGaitPair | None) -> FoundPair:
        """Write the gait of a pair, and return what is said of it.

        Args:
            design: Index of the design in the space.
            pair: The design with its gait; None where none walked, of which nothing is written.
        """
        name = str(self.space[design])
        if pair is None:
            return FoundPair(name, None, None, None)
        file = f"gaits/{name}.csv"
        pair.write(self.folder / file, self.space[design], self.action_s, self.task)
        return FoundPair(name, pair.distance_cm, file, pair.timestep, pair.score_cm, pair.achieved)


def best_gaits(
    designs: Mapping[int, str],
    found: SearchResult,
    gait_files: GaitFiles,
    by_policy: Mapping[int, DesignGaitPair],
    of_run: Mapping[int, DesignGaitPair],
) -> tuple[DesignsBestGait, ...]:
    """Write the best gait of each design, and return what is said of it beside learned ones.

    Args:
        designs: Why each is among them, by their indices in the space.
        found: What the search found.
        gait_files: Where gaits are written.
        by_policy: What a run's one policy does with designs, by their indices.
        of_run: The run's own pairs, by their designs' indices.
    """
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


def policy_gaps(rows: Sequence[DesignsBestGait]) -> dict[str, PolicyGap]:
    """How much more own gaits achieve than the shared policy does, by why a design is among them;
    without designs that one of them does not carry to the end."""
    groups: dict[str, list[float]] = {}
    for row in rows:
        if row.achieved is not None and row.policy_achieved is not None:
            group = "best pairs" if row.why.startswith("L") else row.why
            groups.setdefault(group, []).append(row.achieved - row.policy_achieved)
    return {
        group: PolicyGap(len(gaps), float(np.mean(gaps)), max(gaps))
        for group, gaps in groups.items()
    }


def write_curve(folder: RunFolder, found: SearchResult, action_s: float, goal: Goal) -> None:
    """Write the best of a search over its time.

    Args:
        folder: Receives ``learning_curve.json``.
        found: What the search found.
        action_s: How long an action is held [s].
        goal: What is asked of robots.
    """
    curve = SearchCurve(
        tuple(found.timesteps.tolist()),
        tuple((found.timesteps * action_s).tolist()),
        tuple(found.best_achieved.tolist()),
        goal,
    )
    write_json(folder / CURVE_FILE, result_to_dict(curve))
