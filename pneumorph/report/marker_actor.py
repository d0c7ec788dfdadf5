"""A real robot in a film or a replay: all that is known of it is the path of its marker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from pneumorph.hardware.trial import Trial


@dataclass(frozen=True, eq=False)
class MarkerActor:
    """One measured robot.

    Attributes:
        time_s: Times since the gait's start, rising [s], (frame,).
        position_mm: Forward (x) and leftward (y) place of the marker [mm], (frame, 2).
        commanded_kPa: Pressure asked for [real kPa], (frame, regulator).
        regulated_kPa: Pressure sensed, or asked for where there is no sensor, (frame, regulator).
        label: What to write beside it.
        lane_mm: Where to place it across the direction of travel (y).
    """

    time_s: np.ndarray
    position_mm: np.ndarray
    commanded_kPa: np.ndarray
    regulated_kPa: np.ndarray
    label: str
    lane_mm: float = 0.0

    def __post_init__(self) -> None:
        frame = len(self.time_s)
        if frame == 0 or np.shape(self.position_mm) != (frame, 2):
            raise ValueError(
                f"the path of {self.label!r} has shape {np.shape(self.position_mm)}, expected "
                f"({frame}, 2) with at least one frame"
            )
        for name in ("commanded_kPa", "regulated_kPa"):
            if len(getattr(self, name)) != frame:
                raise ValueError(
                    f"{name} of {self.label!r} has {len(getattr(self, name))} frames, expected "
                    f"{frame} as in its path"
                )
        if not np.isfinite(self.position_mm).all():
            raise ValueError(f"the path of {self.label!r} must be finite; leave lost points out")

    @classmethod
    def of(cls, trial: Trial, label: str) -> MarkerActor:
        """Return the actor of a trial, from the start of its gait on.

        Raises:
            ValueError: The marker was not seen after the start of the gait.
        """
        track, log = trial.track, trial.pressures
        seen = track.time_s >= 0.0
        if not seen.any():
            raise ValueError(
                f"the track of {label!r} ends at {track.time_s[-1]:.2f} s, before the gait starts; "
                "is the start of the gait in the video right?"
            )
        time_s = track.time_s[seen]
        place = np.clip(np.searchsorted(log.time_s, time_s + 1e-9, side="right") - 1, 0, None)
        return cls(
            time_s,
            track.position_mm[seen] - track.position_mm[seen][0],
            log.commanded_kPa[place],
            trial.driven_kPa(time_s),
            label,
        )

    def frame_at(self, time_s: float) -> int:
        """Return the last frame at or before a time."""
        later = int(np.searchsorted(self.time_s, time_s + 1e-9, side="right"))
        return max(later - 1, 0)
