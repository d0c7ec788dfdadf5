"""A robot of box-shaped legs that slides forward: everything a film needs, without physics."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pneumorph.trajectory import Trajectory

_BOX_CORNERS = np.array([[x, y, z] for x in (-57.0, 57.0) for y in (-16.0, 16.0) for z in (0, 20)])
_BOX_SKIN = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)
MakeTrajectory = Callable[..., Trajectory]


@pytest.fixture
def make_trajectory() -> MakeTrajectory:
    """Return a function that makes the trajectory of a design moving at a constant speed."""

    def make(design: str = "1.0.0.2.2.0.0.1", speed_mm_per_s: float = 5.0) -> Trajectory:
        time_s = np.linspace(0.0, 2.0, 21)
        hub = np.stack([speed_mm_per_s * time_s, 0 * time_s, 0 * time_s], axis=1)
        legs = []
        for location, regulator in enumerate(int(part) for part in design.split(".")):
            if regulator:
                angle = 2 * np.pi * (location + 0.5) / 8
                turn = np.array(
                    [
                        [np.cos(angle), -np.sin(angle), 0],
                        [np.sin(angle), np.cos(angle), 0],
                        [0, 0, 1],
                    ]
                )
                legs.append((_BOX_CORNERS + np.array([100, 0, 5])) @ turn.T)
        nodes = np.stack(legs)[None] + hub[:, None, None]
        pressure = 45 - 45 * np.cos(np.outer(np.pi * time_s, [1.0, 1.5, 2.0]))
        return Trajectory(
            time_s=time_s,
            hub_position_mm=hub,
            hub_rotation=np.tile(np.eye(3), (21, 1, 1)),
            tracked_point_mm=hub + np.array([0, 0, 45]),
            commanded_kPa=pressure,
            regulated_kPa=pressure,
            contact_count=np.full(21, 12),
            node_positions_mm=nodes.astype(np.float32),
            skin_triangles=_BOX_SKIN,
            metadata={"design": design},
        )

    return make
