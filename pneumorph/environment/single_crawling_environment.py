"""One crawling robot as an ordinary Gymnasium environment."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.crawling_simulator import RobotBuilder, SimulatorFactory
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.robot.design import Design


class SingleCrawlingEnvironment(gymnasium.Env):
    """A `CrawlingEnvironment` of one robot, for tools that know only `gymnasium.Env`.

    ``reset(options={"design": design})``, or its text, changes it. ``info`` holds the entries of
    `CrawlingEnvironment` as numbers.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 -- as Gymnasium declares it

    def __init__(
        self,
        design: Design,
        build_robot: RobotBuilder,
        make_simulator: SimulatorFactory,
        task: CrawlingTask | None = None,
        module_count: int = 1,
        cavity_count: int = 1,
    ) -> None:
        """Build the robot; arguments as of `CrawlingEnvironment`."""
        self._batch = CrawlingEnvironment(
            [design], build_robot, make_simulator, task, module_count, cavity_count
        )
        self.observation_space = self._batch.single_observation_space
        self.action_space = self._batch.single_action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start a new episode, with ``options["design"]`` if given.

        Raises:
            TypeError: The design is neither that nor text.
            ValueError: An unknown option, or a design of another kind.
        """
        options = dict(options or {})
        if unknown := set(options) - {"design"}:
            raise ValueError(
                f"reset option {min(unknown)!r} is unknown, expected 'design': the robot's design"
            )
        super().reset(seed=seed)
        if "design" in options:
            options["designs"] = [options.pop("design")]
        observation, _ = self._batch.reset(seed=seed, options=options)
        return observation[0], {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold one action, shape (regulator,); see `CrawlingEnvironment.step`."""
        observation, reward, terminated, truncated, info = self._batch.step(
            np.asarray(action)[np.newaxis]
        )
        ended = bool(terminated[0] or truncated[0])
        source = info["final_info"] if ended else info
        return (
            info["final_obs"][0] if ended else observation[0],
            float(reward[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            {name: source[name][0] for name in source if not name.startswith(("_", "final"))},
        )
