"""Pictures of walks on a slope say so, and are tilted as far as all of them rise or fall."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pneumorph.report.film import side_by_side
from pneumorph.report.floor_slope import shown_slope_deg, slope_deg, slope_words
from pneumorph.report.frame_painter import FilmSettings, FramePainter
from pneumorph.report.scene import Actor
from pneumorph.trajectory import Trajectory


def on_a_slope(trajectory: Trajectory, slope: float) -> Trajectory:
    settings = {"floor_slope_deg": slope}
    return replace(trajectory, metadata={**trajectory.metadata, "settings": settings})


@pytest.mark.parametrize(
    ("slopes", "tilt", "words"),
    [
        ([], 0.0, ""),
        ([0.0, 0.03], 0.0, ""),
        ([10.0], 10.0, "floor rising forward by 10 degrees"),
        ([-4.0, -4.0], -4.0, "floor falling forward by 4 degrees"),
        ([9.0, 11.0], 9.0, "floors of +9.0 to +11.0 degrees forward"),
        ([-0.6, 0.4], 0.0, "floors of -0.6 to +0.4 degrees forward"),
        ([-5.0, -3.0], -3.0, "floors of -5.0 to -3.0 degrees forward"),
        ([0.0, 10.0], 0.0, "floors of +0.0 to +10.0 degrees forward"),
    ],
)
def test_slopes_of_a_picture(slopes: list[float], tilt: float, words: str) -> None:
    assert shown_slope_deg(slopes) == tilt
    assert slope_words(slopes) == words


def test_a_film_of_a_climb_shows_the_slope(make_trajectory) -> None:
    crawl = make_trajectory()
    assert slope_deg(crawl) == 0.0
    settings = FilmSettings(width=320)
    # Without the words that say it.
    level, climb = (
        FramePainter([Actor.of(each, "robot")], settings, captions=False).paint(0.0)
        for each in (crawl, on_a_slope(crawl, 10.0))
    )
    assert (level.size, level.tobytes()) != (climb.size, climb.tobytes())
    both = [Actor.of(each, "robot") for each in (on_a_slope(crawl, 10.0), crawl)]
    FramePainter(side_by_side(both), settings).paint(0.0)
