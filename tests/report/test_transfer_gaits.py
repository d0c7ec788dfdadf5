"""Figures of trials: how many were measured of each robot, and whose bars are whose."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.hardware.deployment_log import LoggedPressures
from pneumorph.hardware.marker_track import MarkerTrack
from pneumorph.hardware.trial import Trial
from pneumorph.hardware.trial_comparison import compare_trials
from pneumorph.report.trial_figures import transfer_gaits_figure, transfer_rewards_figure
from pneumorph.trajectory import Trajectory

DESIGN = "1.0.0.2.2.0.0.1"
TIMES = np.linspace(0.0, 3.0, 31)
PATH_MM = np.column_stack([10.0 * TIMES, 0.0 * TIMES])


def trials(count: int) -> list[Trial]:
    kPa = np.zeros((len(TIMES), 2))
    log, track = LoggedPressures(TIMES, kPa, kPa, ()), MarkerTrack(TIMES, PATH_MM)
    return [Trial(f"trial_{number}", log, track) for number in range(count)]


def simulated() -> Trajectory:
    hub = np.column_stack([PATH_MM, 0.0 * TIMES])
    return Trajectory(
        time_s=TIMES,
        hub_position_mm=hub,
        hub_rotation=np.tile(np.eye(3), (len(TIMES), 1, 1)),
        tracked_point_mm=hub,
        commanded_kPa=np.zeros((len(TIMES), 2)),
        regulated_kPa=np.zeros((len(TIMES), 2)),
        contact_count=np.zeros(len(TIMES), dtype=int),
        metadata={"design": DESIGN},
    )


@pytest.mark.parametrize(
    ("counts", "legends"),
    [
        ((1, 2), [["simulation", "measured, 1 trial"], ["measured, 2 trials"]]),
        ((2, 2), [["simulation", "measured, 2 trials"], []]),
        ((3,), [["simulation", "measured, 3 trials"]]),
    ],
)
def test_each_robot_has_its_number_of_trials(
    counts: tuple[int, ...], legends: list[list[str]]
) -> None:
    measured = [trials(count) for count in counts]
    comparisons = [
        compare_trials(f"L{number}", DESIGN, simulated(), each)
        for number, each in enumerate(measured)
    ]
    figure = transfer_gaits_figure(comparisons, measured)
    found = [axes.get_legend() for axes in figure.axes[-len(counts) :]]
    told = [[] if each is None else [text.get_text() for text in each.texts] for each in found]
    assert told == legends


@pytest.mark.parametrize("count", [1, 3, 8])
def test_designs_stand_whole_and_round_over_their_bars(count: int) -> None:
    comparisons = [
        compare_trials(f"L{number}", DESIGN, simulated(), trials(1)) for number in range(count)
    ]
    figure = transfer_rewards_figure(comparisons)
    figure.canvas.draw()
    above, below = figure.axes
    for number in range(count):
        over, bar = (axes.transData.transform((number, 0.0))[0] for axes in (above, below))
        assert over == pytest.approx(bar, abs=1.0), number  # a pixel
    x, y = above.transData.transform((1.0, 1.0)) - above.transData.transform((0.0, 0.0))
    # The axes' size in pixels, of which there are hundreds, may be rounded.
    assert x == pytest.approx(y, rel=0.01)
    corners = np.concatenate([patch.get_xy() for patch in above.patches])
    assert np.abs(corners[:, 1]).max() < above.get_ylim()[1]
