"""What the length of a time step does to how far learned robots go.

    python reproduce/time_step/run.py

The kept gaits of restarts, and those of the demo as it learned on legs with all modes, walk, as
reduced robots in the measured physics, in worlds that no training saw, with steps of several
lengths. Writes distances.json. Some ten minutes on two processors.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

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
    for folder in (HERE.parent / "learning_modes" / "demo", HERE.parent / "restarts")
    for path in sorted(folder.glob("*.csv"))
)


def main(
    steps_s: tuple[float, ...] = (0.01, 0.005, 0.0025),
    world_count: int = 48,
    work: Path = Path("runs/time_step"),
    out: Path = HERE,
) -> None:
    """Walk the gaits, and write how far they go.

    Args:
        steps_s: Lengths of the time step [s], the first that which the others are compared with.
        world_count: Worlds, besides the nominal one.
        work: Folder of the progress.
        out: Folder of distances.json.
    """
    robot, folder = RobotOptions().spec(), RunFolder(work, "time_step")
    sources = [find_gait(path, None, ExpertGait()) for path in GAITS]
    worlds = [World.nominal(robot.physics), *unseen_worlds(measured_worlds(), world_count, 0)]
    settling_s = sources[0].settling_steps * robot.physics.time_step_s
    found = {}
    for step_s in steps_s:
        folder.progress.stage(f"steps of {1e3 * step_s:g} ms")
        far, *_ = walks_in_worlds(
            replace(robot, physics=replace(robot.physics, time_step_s=step_s)),
            [source.design for source in sources],
            [source.gait for source in sources],
            worlds,
            round(settling_s / step_s),
            folder,
        )
        found[step_s] = far
    names = [f"{path.parent.name}/{path.name}" for path in GAITS]
    usual = found[steps_s[0]]
    told = {
        f"{step_s:g}": {
            name: {
                "nominal_cm": far[0, number],
                "median_cm": np.nanmedian(far[1:, number]),
                "low_cm": np.nanquantile(far[1:, number], 0.1),
                "high_cm": np.nanquantile(far[1:, number], 0.9),
                "median_change_cm": np.nanmedian(far[1:, number] - usual[1:, number]),
                "median_absolute_change_cm": np.nanmedian(
                    np.abs(far[1:, number] - usual[1:, number])
                ),
                "failed_count": int(np.isnan(far[:, number]).sum()),
            }
            for number, name in enumerate(names)
        }
        for step_s, far in found.items()
    }
    file = write_json(out / "distances.json", finite({"world_count": world_count, "steps": told}))
    print(f"wrote {file}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
