"""Figures of certificates, searches, comparisons and trials draw the numbers that they name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex

from pneumorph.base.artefact import read_json
from pneumorph.base.result import result_from_dict
from pneumorph.hardware.deployment_log import LoggedPressures
from pneumorph.hardware.marker_track import MarkerTrack
from pneumorph.report.certificate_sections import band_figure
from pneumorph.report.learning_figures import own_gaits_figure
from pneumorph.report.reduction_figures import node_error_figure
from pneumorph.report.style import BASELINE_COLOUR, LEARNED_COLOUR
from pneumorph.report.trial_figures import trials_figure
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.search_findings import DesignsBestGait

CERTIFICATE = Path(__file__).parents[2] / "reproduce/long_trainings/seed_1/certificate_full.json"


def test_a_certificates_bands_are_drawn_over_its_worlds() -> None:
    found = result_from_dict(Certificate, read_json(CERTIFICATE, "certificate"))
    bands = [found.expert.band, *(pair.band for pair in found.pairs)]
    axes = band_figure(found).axes[0]
    span, median = axes.collections
    np.testing.assert_allclose(
        [segment[:, 1] for segment in span.get_segments()], [[b.low, b.high] for b in bands]
    )
    assert span.get_label() == "80 % of the worlds"
    np.testing.assert_allclose(
        [segment[:, 1] for segment in median.get_segments()], [[b.median] * 2 for b in bands]
    )
    assert median.get_label() == "median"
    columns = [line.get_ydata() for line in axes.lines[: len(bands)]]
    np.testing.assert_allclose(np.array(columns).T, np.array(found.achieved, dtype=float))
    full = next(line for line in axes.lines if line.get_label() == "finite elements")
    walked = [each.full for pair in found.pairs for each in pair.full_order]
    np.testing.assert_allclose(full.get_ydata(), walked)
    assert [text.get_text() for text in axes.get_xticklabels()][:2] == ["expert", "L1"]


def test_own_gaits_are_drawn_over_those_of_the_shared_policy() -> None:
    row = DesignsBestGait(
        "1.0.2.0.0.3.0.0", 4.0, 4.0, None, why="L1", late_gain_cm=0.0,
        policy_distance_cm=3.0, learned_distance_cm=3.5,
    )  # fmt: skip
    drawn = replace(row, why="drawn at random", distance_cm=2.0, policy_distance_cm=0.5)
    unknown = replace(row, policy_distance_cm=None)
    axes = own_gaits_figure([row, drawn, unknown]).axes[0]
    places = [(line.get_xdata()[0], line.get_ydata()[0]) for line in axes.lines[:-1]]
    assert places == [(3.0, 4.0), (0.5, 2.0)]
    colours = [to_hex(line.get_color()) for line in axes.lines[:-1]]
    assert colours == [to_hex(LEARNED_COLOUR), to_hex(BASELINE_COLOUR)]
    # The line on which both are equal.
    np.testing.assert_array_equal(axes.lines[-1].get_xdata(), axes.lines[-1].get_ydata())
    assert "shared policy" in axes.get_xlabel()
    assert "own searched gait" in axes.get_ylabel()
    with pytest.raises(ValueError, match="no design has a searched and a learned distance"):
        own_gaits_figure([unknown])


def test_errors_of_nodes_are_drawn_over_time() -> None:
    error = {"one": np.array([0.0, 1.0, 3.0]), "other": np.array([0.5, 0.25])}
    lines = node_error_figure(error, 0.1).axes[0].lines
    assert [line.get_label() for line in lines] == ["one", "other"]
    np.testing.assert_allclose(lines[0].get_xdata(), [0.0, 0.1, 0.2])
    np.testing.assert_array_equal(lines[0].get_ydata(), error["one"])
    np.testing.assert_array_equal(lines[1].get_ydata(), error["other"])


def test_trials_are_drawn_channel_by_channel_and_their_way_below() -> None:
    time_s = np.array([0.0, 1.0, 2.0])
    commanded = np.array([[0.0, 90.0], [45.0, 60.0], [20.0, 0.0]])
    logs = [LoggedPressures(time_s, commanded, commanded - number, ()) for number in (1.0, 2.0)]
    track = MarkerTrack(time_s, np.array([[5.0, 0.0], [15.0, 3.0], [45.0, 9.0]]))
    *panels, way = trials_figure(logs, {"trial 2": track}).axes
    for channel, axes in enumerate(panels):
        commands, first, second = axes.lines
        assert commands.get_label() == "commanded"
        np.testing.assert_array_equal(commands.get_ydata(), commanded[:, channel])
        np.testing.assert_array_equal(first.get_ydata(), commanded[:, channel] - 1.0)
        np.testing.assert_array_equal(second.get_ydata(), commanded[:, channel] - 2.0)
        assert first.get_alpha() > second.get_alpha()
    assert len(panels) == 2
    (travel,) = (line for line in way.lines if line.get_label() == "trial 2")
    np.testing.assert_allclose(travel.get_ydata(), [0.0, 1.0, 4.0])
    assert way.get_ylabel() == "forward distance (cm)"
    with pytest.raises(ValueError, match="logs is empty"):
        trials_figure([])
