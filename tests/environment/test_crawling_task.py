"""Actions become pressures, and what is no action or pressure is refused."""

import numpy as np
import pytest

from pneumorph.environment.crawling_task import CrawlingTask


def test_actions_map_linearly_onto_0_to_90_kpa() -> None:
    task = CrawlingTask()
    np.testing.assert_array_equal(task.pressure_kPa(np.array([-1.0, 0.0, 1.0])), [0.0, 45.0, 90.0])
    actions = np.linspace(-1, 1, 12).reshape(4, 3)
    np.testing.assert_allclose(task.action(task.pressure_kPa(actions)), actions, atol=1e-15)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1.001, -7.0])
def test_actions_that_are_not_finite_or_out_of_range_are_refused(value: float) -> None:
    actions = np.zeros((5, 3))
    actions[4, 1] = value
    with pytest.raises(ValueError, match=r"action\[4, 1\] is .*finite number from -1 to 1"):
        CrawlingTask().pressure_kPa(actions)


@pytest.mark.parametrize("value", [np.nan, np.inf, -0.5, 90.5])
def test_pressures_that_are_not_finite_or_out_of_range_are_refused(value: float) -> None:
    with pytest.raises(ValueError, match=r"pressure_kPa\[1\] is .* from 0 to 90"):
        CrawlingTask().action(np.array([0.0, value, 0.0]))


def test_action_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(ValueError, match=r"shape \(2,\), expected \(\.\.\., regulator\)"):
        CrawlingTask().pressure_kPa(np.zeros(2))


def test_impossible_tasks_are_refused() -> None:
    with pytest.raises(ValueError, match="action_count must be at least 1, got 0"):
        CrawlingTask(action_count=0)
    with pytest.raises(ValueError, match="minimum_pressure_kPa < maximum_pressure_kPa"):
        CrawlingTask(minimum_pressure_kPa=90.0)
