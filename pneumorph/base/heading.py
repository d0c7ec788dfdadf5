"""Which way a robot faces, as long as it stands."""

from __future__ import annotations

import numpy as np

LEAST_UPRIGHT = 0.3
"""Cosine of the tilt beyond which a robot faces nowhere: that of 72.5 degrees."""


def heading_deg(rotation: np.ndarray) -> np.ndarray:
    """Direction of the forward axis in the plane, from forward to the left, -180 to 180 [degrees],
    (...); NaN of a robot that is tipped over: its axis points up or down, and turning over would
    count as half a turn.

    Args:
        rotation: From the robot's frame to the world's, (..., 3, 3).
    """
    heading = np.degrees(np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0]))
    return np.where(rotation[..., 2, 2] > LEAST_UPRIGHT, heading, np.nan)


def last_known(values: np.ndarray, start: float = 0.0) -> np.ndarray:
    """A course in which each value that is NaN is the last one before it, (time,).

    Args:
        values: In the order of time, (time,).
        start: What it is before the first that is known.
    """
    known = np.isfinite(values)
    place = np.maximum.accumulate(np.where(known, np.arange(len(values)), -1))
    return np.where(place >= 0, values[place], start)
