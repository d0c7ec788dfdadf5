"""A real robot in a film or a replay: all that is known of it is the path of its marker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.scene import ColourBy
from pneumorph.report.style import red_green_blue

if TYPE_CHECKING:
    from pneumorph.hardware.trial import Trial

TRIAD_COLOURS = ("#D55E00", "#009E73", "#0072B2")
"""Of the axes x, y and z."""
_TRIAD_MM = 60.0
_CUBE_MM = 5.0


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

    def travelled(self, frame: int) -> str:
        """How far forward it is at a frame, for a person."""
        start, now = self.path_mm[[0, frame], 0]
        return f"{(now - start) / 10:+.1f} cm"

    @classmethod
    def of(cls, trial: Trial, label: str) -> MarkerActor:
        """Return the actor of a trial, from the start of its gait on.

        Raises:
            ValueError: The marker was not seen after the start of the gait.
        """
        track, log = trial.track, trial.pressures
        if not len(log.time_s):
            raise ValueError(f"the log of {label!r} has no samples, expected at least one")
        if not track.time_s[-1] > 0.0:
            raise ValueError(
                f"the track of {label!r} ends at {track.time_s[-1]:.2f} s, before the gait starts; "
                "is the start of the gait in the video right?"
            )
        time_s = np.append(0.0, track.time_s[track.time_s > 0.0])
        position = np.column_stack(
            [np.interp(time_s, track.time_s, each) for each in track.position_mm.T]
        )
        return cls(
            time_s,
            position - position[0],
            log.commanded_at(time_s),
            trial.driven_kPa(time_s),
            label,
        )

    @property
    def end_s(self) -> float:
        """Time of its last frame [s]."""
        return float(self.time_s[-1])

    @property
    def path_mm(self) -> np.ndarray:
        """Way of the marker from above, in its lane, (frame, 2)."""
        return np.asarray(self.position_mm + np.array([0.0, self.lane_mm]))

    def extent_mm(self) -> np.ndarray:
        """Return points around all that it will be drawn with, (point, 3), on a floor at z = 0."""
        ends = np.stack([self.path_mm.min(axis=0), self.path_mm.max(axis=0)])
        points = np.concatenate([ends - _TRIAD_MM, ends + _TRIAD_MM])
        return np.hstack([points, np.zeros((4, 1))])

    def corners(self, frame: int) -> np.ndarray:
        """Return the triangles of a triad, (triangle, 3, 3) mm, on a floor at z = 0.

        A marker has a place and no direction: the triad's axes are the world's.
        """
        place = np.append(self.path_mm[frame], _CUBE_MM / 2)
        return np.asarray(_TRIAD + place)

    def colours(
        self, frame: int, colour_by: ColourBy = "regulator", full_kPa: float | None = None
    ) -> np.ndarray:
        """Return the colour of each triangle of `corners`, (triangle, 3) in 0..1: no pressure's."""
        axes = np.array([red_green_blue(colour) for colour in TRIAD_COLOURS])
        return np.repeat(axes, len(_TRIAD) // 3, axis=0)

    def frame_at(self, time_s: float) -> int:
        """Return the last frame at or before a time."""
        return max(int(np.searchsorted(self.time_s, time_s + 1e-9, side="right")) - 1, 0)


def _triad() -> np.ndarray:
    """Return rows of small cubes along the axes as triangles with outward normals."""
    unit = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - 0.5
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    cube = _CUBE_MM * unit[[each for a, b, c, d in faces for each in ((a, b, c), (a, c, d))]]
    places = np.arange(_CUBE_MM / 2, _TRIAD_MM, _CUBE_MM)
    return np.concatenate([cube + place * axis for axis in np.eye(3) for place in places])


_TRIAD = _triad()
