"""How a full-order robot is simulated: time step, damping, floor, pressure supply."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from pneumorph.fem.floor import Floor, PlaneFloor
from pneumorph.fem.height_map import HeightMap
from pneumorph.fem.rotation import Rotation
from pneumorph.pressure import PressureMap
from pneumorph.settings import check_numbers

Damping = Literal["published", "objective"]
Integrator = Literal["linearly_implicit", "implicit_euler"]
FrictionSolver = Literal["newton", "gauss_seidel"]


@dataclass(frozen=True)
class FullOrderSettings:
    """Physics and numerics of full-order robots; the defaults are the published experiment's."""

    time_step_s: float = 0.01
    """Time step [s]."""
    integrator: Integrator = "linearly_implicit"
    """`linearly_implicit`: one linear solve a step, as published. `implicit_euler`: Newton's method
    with line search until all forces balance at the end of the step."""
    newton_tolerance: float = 1e-8
    """`implicit_euler` ends at this unbalanced impulse, relative to momentum, weight and
    pressure."""
    newton_iterations: int = 30
    """Most Newton iterations of a step."""
    step_halvings: int = 4
    """A step that fails is made as two of half the length, and those again, at most so deep."""
    damping: Damping = "published"
    """`published`: Rayleigh damping by the rotated linear stiffness, edge-based element rotations;
    it resists turning an inflated leg. `objective`: on rates of deformation alone, polar
    rotations."""
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
    height_map: HeightMap = field(default_factory=HeightMap)
    """Heights above the floor's, from an image or an array; without a path the floor is a plane."""
    contact_margin_mm: float = 1.0
    """Points that would come nearer to the floor than this within the step take part in the contact
    solve [mm]."""
    friction_solver: FrictionSolver = "newton"
    """`newton`: semi-smooth Newton after a few Gauss-Seidel sweeps, to the tolerance.
    `gauss_seidel`: sweeps alone, as in the published experiment (250 of them)."""
    contact_tolerance_mm_per_s: float = 1e-7
    """The friction solver stops when no contact law is violated by more than this [mm/s]."""
    contact_sweeps: int = 2000
    """Most Gauss-Seidel sweeps of a contact solve."""
    penetration_tolerance_mm: float = 0.01
    """A step that ends with a point deeper in the floor than this is solved again, with that point
    and with the floor linearised where the points came to lie [mm]."""
    contact_passes: int = 4
    """How often a step is solved at most."""
    penetration_limit_mm: float = 0.05
    """A step that still ends with a point deeper than this has failed [mm]."""
    regulator_count: int = 3
    """Number of pressure regulators."""
    pressure_rate_kPa_per_s: float = 150.0
    """How fast a regulator moves towards its command [real kPa/s]."""
    pressure_map: PressureMap = field(default_factory=PressureMap)
    """Real to simulated pressure."""
    speed_limit_mm_per_s: float = 1e5
    """A robot with a node faster than this has diverged [mm/s]."""

    def __post_init__(self) -> None:
        positive = (
            "time_step_s",
            "newton_tolerance",
            "newton_iterations",
            "contact_tolerance_mm_per_s",
            "contact_sweeps",
            "penetration_tolerance_mm",
            "contact_passes",
            "penetration_limit_mm",
            "regulator_count",
            "pressure_rate_kPa_per_s",
            "speed_limit_mm_per_s",
        )
        non_negative = (
            "step_halvings",
            "mass_damping_per_s",
            "stiffness_damping_s",
            "friction",
            "contact_margin_mm",
            "gravity_mm_per_s2",
        )
        check_numbers(self, positive, non_negative, ("floor_height_mm", "floor_slope_deg"))
        choices = {
            "integrator": get_args(Integrator),
            "damping": get_args(Damping),
            "friction_solver": get_args(FrictionSolver),
        }
        for name, known in choices.items():
            if getattr(self, name) not in known:
                raise ValueError(
                    f"{name} must be one of {', '.join(known)}, got {getattr(self, name)!r}"
                )

    @property
    def gravity_vector(self) -> np.ndarray:
        """Gravity along the floor's axes [mm/s^2], (3,)."""
        slope = math.radians(self.floor_slope_deg)
        return self.gravity_mm_per_s2 * np.array([-math.sin(slope), 0.0, -math.cos(slope)])

    def floor(self) -> Floor:
        """What the robot stands on.

        Raises:
            FileNotFoundError: The height map's file is missing.
            ValueError: It holds no heights.
        """
        if self.height_map.path is None:
            return PlaneFloor(self.floor_height_mm)
        return self.height_map.floor(self.floor_height_mm)

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
