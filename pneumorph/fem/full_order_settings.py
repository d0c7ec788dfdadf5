"""How a full-order robot is simulated: time step, damping, floor, pressure supply."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from pneumorph.fem.rotation import Rotation
from pneumorph.pressure import PressureMap
from pneumorph.settings import check_numbers

Damping = Literal["published", "objective"]


@dataclass(frozen=True)
class FullOrderSettings:
    """Physics and numerics of full-order robots; the defaults are the published experiment's."""

    time_step_s: float = 0.01
    """Time step [s]."""
    damping: Damping = "published"
    """`published`: Rayleigh damping by the rotated linear stiffness, edge-based element rotations;
    it resists turning an inflated leg. `objective`: on rates of deformation alone, polar
    rotations."""
    mass_damping_per_s: float = 0.1
    """Rayleigh mass coefficient alpha [1/s]."""
    stiffness_damping_s: float = 0.1
    """Rayleigh stiffness coefficient beta [s]."""
    gravity_mm_per_s2: float = 9800.0
    """Gravity, downwards along z [mm/s^2]."""
    friction: float = 1.2
    """Coulomb friction coefficient of every contact."""
    floor_height_mm: float = -12.797
    """Height where contact points rest [mm] (floor at -13.297 and contact distance 0.5)."""
    contact_margin_mm: float = 1.0
    """Points that would come nearer to the floor than this within the step take part in the contact
    solve [mm]."""
    contact_tolerance_mm_per_s: float = 1e-2
    """The friction solver stops when no contact law is violated by more than this [mm/s]."""
    contact_sweeps: int = 250
    """Most Gauss-Seidel sweeps of a step."""
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
            "gravity_mm_per_s2",
        )
        check_numbers(self, positive, non_negative, ("floor_height_mm",))
        if self.damping not in ("published", "objective"):
            raise ValueError(f'damping must be "published" or "objective", got {self.damping!r}')

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
        """Factor of K in the step's matrix, h (h + beta) [s^2]."""
        return self.time_step_s * (self.time_step_s + self.stiffness_damping_s)
