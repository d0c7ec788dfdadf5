"""A pytest plugin: where a test names no instruction set, the stepper's plainest build runs."""

from __future__ import annotations

import os

import numpy as np

from pneumorph.simulation.stepper_settings import StepperSettings


def pytest_configure() -> None:
    features = np._core._multiarray_umath.__cpu_features__
    # NumPy was told as well.
    assert not any(features[each] for each in os.environ["NPY_DISABLE_CPU_FEATURES"].split())
    *others, best = StepperSettings.__init__.__defaults__
    assert best == StepperSettings.instruction_set == "best"
    StepperSettings.__init__.__defaults__ = (*others, "baseline")
