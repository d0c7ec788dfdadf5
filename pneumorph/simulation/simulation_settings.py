"""How robots are simulated: time step, damping, floor, pressure supply."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from pneumorph.pressure import PressureMap
from pneumorph.settings import check_numbers

Damping = Literal["published", "objective"]
Precision = Literal["single", "double"]
InstructionSet = Literal["best", "avx512", "avx2", "baseline"]


@dataclass(frozen=True)
class SimulationSettings:
    """Physics and numerics of the reduced robots; the defaults are the published experiment's."""

    time_step_s: float = 0.01
    """Time step [s]."""
    damping: Damping = "published"
    """`published`: Rayleigh damping on absolute velocities with edge-based element rotations, as in
    the paper; it resists turning an inflated leg. `objective`: on rates of deformation alone, with
    polar rotations."""
    mass_damping_per_s: float = 0.1
    """Rayleigh mass coefficient [1/s]."""
    stiffness_damping_s: float = 0.1
    """Rayleigh stiffness coefficient [s]."""
    gravity_mm_per_s2: float = 9800.0
    """Gravity [mm/s^2]."""
    floor_slope_deg: float = 0.0
    """How steeply the floor rises forward (x) [degrees]; x and z are along and normal to it."""
    friction: float = 1.2
    """Coulomb friction coefficient of every contact."""
    floor_height_mm: float = -12.797
    """Height where contact points rest [mm] (floor at -13.297 and contact distance 0.5)."""
    contact_margin_mm: float = 2.0
    """Points nearer to the floor than this are watched: they take part in the contact solve where
    they would pass the floor [mm]."""
    contact_tolerance_mm_per_s: float = 1e-2
    """The friction solver stops when no contact law is violated by more than this [mm/s]."""
    contact_sweeps: int = 100
    """Most Gauss-Seidel sweeps of a step, made where Newton's method fails."""
    regulator_count: int = 3
    """Number of pressure regulators."""
    pressure_rate_kPa_per_s: float = 150.0
    """How fast a regulator moves towards its command [real kPa/s]."""
    pressure_map: PressureMap = field(default_factory=PressureMap)
    """Real to simulated pressure."""
    speed_limit_mm_per_s: float = 1e4
    """A robot faster than this has diverged [mm/s]."""
    tangent_tolerance_mm_per_s: float = 1.0
    """A leg keeps its stiffness from step to step while two predictions of what that stiffness
    lacks, from one step before and from two, part by no more than this velocity, root mean square
    over the leg [mm/s], and while it lacks less than three tenths along the motion; 0 finds the
    stiffness afresh in every step. For corotational parts."""
    element_precision: Precision = "single"
    """Arithmetic of element forces and stiffness and of the cavity's cubic term; everything else is
    double precision."""
    instruction_set: InstructionSet = "best"
    """Which build of the stepper to run; `best` asks the processor."""

    def __post_init__(self) -> None:
        choices = {
            "damping": get_args(Damping),
            "element_precision": get_args(Precision),
            "instruction_set": get_args(InstructionSet),
        }
        for name, known in choices.items():
            value = getattr(self, name)
            if value not in known:
                raise ValueError(f"{name} must be one of {', '.join(known)}, got {value!r}")
        positive = (
            "time_step_s",
            "contact_tolerance_mm_per_s",
            "contact_sweeps",
            "regulator_count",
            "pressure_rate_kPa_per_s",
            "speed_limit_mm_per_s",
        )
        non_negative = (
            "mass_damping_per_s",
            "stiffness_damping_s",
            "friction",
            "contact_margin_mm",
            "tangent_tolerance_mm_per_s",
            "gravity_mm_per_s2",
        )
        check_numbers(self, positive, non_negative, ("floor_height_mm", "floor_slope_deg"))

    @property
    def gravity_vector(self) -> np.ndarray:
        """Gravity along the floor's axes [mm/s^2], (3,)."""
        slope = math.radians(self.floor_slope_deg)
        return self.gravity_mm_per_s2 * np.array([-math.sin(slope), 0.0, -math.cos(slope)])
