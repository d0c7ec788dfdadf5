"""The gait that the example finds is one that walks."""

import numpy as np
import search_a_gait

import pneumorph as pm


def test_the_best_gait_walks_as_far_as_the_search_says():
    task = pm.CrawlingTask(action_count=6)
    gait, distance_cm = search_a_gait.search(generations=4, robots=5, task=task)
    alone = pm.make_env(design="1.0.0.2.2.0.0.1", task=task)
    alone.reset()
    for action in range(6):
        *_, info = alone.step(gait[None, action % search_a_gait.PERIOD])
    assert info["distance_cm"][0] == distance_cm  # a robot walks alike in any batch
    # Held at half the pressure it started from, the robot stays where it is.
    alone.reset()
    for _ in range(6):
        *_, info = alone.step(np.zeros((1, 3)))
    assert distance_cm > info["distance_cm"][0] + 0.5
