"""A simulator that passes readings on has all that the environment may ask of one."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.environment.crawling_simulator import (
    CrawlingSimulator,
    LeaningSimulator,
    LoadedSimulator,
    RangedSimulator,
    TurningSimulator,
)
from pneumorph.simulation.told_readings import TOLD, ToldReadings

PROTOCOLS: tuple[type, ...] = (
    CrawlingSimulator,
    LeaningSimulator,
    LoadedSimulator,
    RangedSimulator,
    TurningSimulator,
)
"""The last four are looked for at run time."""


class Numbered(ToldReadings):
    """Tells each reading's place among the names."""

    def _told(self, name: str) -> np.ndarray:
        return np.array([TOLD.index(name)])

    def forget_range(self, active: np.ndarray | None = None) -> None:
        """Does nothing."""


def test_names_are_those_of_the_protocols() -> None:
    asked = {
        name
        for protocol in PROTOCOLS
        for name, value in vars(protocol).items()
        if isinstance(value, property)
    }
    assert set(TOLD) == asked


def test_each_reading_is_told_by_its_own_name() -> None:
    readings = Numbered()
    assert [int(getattr(readings, name)[0]) for name in TOLD] == list(range(len(TOLD)))


@pytest.mark.parametrize("protocol", PROTOCOLS[1:])
def test_it_is_what_the_environment_looks_for(protocol: type) -> None:
    assert isinstance(Numbered(), protocol)


def test_one_that_tells_nothing_is_refused() -> None:
    with pytest.raises(TypeError, match="_told"):
        ToldReadings()  # type: ignore[abstract]
