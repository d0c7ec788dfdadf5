"""Write the table of numbers in the README from what the experiments in reproduce/ found.

    python docs/make_numbers.py

A test compares the table with what this file would write, so no number there is typed by hand.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
BEGIN, END = "<!-- numbers: docs/make_numbers.py -->\n", "<!-- end of numbers -->\n"


def number_table() -> str:
    """Return the table as Markdown."""
    paper, gap, fast = (
        json.loads((ROOT / "reproduce" / path).read_text())
        for path in (
            "paper_scale/summary.json",
            "damping_gap/damping_gap.json",
            "fast_schedule/fast.json",
        )
    )
    pairs = paper["pairs"]
    order = [pair["distance_full_order_cm"] for pair in pairs]
    rows = [
        (
            "best pair found by one training over 6972 designs, a million timesteps, reduced robot",
            f"{pairs[0]['distance_cm']:.1f} cm, {paper['times_the_baseline']:.0f} times the "
            "expert's",
            "paper_scale",
        ),
        (
            "the same five pairs as finite elements",
            f"{_listed(order)} cm; reduced {_listed([p['distance_cm'] for p in pairs])}",
            "paper_scale",
        ),
        (
            "the same five pairs with frame-indifferent (`objective`) damping",
            f"{_listed(_distances(gap, 'published', 'other'))} cm",
            "damping_gap",
        ),
        (
            "five pairs learned with frame-indifferent damping, there and in the published physics",
            f"{_listed(_distances(gap, 'objective', 'own'))} and "
            f"{_listed(_distances(gap, 'objective', 'other'))} cm",
            "damping_gap",
        ),
        (
            f"best pair of each of three trainings with {_share(fast):.0f} % of the timesteps",
            f"{_listed([run['best_distance_cm'] for run in fast['runs']])} cm",
            "fast_schedule",
        ),
    ]
    lines = [
        "| 20 s on a plane; published physics unless the row says otherwise | distance "
        "| experiment |",
        "|---|---|---|",
    ]
    lines += [
        f"| {what} | {number} | [{name}](reproduce/{name}/README.md) |"
        for what, number, name in rows
    ]
    return "\n".join(lines) + "\n"


def _share(fast: dict[str, Any]) -> float:
    """Timesteps of a run of preset `fast` as a share of the full run's [%]."""
    (share,) = {round(100.0 * run["share_of_timesteps"]) for run in fast["runs"]}
    return share


def _listed(distances_cm: list[float]) -> str:
    return ", ".join(f"{distance:.1f}" for distance in distances_cm)


def _distances(gap: dict[str, Any], trained: str, damping: str) -> list[float]:
    """Distances [cm] of the pairs of one training under its own or the other damping."""
    return [pair[f"{damping}_distance_cm"] for pair in gap[trained]["pairs"]]


def with_numbers(readme: str) -> str:
    """Return the README with the table as it is now.

    Raises:
        ValueError: The README has no place for it.
    """
    if BEGIN not in readme or END not in readme:
        raise ValueError(f"the README lacks {BEGIN.strip()} or {END.strip()}")
    head, rest = readme.split(BEGIN)
    return head + BEGIN + number_table() + END + rest.split(END)[1]


if __name__ == "__main__":
    path = ROOT / "README.md"
    path.write_text(with_numbers(path.read_text()))
    print(f"wrote {path}")
