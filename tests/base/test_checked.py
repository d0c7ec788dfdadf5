"""Settings refuse what their annotations do not allow, by name."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
import pytest
import tyro

from pneumorph.base.checked import (
    Bounds,
    Checked,
    Count,
    CountOrNone,
    NotNegative,
    Positive,
    Share,
    rises,
)
from pneumorph.base.settings import settings_from_dict


@dataclass(frozen=True)
class Walk(Checked):
    duration_s: Positive = 20.0
    height_mm: float = -3.0
    friction: NotNegative | None = None
    mutation: Share = 0.5
    population: Annotated[int, Bounds(least=2)] = 96
    grading: Annotated[float, Bounds(above=0.0, most=1.0)] = 0.3
    ratio: Annotated[float, Bounds(least=0.0, below=0.5, why="use other elements")] = 0.2
    damping: Literal["published", "objective"] = "published"
    legs: tuple[Count, ...] = (3, 4)
    range_kPa: tuple[NotNegative, Positive] = (0.0, 90.0)
    skipped: CountOrNone = 0
    robots: Literal["all"] | int = "all"
    resume: bool = False
    title: str = ""


@dataclass(frozen=True)
class Rising(Checked):
    low: Positive = 1.0
    high: Positive = 2.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.low >= self.high:
            raise ValueError(f"low is {self.low}, expected less than high, {self.high}")


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("duration_s", 0.0, "duration_s must be positive, got 0.0"),
        ("duration_s", math.nan, "duration_s must be finite, got nan"),
        ("duration_s", math.inf, "duration_s must be finite, got inf"),
        ("height_mm", math.nan, "height_mm must be finite, got nan"),
        ("friction", -0.1, "friction must be at least 0, got -0.1"),
        ("mutation", 1.5, "mutation must be at least 0 and at most 1, got 1.5"),
        ("population", 1, "population must be at least 2, got 1"),
        ("grading", 0.0, "grading must be above 0 and at most 1, got 0.0"),
        ("ratio", 0.5, "ratio must be at least 0 and below 0.5, got 0.5; use other"),
        ("damping", "none", "damping must be one of published, objective, got 'none'"),
        ("legs", (3, 0), "legs[1] must be at least 1, got 0"),
        ("range_kPa", (0.0, 0.0), "range_kPa[1] must be positive, got 0.0"),
        ("range_kPa", (0.0,), "range_kPa must have 2 entries, got (0.0,)"),
        ("skipped", -1, "skipped must be at least 0, got -1"),
        ("population", 2.5, "population must be a whole number, got 2.5"),
        ("population", True, "population must be a whole number, got True"),
        ("duration_s", "20", "duration_s must be a number, got '20'"),
        ("legs", (3, 4.0), "legs[1] must be a whole number, got 4.0"),
        ("resume", 1, "resume must be true or false, got 1"),
        ("title", 3, "title must be a text, got 3"),
    ],
)
def test_a_value_out_of_range_is_refused_by_name(field: str, value: Any, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        replace(Walk(), **{field: value})


def test_values_within_their_bounds_pass() -> None:
    ends = Walk(mutation=1.0, grading=1.0, ratio=0.0, friction=0.0, legs=(), robots=5)
    assert settings_from_dict(Walk, {"mutation": 1.0, "friction": 0.0}).friction == ends.friction
    with pytest.raises(ValueError, match="Walk cannot be read: population must be at le"):
        settings_from_dict(Walk, {"population": 1})


@pytest.mark.parametrize(
    ("values", "answer"),
    [
        ([0.0, 1.0, 5.0], True),
        ([1.0, 1.0], False),
        ([0.0, np.nan, 2.0], False),
        ([0.0, np.inf], False),
    ],
)
def test_numbers_that_rise_are_finite(values: list[float], answer: bool) -> None:
    assert rises(np.array(values)) is answer


def test_a_check_of_ones_own_comes_after_that_of_each_field() -> None:
    with pytest.raises(ValueError, match=r"low must be positive, got -1\.0"):
        Rising(low=-1.0, high=-2.0)
    with pytest.raises(ValueError, match="expected less than high"):
        Rising(low=3.0)


def test_flags_are_made_of_such_fields(capsys: pytest.CaptureFixture[str]) -> None:
    asked = tyro.cli(Walk, args=["--friction", "0.4", "--legs", "5", "6", "--mutation", "0"])
    assert (asked.friction, asked.legs, asked.mutation) == (0.4, (5, 6), 0.0)
    with pytest.raises(SystemExit):
        tyro.cli(Walk, args=["--population", "1"])
    assert "population must be at least 2, got 1" in capsys.readouterr().err
