"""What is simulated, whatever the model: damping, gravity, floor, friction, pressure supply."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

import numpy as np

from pneumorph.base.checked import Bounds, Checked, NotNegative, Positive
from pneumorph.base.settings import settings_known_before
from pneumorph.geometry.contact_surfaces import ContactSurfaces
from pneumorph.geometry.pose import Pose
from pneumorph.physics.air import Air
from pneumorph.physics.commands import RegulatorCount
from pneumorph.physics.floor import Floor
from pneumorph.physics.friction import FrictionCoefficient, FrictionPressure, check_surfaces
from pneumorph.physics.ground import Ground
from pneumorph.physics.pressure import PressureMap
from pneumorph.physics.regulators import RateLimited, Regulators, air_regulators
from pneumorph.physics.start_pose import StartPose
from pneumorph.physics.surfaces import names_of_friction

_LATER_CHOICES = ("air", "friction_by_surface", "friction_pressure", "ground", "start")
"""What physics could not be asked for when the first runs and walks were kept."""

UNLIMITED_KPA_PER_S = 1e9
"""A rate that is no limit [kPa/s]."""

Damping = Literal["published", "objective"]
Rotation = Literal["edge", "polar"]
"""Where an element's rotation is taken from: its first edge and face, or the polar decomposition of
its deformation gradient, which is objective and exact."""

LONGEST_STEP_S = 0.1
"""Longest time step [s], about as long as the published damping's time and as a swing of a leg.

The error of a distance is in proportion to the step up to here: the furthest gait of
``reproduce/fast_schedule`` goes 30.3 cm at 0.0025 s, 29.2 at 0.01 and 19.2 at 0.1. Beyond, even the
direction is lost: the expert's gait at 110 degrees goes -1.2, -1.0, -0.3 cm, and 0.6 at 0.2 s."""


LEAST_GRAVITY_MM_PER_S2 = 100.0
"""Gravity below this is taken for one in other units [mm/s^2]; the Moon has 1620."""


@dataclass(frozen=True)
class Physics(Checked):
    """Physics that the reduced and the full model share.

    Made without arguments it is the published one. The numerics of each model are settings of their
    own. The time step is part of the physics,
    because implicit Euler damps more with a longer one.

    Raises:
        ValueError: A number is out of range, no such damping, or another number of regulators'
            conductances than of regulators.
    """

    time_step_s: Annotated[
        float,
        Bounds(above=0.0, most=LONGEST_STEP_S, why="a longer step cannot resolve how a leg swings"),
    ] = 0.01
    """Time step [s]. Actions and settling are counted in steps, so with another one
    --task.action-step-count and --task.settling-step-count (15, which are 0.15 s) need another
    number, too."""
    damping: Damping = "published"
    """`published`: Rayleigh damping on absolute velocities, with the rotated linear stiffness and
    edge-based element rotations, as in the paper; it resists rotating an inflated leg. `objective`:
    frame-indifferent stiffness damping, only on rates of deformation, with polar rotations; mass
    damping takes momentum all the same."""
    mass_damping_per_s: NotNegative = 0.1
    """Rayleigh mass coefficient alpha [1/s]: with either damping all momentum falls as
    exp(-alpha t)."""
    stiffness_damping_s: NotNegative = 0.1
    """Rayleigh stiffness coefficient beta [s]."""
    gravity_mm_per_s2: NotNegative = 9800.0
    """Gravity [mm/s^2]."""
    floor_slope_deg: Annotated[
        float, Bounds(above=-90.0, below=90.0, why="a floor that is steeper is a ceiling")
    ] = 0.0
    """Slope of the floor, positive if it rises forward (x) [degrees]; x and z are along and normal
    to it."""
    friction: FrictionCoefficient = 1.2
    """Coulomb friction coefficient of every contact whose surface is not named below."""
    friction_by_surface: tuple[tuple[str, FrictionCoefficient], ...] = ()
    """Coefficients of surfaces by name, such as `sheet 0.6 skin 1.0 hub 0.3`: the named regions of
    the parts' meshes, and the hub's."""
    friction_pressure: FrictionPressure = field(default_factory=FrictionPressure)
    """How every friction coefficient changes with contact pressure."""
    floor_height_mm: float = -12.797
    """Height where contact points rest [mm] on a level floor."""
    ground: Ground = field(default_factory=Ground)
    """Shape of the floor where it is not a plane."""
    start: StartPose = field(default_factory=StartPose)
    """How the robot is put on the floor."""
    regulator_count: RegulatorCount = 3
    """Number of pressure regulators."""
    pressure_rate_kPa_per_s: Positive = 150.0
    """How fast a regulator moves towards its command with `--physics.air.law rate_limit` [real
    kPa/s]."""
    air: Air = field(default_factory=Air)
    """How air fills and vents the chambers."""
    pressure_map: PressureMap = field(default_factory=PressureMap)
    """Real to simulated pressure."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("filling_mm3_per_s_kPa", "venting_mm3_per_s_kPa"):
            self.air.of_each(name, self.regulator_count)
        check_surfaces(self.friction_by_surface)
        if 0.0 < self.gravity_mm_per_s2 < LEAST_GRAVITY_MM_PER_S2:
            raise ValueError(
                f"gravity_mm_per_s2 is {self.gravity_mm_per_s2:g}, expected 0 or at least "
                f"{LEAST_GRAVITY_MM_PER_S2:g}: it may be in m/s^2, of which 9.8 are 9800 mm/s^2"
            )

    def described(self) -> dict[str, Any]:
        """Settings by name, which tell kept things apart; those that earlier versions did not have
        are named where they are not as usual, so that what was kept then is found."""
        return settings_known_before(self, _LATER_CHOICES)

    def regulators(self, chamber_mm3: Sequence[float] | np.ndarray) -> Regulators:
        """The regulators of a robot.

        Args:
            chamber_mm3: Volume of all chambers of each without pressure [mm^3], (regulator,).
        """
        if self.air.law == "rate_limit":
            return RateLimited(self.pressure_rate_kPa_per_s)
        return air_regulators(self.air, chamber_mm3)

    def following_at_once(self) -> Physics:
        """The same with regulators that are at their commands in every step, as where those are
        pressures that were sensed."""
        return replace(self, pressure_rate_kPa_per_s=UNLIMITED_KPA_PER_S, air=Air())

    def surface_friction(self, surfaces: ContactSurfaces) -> np.ndarray:
        """Coefficient of contact points by their surfaces, whatever presses on them, (point,).

        Raises:
            ValueError: A coefficient is given for a surface that there is not; of a robot that
                names its surfaces as others do some of these may not touch the floor, and others
                may be of legs that its design has not.
        """
        coefficients = np.full(len(surfaces.names), self.friction)
        known = surfaces.known_names()
        allowed = names_of_friction(known) | set(surfaces.elsewhere)
        for name, value in self.friction_by_surface:
            if name not in allowed:
                raise ValueError(
                    f"friction_by_surface names {name!r}, expected one of the robot's surfaces: "
                    f"{', '.join(known) or 'none, its meshes name no regions'}"
                )
            coefficients[surfaces.names == name] = value
        return coefficients

    def reference_impulses(self, surfaces: ContactSurfaces) -> np.ndarray:
        """Normal impulses of a step at which points have their given coefficients [mN s], (point,).

        Raises:
            ValueError: Friction depends on pressure, and a point's area is not known.
        """
        if self.friction_pressure.exponent != 0.0 and not np.all(surfaces.area_mm2 > 0.0):
            raise ValueError(
                "friction_pressure.exponent is "
                f"{self.friction_pressure.exponent:g}, expected 0 for a robot whose contact points "
                "have no areas; its parts may have been reduced by an earlier version"
            )
        pressed: np.ndarray = (
            self.time_step_s * self.friction_pressure.pressure_kPa * surfaces.area_mm2
        )
        return pressed

    def contact_friction(
        self, surfaces: ContactSurfaces, normal_impulses: np.ndarray
    ) -> np.ndarray:
        """Coefficient of contact points in a step, (42) of docs/physics.md, (..., point).

        Args:
            surfaces: What the points lie on.
            normal_impulses: Of the last step, of this length [mN s], (..., point).

        Raises:
            ValueError: As `surface_friction` and `reference_impulses`.
        """
        coefficients, law = self.surface_friction(surfaces), self.friction_pressure
        if law.exponent == 0.0:
            return coefficients
        relative = normal_impulses / self.reference_impulses(surfaces)
        scaled: np.ndarray = coefficients * law.factor(law.pressure_kPa * relative)
        return scaled

    def start_pose(self, points: np.ndarray) -> Pose:
        """How a robot is put on the floor, x_floor = R x_robot + t.

        Args:
            points: Its contact points in its own frame, undeformed [mm], (point, 3).
        """
        return self.start.pose(points, self.floor_height_mm if self.ground.is_plane else None)

    def floor(self, points: np.ndarray) -> Floor:
        """What a robot stands on; raises as `Ground.floor`. A lift is above it, whatever its shape.

        Args:
            points: Its contact points in its own frame, undeformed [mm], (point, 3).
        """
        standing = points if self.start.is_usual else self.start_pose(points).apply(points)
        standing = standing - [0.0, 0.0, self.start.lift_mm]
        return self.ground.floor(self.floor_height_mm, standing)

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
