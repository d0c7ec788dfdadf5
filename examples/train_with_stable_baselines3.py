"""Train on the crawling environment with a learner that is not ours: Stable-Baselines3.

Stable-Baselines3 has its own notion of a vector environment. The adapter below is all it takes:
both restart an episode in the step that ends it, and name the last observation differently.

Needs the extra ``pneumorph[stable-baselines3]``, which brings PyTorch.

    python examples/train_with_stable_baselines3.py --timesteps 20000
    python examples/train_with_stable_baselines3.py --viscous --timesteps 5000  # without engine

No test runs it, for PyTorch weighs a gigabyte. It ran last with Stable-Baselines3 2.9.2, PyTorch
2.13.0 (CPU), Gymnasium 1.4.0, NumPy 2.4.6 and Python 3.11: from 0.01 to 10.10 cm with ``--robots 4
--timesteps 600``, and from 0.01 to 6.07 cm as the second line above.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np
from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.registration import make_env
from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.robot.design import Design


class StableBaselinesAdapter(VecEnv):
    """A `CrawlingEnvironment` as Stable-Baselines3 wants it."""

    def __init__(self, environment: CrawlingEnvironment) -> None:
        self.environment = environment
        self.render_mode = None
        super().__init__(
            environment.num_envs,
            environment.single_observation_space,
            environment.single_action_space,
        )

    def reset(self) -> np.ndarray:
        return self.environment.reset()[0]

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        observation, reward, terminated, truncated, info = self.environment.step(self._actions)
        ended = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for robot in np.flatnonzero(ended):
            infos[robot] = {
                "terminal_observation": info["final_obs"][robot],
                "TimeLimit.truncated": bool(truncated[robot]),
                "distance_cm": float(info["distance_cm"][robot]),
                "status": int(info["status"][robot]),
            }
        return observation, reward.astype(np.float32), ended, infos

    def close(self) -> None:
        self.environment.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        value = getattr(self.environment, attr_name, getattr(self, attr_name, None))
        return [value] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise NotImplementedError("robots of a batch share their attributes")

    def env_method(self, method_name: str, *args: Any, **kwargs: Any) -> list[Any]:
        raise NotImplementedError("robots of a batch have no methods of their own")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False] * len(list(self._get_indices(indices)))


def make_environment(designs: Sequence[Design], viscous: bool) -> CrawlingEnvironment:
    """The paper's robots in the engine, or viscous crawlers that need nothing."""
    if viscous:
        return CrawlingEnvironment(designs, viscous_crawler_robot, ViscousCrawler)
    return make_env(design=designs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--design", default=BASELINE_DESIGN)
    parser.add_argument("--robots", type=int, default=16)
    parser.add_argument("--timesteps", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--viscous", action="store_true", help="closed-form crawlers, no engine")
    options = parser.parse_args()

    designs = [Design.parse(options.design)] * options.robots
    environment = VecMonitor(
        StableBaselinesAdapter(make_environment(designs, options.viscous)),
        info_keywords=("distance_cm",),
    )
    model = SAC(
        "MlpPolicy",
        environment,
        learning_rate=2e-3,
        buffer_size=100_000,
        learning_starts=20 * options.robots,
        batch_size=256,
        tau=0.01,
        gamma=0.95,
        gradient_steps=4,
        ent_coef="auto_0.02",
        policy_kwargs={"net_arch": [64, 64]} if options.viscous else None,
        seed=options.seed,
        verbose=1,
    )
    before = episode_distance_cm(model, environment)
    model.learn(total_timesteps=options.timesteps, log_interval=50 * options.robots)
    after = episode_distance_cm(model, environment)
    print(f"distance of the deterministic policy: {before:.2f} cm before, {after:.2f} cm after")
    assert np.isfinite(after)
    if options.viscous and options.timesteps >= 5000:
        assert after > before + 1.0, "the viscous crawler should learn to crawl within 5000 steps"


def episode_distance_cm(model: SAC, environment: VecEnv) -> float:
    """Mean travel of one episode without noise [cm]."""
    observation = environment.reset()
    while True:
        action, _ = model.predict(observation, deterministic=True)
        observation, _, ended, infos = environment.step(action)
        if ended.all():
            return float(np.mean([info["distance_cm"] for info in infos]))


if __name__ == "__main__":
    main()
