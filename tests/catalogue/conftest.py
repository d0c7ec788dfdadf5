"""Robots' files with one mistake, for tests of several files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.published_plate import published_plate

PLATE = Path(__file__).parent.parent.parent / "examples" / "plate.toml"
Edited = Callable[[str, str], Path]


@pytest.fixture
def edited(tmp_path: Path) -> Edited:
    """Write the plate's file with one text replaced by another."""

    def edit(old: str, new: str) -> Path:
        text = PLATE.read_text()
        assert old in text
        path = tmp_path / "edited.toml"
        path.write_text(text.replace(old, new))
        return path

    return edit


@pytest.fixture
def edited_published(tmp_path: Path) -> Edited:
    """The same of the plate in the published physics."""

    def edit(old: str, new: str) -> Path:
        text = published_plate()
        assert old in text
        path = tmp_path / "edited.toml"
        path.write_text(text.replace(old, new))
        return path

    return edit
