"""What is simulated, whatever the model: damping, gravity, floor, friction, pressure supply."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from pneumorph.base.settings import check_choices, check_numbers
from pneumorph.physics.pressure import PressureMap

Damping = Literal["published", "objective"]
Rotation = Literal["edge", "polar"]
"""Where an element's rotation is taken from: its first edge and face, or the polar decomposition of
its deformation gradient, which is objective and exact."""


@dataclass(frozen=True)
class Physics:
    """Physics that the reduced and the full model share; the defaults are the published ones.

    What only one of the models has, its numerics, is in `StepperSettings` and `FullOrderSettings`.
    The time step stands here since implicit Euler damps with it: robots of another step are others.

    Raises:
        ValueError: A number is out of range, or no such damping.
    """

    time_step_s: float = 0.01
    """Time step [s]."""
    damping: Damping = "published"
    """`published`: Rayleigh damping on absolute velocities by the rotated linear stiffness, with
    edge-based element rotations, as in the paper; it resists turning an inflated leg. `objective`:
    frame-indifferent, on rates of deformation alone, with polar rotations."""
    mass_damping_per_s: float = 0.1
    """Rayleigh mass coefficient alpha [1/s]."""
    stiffness_damping_s: float = 0.1
    """Rayleigh stiffness coefficient beta [s]."""
    gravity_mm_per_s2: float = 9800.0
    """Gravity [mm/s^2]."""
    floor_slope_deg: float = 0.0
    """How steeply the floor rises forward (x) [degrees]; x and z are along and normal to it."""
    friction: float = 1.2
    """Coulomb friction coefficient of every contact."""
    floor_height_mm: float = -12.797
    """Height where contact points rest [mm] (floor at -13.297 and contact distance 0.5)."""
    regulator_count: int = 3
    """Number of pressure regulators."""
    pressure_rate_kPa_per_s: float = 150.0
    """How fast a regulator moves towards its command [real kPa/s]."""
    pressure_map: PressureMap = field(default_factory=PressureMap)
    """Real to simulated pressure."""

    def __post_init__(self) -> None:
        check_choices(self, {"damping": get_args(Damping)})
        check_numbers(
            self,
            positive=("time_step_s", "regulator_count", "pressure_rate_kPa_per_s"),
            non_negative=(
                "mass_damping_per_s",
                "stiffness_damping_s",
                "friction",
                "gravity_mm_per_s2",
            ),
            finite=("floor_height_mm", "floor_slope_deg"),
        )

    @property
    def gravity_vector(self) -> np.ndarray:
        """Gravity along the floor's axes [mm/s^2], (3,)."""
        slope = math.radians(self.floor_slope_deg)
        return self.gravity_mm_per_s2 * np.array([-math.sin(slope), 0.0, -math.cos(slope)])

    @property
    def rotation(self) -> Rotation:
        """Where elements take their rotation from."""
        return "edge" if self.damping == "published" else "polar"

    @property
    def mass_factor(self) -> float:
        """Factor of M in the step's matrix, 1 + alpha h."""
        return 1.0 + self.mass_damping_per_s * self.time_step_s

    @property
    def stiffness_factor(self) -> float:
        """Factor of D in the linearly implicit step's matrix, h (h + beta) [s^2]."""
        return self.time_step_s * (self.time_step_s + self.stiffness_damping_s)
