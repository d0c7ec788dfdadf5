"""A replay as one HTML file, or as a fragment of another page; no network in either.

The 3D is three.js, which the package jupyter-threejs-sage carries as one minified file (SageMath's
own build, MIT, 1 MB, no dependencies, files named by release). Looked at instead: viser (its
offline player shows a scene but no charts on its time line, and its positions cannot be read back),
k3d (2.6 MB of script, no way to its three.js), pythreejs (no release since 2023, Jupyter only),
nicegui (three.js inside a web framework), trimesh (three.js inside a zipped template).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.report.film import side_by_side
from pneumorph.report.marker_actor import TRIAD_COLOURS, MarkerActor
from pneumorph.report.page import document, write_html
from pneumorph.report.replay.replay_data import ReplaySettings, replay_data
from pneumorph.report.scene import Actor
from pneumorph.report.style import DISK_COLOUR, INK_COLOUR, PATH_COLOURS, REGULATOR_COLOURS
from pneumorph.trajectory import Trajectory

_SCRIPTS = ("motion.js", "stage.js", "time_line.js", "player.js")
_THREE = ("static", "r130", "three.min.js")


def write_replay(
    path: Path | str,
    actors: Sequence[Actor | MarkerActor],
    settings: ReplaySettings | None = None,
    title: str = "Replay",
) -> Path:
    """Write a page that replays robots and needs nothing but itself.

    Args:
        path: The HTML file.
        actors: The robots; see `pneumorph.report.film.side_by_side` for their lanes.
        settings: How exact.
        title: Of the page.

    Raises:
        ValueError: No robot, or one whose positions are not finite.
    """
    return write_html(path, page_of(title, replay_fragment(actors, settings)))


def write_side_by_side(
    path: Path, walks: Mapping[str, Path], title: str, goal: Goal = FORWARD
) -> Path | None:
    """Write a page that replays recorded walks, each robot in a lane of its own.

    Args:
        path: The HTML file.
        walks: Trajectory files by what to write beside each; missing ones, and those of legs
            without a skin, are left out.
        title: Of the page.
        goal: What of the walks is told.

    Returns:
        The page, or None where there is nothing to show.
    """
    found = {label: Trajectory.load(file) for label, file in walks.items() if file.exists()}
    actors = [
        Actor.of(walk, label, goal)
        for label, walk in found.items()
        if walk.skin_triangles is not None
    ]
    return write_replay(path, side_by_side(actors), title=title) if actors else None


def replay_fragment(
    actors: Sequence[Actor | MarkerActor], settings: ReplaySettings | None = None
) -> str:
    """Return the HTML of one player with its robots, for a page that holds `replay_assets` once.

    Args:
        actors: The robots.
        settings: How exact; a report page does well with a frame_interval_s of 0.2.

    Raises:
        ValueError: As `replay_data`.
    """
    return player_of(replay_data(actors, settings))


def player_of(data: dict[str, Any], told: str = "") -> str:
    """Return the HTML of a player of `replay_data`, for a page that holds `replay_assets` once.

    A page may as well mount players itself:
    ``pneumorphReplay.mount(element, data, {robots: [17]})`` shows some of the robots of ``data``.

    Args:
        data: The robots.
        told: What is said once of all of them.
    """
    options = f", {script_json({'told': told})}" if told else ""
    return (
        '<div class="pneumorph-replay"></div><script>pneumorphReplay.mount('
        f"document.currentScript.previousElementSibling, {script_json(data)}{options});</script>"
    )


def replay_assets() -> str:
    """Return style and scripts that a page with players needs once, before the first of them."""
    colours = {
        "regulators": REGULATOR_COLOURS,
        "paths": PATH_COLOURS,
        "triad": TRIAD_COLOURS,
        "disk": DISK_COLOUR,
        "ink": INK_COLOUR,
    }
    own = "\n".join(map(player_script, _SCRIPTS))
    # Each in its own element: an error in one is reported at its own line.
    return (
        f"<style>{player_script('player.css')}</style>\n<script>{_three()}</script>\n"
        f"<script>\nvar pneumorphColours = {script_json(colours)};\n{own}</script>"
    )


def page_of(title: str, body: str) -> str:
    """Return a whole page that fills the window with a player."""
    return document(title, replay_assets(), body, "pneumorph-replay-page")


def player_script(name: str) -> str:
    """Return a file of the player."""
    return files("pneumorph.report.replay").joinpath("player", name).read_text(encoding="utf-8")


def script_json(value: Any) -> str:
    """Return JSON that may stand inside a script element."""
    return json.dumps(value, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")


def _three() -> str:
    """Return three.js.

    Raises:
        ImportError: The package that carries it is missing.
    """
    try:
        script = files("jupyter_threejs_sage").joinpath(*_THREE)
    except ModuleNotFoundError as error:
        raise ImportError(
            "a replay needs three.js from the package jupyter-threejs-sage, which is not "
            "installed; pip install jupyter-threejs-sage"
        ) from error
    return script.read_text(encoding="utf-8")
