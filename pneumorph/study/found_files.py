"""Files that a run's settings name, found again from any folder.

Settings name files as they were given, relative to where the run was made. They are looked for
beside the run and in the folders above it, where they are also after run and files were moved
together, and then where the program runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

_PLACES = (
    ("robot", "described"),
    ("robot", "part"),
    ("robot", "calibration"),
    ("robot", "full", "mesh"),
    ("robot", "physics", "ground", "map", "path"),
    ("randomisation", "reductions"),
)


def with_found_files(settings: Mapping[str, Any], run: Path) -> dict[str, Any]:
    """Settings whose files are there, as far as they are found.

    Args:
        settings: Those of the run, as nested dictionaries.
        run: Its folder.

    Returns:
        The same, with another path for each file that was found and is not where it is named.
    """
    found = dict(settings)
    for place in _PLACES:
        found = _replaced(found, place, run.absolute())
    return found


def _replaced(content: Any, place: tuple[str, ...], run: Path) -> Any:
    """The content with what stands at a place looked for."""
    if not place:
        several = isinstance(content, list)
        return [_found(each, run) for each in content] if several else _found(content, run)
    if not isinstance(content, Mapping) or place[0] not in content:
        return content
    return {**content, place[0]: _replaced(content[place[0]], place[1:], run)}


def _found(path: Any, run: Path) -> Any:
    if not isinstance(path, str) or Path(path).is_absolute():
        return path
    above = (folder / path for folder in (run, *run.parents))
    found = next((each for each in above if each.is_file()), None)
    if found is None or (Path(path).is_file() and found.samefile(path)):
        return path
    return str(found)
