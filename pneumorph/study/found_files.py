"""Files that a run's settings name, found again from any folder.

Settings name files as they were given, relative to where the run was made. From elsewhere, or when
the run and its files were moved together, a file is looked for beside the run and in the folders
above it.
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
        The same, with another path for each file that is not where it is named and was found.
    """
    found = dict(settings)
    for place in _PLACES:
        found = _replaced(found, place, run.absolute())
    return found


def _replaced(content: Any, place: tuple[str, ...], run: Path) -> Any:
    """The content with what stands at a place looked for."""
    if not place:
        return [_found(each, run) for each in content] if isinstance(content, list) else _found(
            content, run
        )  # fmt: skip
    if not isinstance(content, Mapping) or place[0] not in content:
        return content
    return {**content, place[0]: _replaced(content[place[0]], place[1:], run)}


def _found(path: Any, run: Path) -> Any:
    if not isinstance(path, str) or Path(path).is_absolute() or Path(path).exists():
        return path
    above = (folder / path for folder in (run, *run.parents))
    return next((str(each) for each in above if each.exists()), path)
