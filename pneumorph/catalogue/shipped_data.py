"""Files that ship with the package."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def data_file(name: str) -> Path:
    """Path of a file that ships with the package.

    Raises:
        FileNotFoundError: This installation lacks it.
    """
    path = Path(str(files("pneumorph").joinpath("data", name)))
    if not path.exists():
        raise FileNotFoundError(f"{path} does not ship with this installation of pneumorph")
    return path


def data_folder(name: str) -> Path:
    """Path of a folder that ships with the package; it may be empty or missing."""
    return Path(str(files("pneumorph").joinpath("data", name)))
