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

COST_CM_PER_DEGREE = 0.1


class Straight(pm.TaskWrapper):
    """Forward travel, less what turning costs. A left and a right turn cost the same, so
    `is_symmetric` is that of the environment, and mirrored transitions are learned as they are."""

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        self._before_deg = np.zeros(self.num_envs)
        return self.env.reset(seed=seed, options=options)

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(actions)
        sound = info["status"] == 0  # where the robot is means nothing once its simulation failed
        heading_deg = np.where(sound, self.simulator.heading_deg, 0.0)
        # Of two directions the turn that is less than half a circle.
        turned_deg = np.abs((heading_deg - self._before_deg + 180.0) % 360.0 - 180.0)
        cost_cm = np.where(sound, COST_CM_PER_DEGREE * turned_deg, 0.0)
        self._before_deg = np.where(terminated | truncated, 0.0, heading_deg)
        return observation, reward - cost_cm, terminated, truncated, info


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
