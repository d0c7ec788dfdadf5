"""The explorer's page: every design of a space in one HTML file that needs no network."""

from __future__ import annotations

import html
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.report.explorer.scored_designs import ScoredDesigns
from pneumorph.report.film import side_by_side
from pneumorph.report.page import document, write_html
from pneumorph.report.plan import PlanOf, paper_plan
from pneumorph.report.replay.page import replay_assets, script_json
from pneumorph.report.replay.replay_data import ReplaySettings, replay_data
from pneumorph.report.scene import Actor
from pneumorph.report.style import INK_COLOUR, regulator_colour
from pneumorph.robot.design import Design, Fitting
from pneumorph.robot.design_space import DesignSpace


def write_explorer(
    path: Path | str,
    scored: ScoredDesigns,
    title: str,
    command: str,
    replay: ReplaySettings,
    plan_of: PlanOf = paper_plan,
) -> Path:
    """Write the page.

    Args:
        path: The HTML file.
        scored: The designs.
        title: Of the page.
        command: What walks a design that has no trajectory; DESIGN stands for its name.
        replay: How exact replays are.
        plan_of: What a design looks like from above.
    """
    folder = files("pneumorph.report.explorer")
    data = explorer_data(scored, command, replay, plan_of)
    assets = replay_assets() if data["replay"] else ""
    style, script = (folder.joinpath(f"explorer.{suffix}").read_text() for suffix in ("css", "js"))
    body = f"""<header><h1>{html.escape(title)}</h1><p>{html.escape(scored.meaning)}</p></header>
{folder.joinpath("explorer.html").read_text()}
<script>
const explorerData = {script_json(data)};
{script}</script>"""
    return write_html(path, document(title, f"{assets}<style>{style}</style>", body))


def explorer_data(
    scored: ScoredDesigns, command: str, replay: ReplaySettings, plan_of: PlanOf = paper_plan
) -> dict[str, Any]:
    """Return what the page is told, as JSON values; arguments as of `write_explorer`."""
    space = scored.space
    actors: list[Actor] = []
    robots: dict[int, list[int]] = {}
    for index, walks in scored.trajectories.items():
        place = scored.place(index)
        if place is None:
            continue
        robots[place] = list(range(len(actors), len(actors) + len(walks)))
        actors += side_by_side([Actor.of(each, label, scored.goal) for label, each in walks])
    return {
        "locations": space.location_count,
        "canonical": space.canonical,
        "designs": [str(design) for design in scored.designs],
        "mirror": space.mirror_move,
        "moves": space.symmetry_moves,
        "symmetric": "".join(str(int(same)) for same in scored.is_symmetric),
        "scores": _numbers(scored.score_cm / scored.goal.cm_per_unit, 3),
        "score_name": scored.goal.in_unit("score"),
        "unit": scored.goal.symbol,
        "probability": None if scored.probability is None else _numbers(scored.probability, 7),
        "pairs": {
            scored.place(index): [label, None if np.isnan(distance) else round(distance, 3)]
            for index, (label, distance) in scored.pairs.items()
        },
        "of_pairs": scored.of_pairs,
        "robots": robots,
        "replay": replay_data(actors, replay) if actors else None,
        "command": command,
        "colours": [regulator_colour(number) for number in range(space.regulator_count + 1)],
        "ink": INK_COLOUR,
        "plan": _plan(space, plan_of),
    }


def _plan(space: DesignSpace, plan_of: PlanOf) -> dict[str, Any]:
    """Outlines of the hub, of what it carries, of each module at each location and of where its
    chambers are, as lists of x and y [mm]."""

    def corners(outline: np.ndarray) -> list[list[float]]:
        listed: list[list[float]] = np.round(outline, 1).tolist()
        return listed

    alone = []
    for fittings in space.fittings:
        # Of each kind the one of the most regulators, which tells where each chamber is.
        of_kind = {each.module: each for each in sorted(fittings, key=_regulators_and_kind)}
        alone.append(
            {
                kind: plan_of(Design.of(space.location_count, [each]))
                for kind, each in sorted(of_kind.items())
            }
        )
    every = [plan for of_kind in alone for plan in of_kind.values()]
    return {
        "hub": corners(every[0].hub_mm),
        "payload": None
        if (carried := every[0].payload) is None
        else {"line": corners(carried.line_mm), "ball": corners(carried.outline_mm)},
        "legs": [
            {
                kind: {
                    "outline": corners(plan.legs_mm[0]),
                    "bands": [corners(band) for band in plan.bands_mm[0]]
                    if len(plan.bands_mm[0]) > 1
                    else [],
                }
                for kind, plan in of_kind.items()
            }
            for of_kind in alone
        ],
        "half_width": round(max(1.03 * plan.half_width_mm for plan in every), 1),
    }


def _regulators_and_kind(fitting: Fitting) -> tuple[int, int]:
    return len(fitting.regulators), fitting.module


def _numbers(values: np.ndarray, digits: int) -> list[float | None]:
    """Return rounded numbers, None for NaN: JSON has none."""
    return [None if np.isnan(value) else round(float(value), digits) for value in values]
