"""How far learned robots go when their legs have fewer modes, as in a training.

    python reproduce/learning_modes/run.py

The kept gaits of restarts, and those of the demo as it learned on legs with all modes, walk, as
reduced robots in the measured physics, in worlds that no training saw, with all modes of the leg
that ships and with fewer. Writes distances.json. Some minutes on two processors.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.result import finite
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.simulation.randomisation import World
from pneumorph.study.certified_candidates import unseen_worlds
from pneumorph.study.gait_source import find_gait
from pneumorph.study.robustness import walks_in_worlds

HERE = Path(__file__).parent
GAITS = tuple(
    path
    for folder in (HERE / "demo", HERE.parent / "restarts")
    for path in sorted(folder.glob("*.csv"))
)


def main(
    modes: tuple[int, ...] = (32, 24, 16),
    world_count: int = 24,
    work: Path = Path("runs/learning_modes"),
    out: Path = HERE,
) -> None:
    """Walk the gaits, and write how far they go.

    Args:
        modes: How many modes a leg keeps; all of them walk as well, to compare with.
        world_count: Worlds, besides the nominal one.
        work: Folder of the progress.
        out: Folder of distances.json.
    """
    robot, folder = RobotOptions().spec(), RunFolder(work, "learning_modes")
    sources = [find_gait(path, None, ExpertGait()) for path in GAITS]
    worlds = [World.nominal(robot.physics), *unseen_worlds(measured_worlds(), world_count, 0)]
    whole = robot.module.reduced.mode_count
    found, took_s = {}, {}
    for count in (whole, *modes):
        folder.progress.stage(f"{count} modes")
        fewer, start = robot.with_fewer_modes(count), time.perf_counter()
        found[count], _ = walks_in_worlds(
            fewer,
            [source.design for source in sources],
            [source.gait for source in sources],
            worlds,
            sources[0].settling_steps,
            folder,
        )
        took_s[count] = time.perf_counter() - start
    told = {
        str(count): {
            **compared(far, found[whole]),
            "time_share": took_s[count] / took_s[whole],
            "medians_cm": {
                f"{path.parent.name}/{path.name}": np.nanmedian(far[1:, number])
                for number, path in enumerate(GAITS)
            },
        }
        for count, far in found.items()
    }
    content = finite({"world_count": world_count, "modes": told})
    print(f"wrote {write_json(out / 'distances.json', content)}")


def compared(far: np.ndarray, whole: np.ndarray) -> dict[str, Any]:
    """Distances beside those with all modes [cm], both (world, gait), NaN where a walk failed."""
    ends = ~(np.isnan(far) | np.isnan(whole))
    change = (far - whole)[ends]
    means = np.nanmean(far - whole, axis=0), np.nanmean(whole, axis=0)
    return {
        "mean_change_cm": change.mean(),
        "deviation_cm": change.std(),
        "worst_gait_change_percent": 100.0 * np.abs(means[0] / means[1]).max(),
        "correlation": np.corrcoef(far[ends], whole[ends])[0, 1],
        "failed_count": int(np.isnan(far).sum()),
    }


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
