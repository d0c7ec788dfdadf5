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
from pneumorph.report.plan_view import (
    DISK_RADIUS_MM,
    HALF_WIDTH_MM,
    LEG_CENTRE_MM,
    LEG_LENGTH_MM,
    LEG_WIDTH_MM,
)
from pneumorph.report.replay.page import replay_assets, script_json
from pneumorph.report.replay.replay_data import ReplaySettings, replay_data
from pneumorph.report.scene import Actor
from pneumorph.report.style import DISK_COLOUR, INK_COLOUR, REGULATOR_COLOURS


def write_explorer(
    path: Path | str,
    scored: ScoredDesigns,
    title: str,
    command: str,
    replay: ReplaySettings,
) -> Path:
    """Write the page.

    Args:
        path: The HTML file.
        scored: The designs.
        title: Of the page.
        command: What walks a design that has no trajectory; DESIGN stands for its name.
        replay: How exact replays are.

    Raises:
        ValueError: More regulators than there are digits or colours.
    """
    folder = files("pneumorph.report.explorer")
    data = explorer_data(scored, command, replay)
    assets = replay_assets() if data["replay"] else ""
    style, script = (folder.joinpath(f"explorer.{suffix}").read_text() for suffix in ("css", "js"))
    body = f"""<header><h1>{html.escape(title)}</h1><p>{html.escape(scored.meaning)}</p></header>
{folder.joinpath("explorer.html").read_text()}
<script>
const explorerData = {script_json(data)};
{script}</script>"""
    return write_html(path, document(title, f"{assets}<style>{style}</style>", body))


def explorer_data(scored: ScoredDesigns, command: str, replay: ReplaySettings) -> dict[str, Any]:
    """Return what the page is told, as JSON values; arguments as of `write_explorer`."""
    space = scored.space
    if space.regulator_count > len(REGULATOR_COLOURS):
        raise ValueError(
            f"the space has {space.regulator_count} regulators, expected at most "
            f"{len(REGULATOR_COLOURS)}: the explorer has no more colours"
        )
    actors: list[Actor] = []
    robots: dict[int, list[int]] = {}
    for index, walks in scored.trajectories.items():
        robots[index] = list(range(len(actors), len(actors) + len(walks)))
        actors += side_by_side([Actor.of(trajectory, label) for label, trajectory in walks])
    return {
        "locations": space.location_count,
        "canonical": space.canonical,
        "designs": ["".join(map(str, design.assignment)) for design in space],
        "symmetric": "".join(
            str(int(mirror == index)) for index, mirror in enumerate(space.mirror_index)
        ),
        "score_cm": _numbers(scored.score_cm, 3),
        "probability": None if scored.probability is None else _numbers(scored.probability, 7),
        "pairs": {
            index: [label, None if np.isnan(distance) else round(distance, 3)]
            for index, (label, distance) in scored.pairs.items()
        },
        "robots": robots,
        "replay": replay_data(actors, replay) if actors else None,
        "command": command,
        "colours": [DISK_COLOUR, *REGULATOR_COLOURS],
        "ink": INK_COLOUR,
        "shape_mm": {
            "disk_radius": DISK_RADIUS_MM,
            "leg_length": float(LEG_LENGTH_MM),
            "leg_centre": float(LEG_CENTRE_MM),
            "leg_width": LEG_WIDTH_MM,
            "half_width": HALF_WIDTH_MM,
        },
    }


def _numbers(values: np.ndarray, digits: int) -> list[float | None]:
    """Return rounded numbers, None for NaN: JSON has none."""
    return [None if np.isnan(value) else round(float(value), digits) for value in values]
