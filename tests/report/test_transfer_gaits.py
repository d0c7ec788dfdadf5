"""The figure of trials says of each robot how many were measured."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.hardware.deployment_log import LoggedPressures
from pneumorph.hardware.marker_track import MarkerTrack
from pneumorph.hardware.trial import Trial
from pneumorph.hardware.trial_comparison import compare_trials
from pneumorph.report.trial_figures import transfer_gaits_figure
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
