"""A mirror image's transitions are those its own episode would give."""

import numpy as np

from pneumorph.environment.crawling_environment import CrawlingEnvironment
from pneumorph.environment.viscous_crawler import ViscousCrawler, viscous_crawler_robot
from pneumorph.learn.mirror import MirrorImage
from pneumorph.robot.design_space import DesignSpace


def test_translated_episode_equals_the_images_own_episode() -> None:
    space = DesignSpace()
    mirror = MirrorImage(space)
    rng = np.random.default_rng(0)
    designs = rng.integers(len(space), size=16)
    images = mirror.designs(designs)
    assert (images != designs).any()

    def make(indices: np.ndarray) -> CrawlingEnvironment:
        chosen = [space[int(index)] for index in indices]
        environment = CrawlingEnvironment(chosen, viscous_crawler_robot, ViscousCrawler)
        environment.reset()
        return environment

    environment, image = make(designs), make(images)
    for _ in range(5):
        action = rng.uniform(-1, 1, (16, 3)).astype(np.float32)
        observation, reward, *_ = environment.step(action)
        image_observation, image_reward, *_ = image.step(mirror.actions(designs, action))
        np.testing.assert_array_equal(
            image_observation[:, :12], mirror.actions(designs, observation[:, :12])
        )
        # Rounding of the locations' cosines.
        np.testing.assert_allclose(image_reward, reward, atol=1e-12)
