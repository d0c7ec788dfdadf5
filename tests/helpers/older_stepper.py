"""A pytest plugin: where a test names no instruction set, the stepper's plainest build runs."""

from __future__ import annotations

import numpy as np

from pneumorph.simulation.stepper_settings import StepperSettings


def pytest_configure() -> None:
    assert not np._core._multiarray_umath.__cpu_features__["AVX2"]  # NumPy was told as well
    *others, best = StepperSettings.__init__.__defaults__
    assert best == StepperSettings.instruction_set == "best"
    StepperSettings.__init__.__defaults__ = (*others, "baseline")
