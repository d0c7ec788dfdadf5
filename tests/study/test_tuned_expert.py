"""Which phase of the expert's gait is the best over worlds where some walks fail."""

import numpy as np

from pneumorph.study.certificate import best_on_average


def test_a_phase_that_fails_is_not_the_best_where_all_go_backward() -> None:
    """Once a failed walk counted as 0 cm: more than what came to its end."""
    failing = np.array([[np.nan, -5.0, np.nan], [np.nan, -5.0, -6.0]])
    assert best_on_average(failing) == 1
    assert best_on_average(np.array([[1.0, 2.0], [1.0, 2.0]])) == 1
    # A walk that failed counts for nothing, which is less than what goes forward.
    assert best_on_average(np.array([[3.0, np.nan], [3.0, 4.0]])) == 0
