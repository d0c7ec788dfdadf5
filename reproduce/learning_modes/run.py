"""How far learned robots go when their legs have fewer modes and points, as in a training.

    python reproduce/learning_modes/run.py
    python reproduce/learning_modes/run.py --kept turning

The kept gaits of restarts, and those of the demo as it learned on legs with all modes, walk, as
reduced robots in the measured physics, in worlds that no training saw, with all modes of the leg
that ships and with fewer. Writes crawling.json; turning.json and heading.json are of robots with
two-chamber legs, which turn or walk aside. Some minutes on two processors.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.layers import layered
from pneumorph.base.result import finite
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.simulation.randomisation import World
from pneumorph.study.certified_candidates import unseen_worlds
from pneumorph.study.gait_source import find_gait
from pneumorph.study.learning_robots import learning_robots
from pneumorph.study.robustness import walks_in_worlds
from pneumorph.study.training_options import quick_training

HERE = Path(__file__).parent
_ROBOTS = HERE.parent / "robots"


@dataclass(frozen=True)
class KeptGaits:
    """Gaits that were kept of robots that are alike, and were asked the same."""

    paths: tuple[Path, ...]
    """Their files."""
    goal: Goal = FORWARD
    """What was asked of them."""
    described: str | None = None
    """The robots' file; None for the paper's."""


def _of_two_chambers(name: str, goal: Goal) -> KeptGaits:
    described = HERE.parent.parent / "examples" / "two_chambers.toml"
    paths = sorted((HERE.parent / "robots").glob(f"{name}_*.csv"))
    return KeptGaits(tuple(paths), goal, str(described))


KEPT = {
    "crawling": KeptGaits(
        tuple(
            path
            for folder in (HERE / "demo", HERE.parent / "restarts")
            for path in sorted(folder.glob("*.csv"))
        )
    ),
    "turning": _of_two_chambers("turning", Goal("turn_left")),
    "heading": _of_two_chambers("heading", Goal("heading", 90.0)),
}


def main(
    kept: Literal["crawling", "turning", "heading"] = "crawling",
    modes: tuple[int, ...] = (32, 24, 16),
    tolerances: tuple[float, ...] = (0.0,),
    world_count: int = 24,
    work: Path = Path("runs/learning_modes"),
    out: Path = HERE,
) -> None:
    """Walk the gaits, and write how far they go.

    Args:
        kept: Which gaits walk.
        modes: How many modes a leg keeps for each of its chambers; all of them walk as well, to
            compare with.
        tolerances: With each number of modes, of points that stand for all (`--learning-tolerance`
            of a training); 0 for all points.
        world_count: Worlds, besides the nominal one.
        work: Folder of the progress.
        out: Folder of what is written, a file of the gaits' name.
    """
    asked, folder = KEPT[kept], RunFolder(work, "learning_modes")
    training = layered(quick_training(), [{"robot": {"described": asked.described}}])
    robot, settings = training.robot.spec(), training.coopt
    sources = [find_gait(path, None, ExpertGait()) for path in asked.paths]
    worlds = [World.nominal(robot.physics), *unseen_worlds(measured_worlds(), world_count, 0)]
    found, took_s = {}, {}
    points = {}
    for each, tolerance in ((0, 0.0), *product(modes, tolerances)):  # all that there are, first
        learning = replace(settings, learning_modes=each, learning_tolerance=tolerance)
        fewer = learning_robots(robot, learning)
        part = fewer.modules[0].reduced
        count = f"{part.mode_count}" + (f", {tolerance:g}" if tolerance else "")
        folder.progress.stage(f"{part.mode_count} modes and {len(part.tetrahedron_index)} points")
        points[count] = len(part.tetrahedron_index)
        start = time.perf_counter()
        found[count], *_ = walks_in_worlds(
            fewer,
            [source.design for source in sources],
            [source.gait for source in sources],
            worlds,
            sources[0].settling_steps,
            folder,
            asked.goal,
        )
        took_s[count] = time.perf_counter() - start
    whole = next(iter(found))
    names = [f"{path.parent.name}/{path.name}" for path in asked.paths]
    told = {
        count: {
            "points": points[count],
            **compared(far, found[whole]),
            "time_share": took_s[count] / took_s[whole],
            "medians": dict(zip(names, np.nanmedian(far[1:], axis=0), strict=True)),
        }
        for count, far in found.items()
    }
    content = finite({"world_count": world_count, "unit": asked.goal.unit, "modes": told})
    print(f"wrote {write_json(out / f'{kept}.json', content)}")


def compared(far: np.ndarray, whole: np.ndarray) -> dict[str, Any]:
    """What was achieved beside what is with all modes [the goal's unit], both (world, gait), NaN
    where a walk failed."""
    ends = ~(np.isnan(far) | np.isnan(whole))
    change = (far - whole)[ends]
    by_gait = np.nanmean(far - whole, axis=0) / np.nanmean(whole, axis=0)
    return {
        "mean_change": change.mean(),
        "deviation": change.std(),
        "most_changed": np.abs(change).max(),
        "worst_gait_change_percent": 100.0 * np.abs(by_gait).max(),
        "correlation": np.corrcoef(far[ends], whole[ends])[0, 1],
        "failed_count": int(np.isnan(far).sum()),
    }


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
