"""Train robots on a task that the package does not have: crawl forward and stay straight.

A degree that a robot turns within an action costs 0.1 cm, whichever way. What comes out is a run
folder that every verb takes.

    python examples/own_task.py --robot examples/plate.toml --out runs/straight
    pneumorph report runs/straight
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np

import pneumorph as pm

TURNING = pm.RewardTerm("turning", "degrees", -0.1, lambda motion: np.abs(motion.moved.turn_deg))
"""A left and a right turn cost the same, so a robot and its mirror image are rewarded alike."""


class Straight(pm.TaskWrapper):
    """Forward travel, less what turning costs."""

    terms = (TURNING,)


def main(arguments: Sequence[str] | None = None, **changes: Any) -> Any:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", help="file that describes the robot; by default the paper's")
    parser.add_argument("--out", default="runs/straight", help="the run folder")
    asked = parser.parse_args(arguments)
    found = pm.train(asked.out, asked.robot, preset="quick", changes=changes, own_task=Straight)
    print(f"{found.best_design}: {found.best_distance_cm} cm forward, ranked by {found.ranked_by}")
    return found


if __name__ == "__main__":
    main()
