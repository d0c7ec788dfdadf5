"""Finished runs written by hand, where a test needs one and not how it came to be."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.gait.gait_file import write_gait
from pneumorph.gait.held_gait import HeldGait


def crawl(action_count: int, seed: int = 0) -> HeldGait:
    """A gait of random pressures, one each second."""
    pressures = np.random.default_rng(seed).uniform(0.0, 90.0, (action_count, 3))
    return HeldGait.evenly(pressures, 1.0)


def write_run(
    folder: Path,
    verb: str,
    options: Any,
    designs: Sequence[str] = (BASELINE_DESIGN,),
    action_count: int = 2,
    **summary: Any,
) -> Path:
    """Write what `pneumorph VERB` leaves of a run that found these designs; return its folder.

    Args:
        folder: Where.
        verb: Which verb made it.
        options: Its settings, or the table that an earlier version made of them.
        designs: One pair each, the furthest first.
        action_count: Seconds of each gait.
        **summary: What else its summary says.
    """
    content = options if isinstance(options, dict) else settings_to_dict(options)
    pairs = []
    for rank, design in enumerate(designs, start=1):
        gait = f"training/gaits/L{rank}.csv"
        write_gait(folder / gait, crawl(action_count, rank), {"design": design})
        pairs.append({"design": design, "gait": gait, "distance_cm": 10.0 - rank})
    write_json(folder / "settings.json", content)
    write_json(folder / "summary.json", {"verb": verb, "pairs": pairs, **summary})
    return folder
