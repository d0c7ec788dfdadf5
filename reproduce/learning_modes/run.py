"""How far learned robots go when their legs have fewer modes, as in a training.

    python reproduce/learning_modes/run.py
    python reproduce/learning_modes/run.py --kept two_chambers

The kept gaits of restarts, and those of the demo as it learned on legs with all modes, walk, as
reduced robots in the measured physics, in worlds that no training saw, with all modes of the leg
that ships and with fewer. Writes distances.json. Those of robots with two-chamber legs, which turn
or walk aside, write two_chambers.json. Some minutes on two processors.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.layers import layered
from pneumorph.base.result import finite
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.simulation.randomisation import World
from pneumorph.study.certified_candidates import unseen_worlds
from pneumorph.study.gait_source import find_gait
from pneumorph.study.robustness import walks_in_worlds

HERE = Path(__file__).parent
_ROBOTS = HERE.parent / "robots"


@dataclass(frozen=True)
class Kept:
    """Gaits that were kept of robots that are alike."""

    file: str
    """What is written of them."""
    gaits: tuple[tuple[Path, Goal], ...]
    """Each one's file, and what was asked of it."""
    described: str | None = None
    """The robots' file; None for the paper's."""


KEPT = {
    "crawling": Kept(
        "distances.json",
        tuple(
            (path, FORWARD)
            for folder in (HERE / "demo", HERE.parent / "restarts")
            for path in sorted(folder.glob("*.csv"))
        ),
    ),
    "two_chambers": Kept(
        "two_chambers.json",
        tuple(
            (path, goal)
            for name, goal in (("turning", Goal("turn_left")), ("heading", Goal("heading", 90.0)))
            for path in sorted(_ROBOTS.glob(f"{name}_*.csv"))
        ),
        str(HERE.parent.parent / "examples" / "two_chambers.toml"),
    ),
}


def main(
    modes: tuple[int, ...] = (32, 24, 16),
    world_count: int = 24,
    kept: Literal["crawling", "two_chambers"] = "crawling",
    work: Path = Path("runs/learning_modes"),
    out: Path = HERE,
) -> None:
    """Walk the gaits, and write how far they go.

    Args:
        modes: How many modes a leg keeps; all of them walk as well, to compare with.
        world_count: Worlds, besides the nominal one.
        kept: Which gaits walk.
        work: Folder of the progress.
        out: Folder of what is written.
    """
    asked, folder = KEPT[kept], RunFolder(work, "learning_modes")
    robot = layered(RobotOptions(), [{"described": asked.described}]).spec()
    worlds = [World.nominal(robot.physics), *unseen_worlds(measured_worlds(), world_count, 0)]
    part = robot.modules[0].reduced
    whole, chambers = part.mode_count, part.cavity_count
    found, took_s = {}, {}
    for count in (whole, *modes):
        folder.progress.stage(f"{count} modes")
        start = time.perf_counter()
        found[count] = _achieved(robot.with_fewer_modes(count // chambers), asked, worlds, folder)
        took_s[count] = time.perf_counter() - start
    told = {
        str(count): {
            **compared(far, found[whole]),
            "time_share": took_s[count] / took_s[whole],
            **{
                name: {
                    f"{path.parent.name}/{path.name}": each
                    for (path, _), each in zip(asked.gaits, values, strict=True)
                }
                for name, values in (
                    ("medians", np.nanmedian(far[1:], axis=0)),
                    ("most_changed_by", np.nanmax(np.abs(far - found[whole]), axis=0)),
                )
            },
        }
        for count, far in found.items()
    }
    content = finite({"world_count": world_count, "modes": told})
    print(f"wrote {write_json(out / asked.file, content)}")


def _achieved(
    robot: RobotSpec, asked: Kept, worlds: Sequence[World], folder: RunFolder
) -> np.ndarray:
    """What each gait achieves of its goal [its unit], (world, gait), NaN where a walk failed."""
    columns = []
    for path, goal in asked.gaits:
        source = find_gait(path, None, ExpertGait())
        column, _ = walks_in_worlds(
            robot, [source.design], [source.gait], worlds, source.settling_steps, folder, goal
        )
        columns.append(column)
    return np.concatenate(columns, axis=1)


def compared(far: np.ndarray, whole: np.ndarray) -> dict[str, Any]:
    """What was achieved beside what is with all modes [the goals' units], both (world, gait), NaN
    where a walk failed."""
    ends = ~(np.isnan(far) | np.isnan(whole))
    change = (far - whole)[ends]
    means = np.nanmean(far - whole, axis=0), np.nanmean(whole, axis=0)
    return {
        "mean_change": change.mean(),
        "deviation": change.std(),
        "worst_gait_change_percent": 100.0 * np.abs(means[0] / means[1]).max(),
        "correlation": np.corrcoef(far[ends], whole[ends])[0, 1],
        "failed_count": int(np.isnan(far).sum()),
    }


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
