"""The plate of the examples in the published physics, whose steps cost a fraction."""

from __future__ import annotations

from pathlib import Path

PLATE = Path(__file__).parents[2] / "examples" / "plate.toml"


def published_plate() -> str:
    """What is in its file."""
    return PLATE.read_text().replace('"measured"', '"published"')
