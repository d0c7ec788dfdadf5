"""Write the tables of numbers in the README and docs/results.md from what reproduce/ found.

    python docs/make_numbers.py

A test compares the tables with what this file would write, so no number there is typed by hand.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent


def measured_table() -> str:
    """Return the table of the robot for worlds that nobody has measured, as Markdown."""
    found, certificate = (
        json.loads((ROOT / "reproduce/robust" / name).read_text())
        for name in ("summary.json", "certificate.json")
    )
    expert, first = certificate["expert"], found["seeds"][0]  # the certified run comes first
    lines = [
        f"| 20 s in {found['world_count']} worlds of the measured physics that training never saw, "
        "reduced robots | median | 80 % of the worlds | further than the expert's |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| `pneumorph coopt --preset fast --seed {each['seed']}`, `{each['design']}` "
        f"| {_banded(each['band'])} | in {100.0 * each['share_beyond_expert']:.1f} % |"
        for each in sorted(found["seeds"], key=lambda each: each["seed"])
    ]
    lines += [
        f"| the expert's robot, its phase ({expert['phase_deg']:.0f}°) tuned in the training's "
        f"worlds | {_banded(expert['band'])} | |"
    ]
    lines += [
        f"| the robot of seed {first['seed']}, {times} the silicone's loss factor "
        f"| {_banded(band)} | |"
        for times, band in (
            ("half", found["damping"]["loss_factor_times_0.5"]),
            ("twice", found["damping"]["loss_factor_times_2"]),
        )
    ]
    return "\n".join(lines) + "\n"


def _banded(band: dict[str, float]) -> str:
    return f"{band['median_cm']:.1f} cm | {band['low_cm']:.1f} to {band['high_cm']:.1f} cm"


def demo_table() -> str:
    """Return the table of the demo's training with several seeds, as Markdown."""
    seeds = json.loads((ROOT / "reproduce/demo/demo.json").read_text())["seeds"]
    lines = [
        f"| 20 s in {seeds[0]['world_count']} unseen worlds of the measured physics, reduced "
        "robots | median | 80 % of the worlds | further than the expert's |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| `pneumorph demo --seed {seed['seed']}`, `{seed['design']}` "
        f"| {seed['median_cm']:.1f} cm | {seed['tenth_percentile_cm']:.1f} to "
        f"{seed['ninetieth_percentile_cm']:.1f} cm "
        f"| in {seed['share_beyond_expert'] * seed['world_count']:.0f} |"
        for seed in seeds
    ]
    return "\n".join(lines) + "\n"


def published_table() -> str:
    """Return the table of the paper's own physics as Markdown."""
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
    lines += [f"| {what} | {number} | `reproduce/{name}` |" for what, number, name in rows]
    return "\n".join(lines) + "\n"


def _share(fast: dict[str, Any]) -> float:
    """Timesteps of a run of the faster schedule as a share of the full run's [%]."""
    (share,) = {round(100.0 * run["share_of_timesteps"]) for run in fast["runs"]}
    return share


def _listed(distances_cm: list[float]) -> str:
    return ", ".join(f"{distance:.1f}" for distance in distances_cm)


def _distances(gap: dict[str, Any], trained: str, damping: str) -> list[float]:
    """Distances [cm] of the pairs of one training under its own or the other damping."""
    return [pair[f"{damping}_distance_cm"] for pair in gap[trained]["pairs"]]


TABLES = {"measured": measured_table, "demo": demo_table, "published": published_table}
PAGES = {"README.md": ("measured",), "docs/results.md": ("demo", "published")}
"""Which tables each page has."""


def with_numbers(page: str, names: tuple[str, ...]) -> str:
    """Return the text of a page with the named tables as they are now.

    Raises:
        ValueError: The page has no place for one.
    """
    for name in names:
        begin, end = f"<!-- {name} numbers: docs/make_numbers.py -->\n", "<!-- end of numbers -->\n"
        place = re.compile(f"(?<={re.escape(begin)}).*?(?={end})", re.DOTALL)
        if not place.search(page):
            raise ValueError(f"the page lacks {begin.strip()} and {end.strip()} after it")
        now = TABLES[name]()
        page = place.sub(lambda _, now=now: now, page, count=1)
    return page


if __name__ == "__main__":
    for file, names in PAGES.items():
        path = ROOT / file
        path.write_text(with_numbers(path.read_text(), names))
        print(f"wrote {path}")
