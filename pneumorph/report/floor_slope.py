"""How a picture shows that robots walk on a floor that is not level: tilted, and in words.

The floor's plane is level in a trajectory's world, whose gravity is tilted instead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pneumorph.trajectory import Trajectory

_LEAST_DEG = 0.05
"""What is less is told as level [degrees]."""


def slope_deg(trajectory: Trajectory) -> float:
    """Slope of the floor of a walk, positive if it rises forward [degrees]; 0 where it is not
    told."""
    settings = trajectory.metadata.get("settings")
    return float(settings.get("floor_slope_deg", 0.0)) if isinstance(settings, Mapping) else 0.0


def shown_slope_deg(slopes_deg: Sequence[float]) -> float:
    """Slope by which a picture of several walks is tilted: as far as all of them rise, or all
    fall [degrees]."""
    if not slopes_deg:
        return 0.0
    return max(min(slopes_deg), min(0.0, max(slopes_deg)))


def slope_words(slopes_deg: Sequence[float]) -> str:
    """Slopes of the floors in a picture, such as ``floor rising forward by 10 degrees``; empty
    where they are level."""
    low, high = min(slopes_deg, default=0.0), max(slopes_deg, default=0.0)
    if max(-low, high) < _LEAST_DEG:
        return ""
    if high - low < _LEAST_DEG:
        return f"floor {'rising' if high > 0.0 else 'falling'} forward by {abs(high):.3g} degrees"
    return f"floors of {low:+.1f} to {high:+.1f} degrees forward"
