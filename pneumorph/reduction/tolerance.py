"""Relative errors at which a reduction adds no more modes, fields or elements."""

from __future__ import annotations

from typing import Annotated

from pneumorph.base.checked import Bounds

_WHY = "a relative error of 1 is that of no modes, fields or elements at all"

Tolerance = Annotated[float, Bounds(above=0.0, below=1.0, why=_WHY)]
"""Relative error at which no more is added."""
ToleranceOrNone = Annotated[float, Bounds(least=0.0, below=1.0, why=_WHY)]
"""The same, or 0 where nothing is asked for."""
