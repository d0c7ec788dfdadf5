"""A stand-in for reality: a robot that is off by a seeded amount, behind imperfect regulators."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from pneumorph.base.checked import Checked, CountOrNone, NotNegative, Positive
from pneumorph.hardware.driver import DriverError
from pneumorph.hardware.marker_track import MarkerTrack
from pneumorph.hardware.rig import RigSettings
from pneumorph.physics.air import Air
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.physics.regulators import AirRegulators, RateLimited, Regulators
from pneumorph.physics.surfaces import SURFACE_NAMES
from pneumorph.simulation.distribution import Distribution
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.trajectory import Trajectory


@dataclass(frozen=True)
class VirtualRigSettings(Checked):
    """A virtual rig: how its robot differs from the simulation, and how noisy its regulators,
    sensors and camera are. Distributions are written as in --randomisation, such as N(1, 0.05)."""

    seed: CountOrNone = 0
    """Seed of the virtual robot and of all noise. All trials with one seed have the same robot."""
    reality: Randomisation = field(
        default_factory=lambda: Randomisation(
            friction="N(1.1, 0.1)",
            modulus_factor="N(1.05, 0.1)",
            mass_factor="N(1, 0.03)",
            regulator_lag_s="U(0.05, 0.15)",
            floor_slope_deg="0",
        )
    )
    """Distributions of the virtual robot's own friction, modulus, masses, regulator lag and floor
    slope, drawn once from the seed."""
    surface_friction_factor: str = "N(1, 0.1)"
    """Friction of each surface relative to the simulation's, drawn for each, where the simulation
    has friction by surface and the reality does not say the surface's."""
    pressure_slope_factor: str = "N(1, 0.05)"
    """Slope of the virtual robot's pressure map, relative to the simulation's."""
    pressure_intercept_kPa: str = "N(-20, 3)"
    """Intercept of the virtual robot's pressure map [simulated kPa] if the simulation has the
    published map, whose intercept is -20.361. With another map, the intercept is off by the same
    real pressure."""
    filling_factor: str = "N(1, 0.1)"
    """Conductance through which each regulator fills, relative to the simulation's, drawn for each
    regulator. Only with --physics.air.law orifice; regulators then have no lag."""
    venting_factor: str = "N(1, 0.1)"
    """The same for venting."""
    regulator_noise_kPa: NotNegative = 0.3
    """Standard deviation of the noise on each regulated pressure [kPa]."""
    sensor_noise_kPa: NotNegative = 0.2
    """Standard deviation of the noise on each sensor reading [kPa]."""
    resolution_kPa: Positive = 0.1
    """Resolution of commands and sensor readings [kPa]; both are rounded to it."""
    frames_per_second: Positive = 30.0
    """Frame rate of the virtual camera that tracks the marker [1/s]."""
    marker_noise_mm: NotNegative = 0.2
    """Standard deviation of the noise on the tracked marker position [mm]."""
    marker_distance_mm: Positive = 40.0
    """Distance from the marker to one in front of it, by which the camera sees the robot turn
    [mm]."""
    bend_noise_deg: NotNegative = 0.5
    """Standard deviation of the noise on each measured bend, with --bend-test [degrees]."""
    friction_between_trials: NotNegative = 0.02
    """Standard deviation of the friction coefficient between trials, relative to its value; 0:
    every trial has the same floor."""
    settling_steps: CountOrNone = 15
    """Time steps at zero pressure before each trial, in which the robot settles on the floor."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("pressure_slope_factor", "pressure_intercept_kPa"):
            Distribution.parse(getattr(self, name), name)
        for name in ("surface_friction_factor", "filling_factor", "venting_factor"):
            if not Distribution.parse(getattr(self, name), name).lowest > 0.0:
                raise ValueError(
                    f"{name} is {getattr(self, name)!r}, expected every draw to be positive"
                )


@dataclass(frozen=True)
class Reality:
    """What is true behind the virtual rig; a calibration tries to find it."""

    world: World
    pressure_map: PressureMap

    def physics(self, usual: Physics) -> Physics:
        """Physics of the true robot behind regulators of the rig's own; the modulus and the mass
        are the robot's."""
        true = replace(self.world.applied_to(usual), pressure_map=self.pressure_map)
        return true.following_at_once()


def draw_reality(settings: VirtualRigSettings, simulated: PressureMap) -> Reality:
    """The reality of a seed.

    Args:
        settings: What is off.
        simulated: Pressure map of the simulation that the reality is off from.
    """
    rng = np.random.default_rng([settings.seed, 1])
    world = settings.reality.draw(rng)
    slope_factor = Distribution.parse(settings.pressure_slope_factor).draw(rng)
    published = PressureMap()
    # Intercepts are drawn for the published line; the same real pressure is more of a steeper one.
    steeper = simulated.slope / published.slope
    intercept_kPa = Distribution.parse(settings.pressure_intercept_kPa).draw(rng) * steeper
    shift_kPa = simulated.intercept_kPa - published.intercept_kPa * steeper
    return Reality(world, PressureMap(simulated.slope * slope_factor, intercept_kPa + shift_kPa))


def trial_reality(reality: Reality, settings: VirtualRigSettings, trial: int) -> Reality:
    """The reality of one trial: the floor is never quite the same twice."""
    rng = np.random.default_rng([settings.seed, 2, trial])
    factor = 1.0 + settings.friction_between_trials * float(rng.standard_normal())
    factor, usual = max(factor, 0.0), reality.world
    by_surface = tuple((name, mu * factor) for name, mu in usual.friction_by_surface)
    world = replace(usual, friction=usual.friction * factor, friction_by_surface=by_surface)
    return replace(reality, world=world)


def true_surfaces(
    settings: VirtualRigSettings, world: World, simulated: Physics
) -> tuple[tuple[str, float], ...]:
    """Coefficients of a seed's floor by surface: the world's own, and where the simulation has
    friction by surface those that it says and the world does not, each off by a draw of its own.

    Args:
        settings: What is off.
        world: The reality's.
        simulated: The physics that the reality is off from.

    Raises:
        ValueError: A friction of all surfaces is asked for where it would be that of none.
    """
    named, own = dict(simulated.friction_by_surface), dict(world.friction_by_surface)
    usual = VirtualRigSettings().reality.friction
    of_legs = not named.keys().isdisjoint(SURFACE_NAMES)  # which have all of these then
    if of_legs and settings.reality.friction != usual and not own.keys() >= set(SURFACE_NAMES):
        raise ValueError(
            f"virtual.reality.friction is {settings.reality.friction!r} and the simulation has "
            f"friction by surface, expected {usual!r}, the usual, with "
            "virtual.surface_friction_factor or virtual.reality.friction_by_surface: it would be "
            "ignored"
        )
    if of_legs:
        named = dict.fromkeys(SURFACE_NAMES, simulated.friction) | named
    rng = np.random.default_rng([settings.seed, 7])
    factor = Distribution.parse(settings.surface_friction_factor)
    off = {name: named[name] * factor.draw(rng) for name in sorted(named)}
    return tuple({**off, **own}.items())


def true_air(
    settings: VirtualRigSettings, world: World, simulated: Air, regulator_count: int
) -> Air:
    """The air of a seed's rig: each valve is off by a draw of its own.

    Args:
        settings: What is off.
        world: The reality's.
        simulated: Air of the simulation that the reality is off from.
        regulator_count: Valves.
    """
    rng = np.random.default_rng([settings.seed, 5])
    usual = simulated.scaled(world.filling_factor, world.venting_factor)

    def drawn(name: str, factor: Distribution) -> tuple[float, ...]:
        return tuple(c * factor.draw(rng) for c in usual.of_each(name, regulator_count))

    return replace(
        usual,
        filling_mm3_per_s_kPa=drawn(
            "filling_mm3_per_s_kPa", Distribution.parse(settings.filling_factor)
        ),
        venting_mm3_per_s_kPa=drawn(
            "venting_mm3_per_s_kPa", Distribution.parse(settings.venting_factor)
        ),
    )


class VirtualClock:
    """A clock whose time is the virtual rig's: waiting simulates."""

    def __init__(self, advance_to: Callable[[float], None]) -> None:
        self._advance_to, self._now_s = advance_to, 0.0

    def now_s(self) -> float:
        """Simulated time [s]."""
        return self._now_s

    def wait_until(self, time_s: float) -> None:
        """Simulate until then."""
        if time_s > self._now_s:
            self._advance_to(time_s)
            self._now_s = time_s


class VirtualRegulators:
    """Pressures that approach their commands with a first-order lag, within a rate or as air flows.

    Args:
        count: How many.
        regulators: How they move when nothing lags.
        lag_s: Time constant [s]; 0 for none.
        time_step_s: Time step [s].

    Attributes:
        target_kPa: Commands [kPa], (channel,).
        pressure_kPa: Pressures [kPa], (channel,).
    """

    def __init__(
        self, count: int, regulators: Regulators, lag_s: float, time_step_s: float
    ) -> None:
        self.target_kPa, self.pressure_kPa = np.zeros(count), np.zeros(count)
        self.time_step_s = time_step_s
        self._kept = math.exp(-time_step_s / lag_s) if lag_s > 0.0 else 0.0
        self._regulators = regulators

    def step(self) -> None:
        """Advance by one time step."""
        wanted = self.target_kPa + (self.pressure_kPa - self.target_kPa) * self._kept
        self.pressure_kPa = self._regulators.after(self.pressure_kPa, wanted, self.time_step_s)


Walk = Callable[[np.ndarray], Trajectory]
"""What the true robot does: pressures of every step [real kPa], (step, channel) -> its motion, with
a frame before the first step, settled on the floor, and one after each. It raises what
`VirtualRig.track` does."""


class VirtualRig:
    """Regulators with lag, noise and quantisation, and a robot they inflate.

    Nothing that a rig senses depends on how its robot moves, so the robot walks when the camera is
    asked what it saw.

    Args:
        walk: How the true robot moves; its settings must not limit the pressures' rate
            (`Reality.physics`).
        rig: Channels and rate of the rig.
        settings: How imperfect it is.
        lag_s: Time constant of the regulators [s].
        time_step_s: The robot's time step [s].
        trial: Number of the trial, which seeds the noise.
        air: The true regulators where air flows through valves; None where the rig's rate tells.

    Attributes:
        range_ratio: How far any leg of a reduced robot has gone since it settled, relative to the
            furthest snapshot it was reduced from; None where that is not known or nobody has asked
            for the track.
    """

    def __init__(
        self,
        walk: Walk,
        rig: RigSettings,
        settings: VirtualRigSettings,
        lag_s: float,
        time_step_s: float,
        trial: int = 1,
        air: AirRegulators | None = None,
    ) -> None:
        self._walk = walk
        self._rig, self._settings = rig, settings
        self._step_s = time_step_s
        self._rng = np.random.default_rng([settings.seed, 3, trial])
        self.regulators = VirtualRegulators(
            len(rig.channels), air or RateLimited(rig.rate_kPa_per_s), lag_s, time_step_s
        )
        self.range_ratio: float | None = None
        self._pressures_kPa: list[np.ndarray] = []
        self.clock = VirtualClock(self._advance_to)

    def open(self) -> None:
        """Nothing to connect to."""

    def command(self, pressure_kPa: np.ndarray) -> None:
        """Set every regulator [real kPa]."""
        self._rig.command_volts(pressure_kPa)  # hard limits hold here as on a real rig
        self.regulators.target_kPa = self._quantised(np.asarray(pressure_kPa, dtype=float))

    def sense(self) -> np.ndarray:
        """Sensed pressures [real kPa], (channel,); NaN where a channel has no sensor."""
        pressure = self.regulators.pressure_kPa
        noise = self._settings.sensor_noise_kPa * self._rng.standard_normal(len(pressure))
        return self._rig.of_sensors(self._quantised(pressure + noise))

    def vent(self) -> None:
        """Command zero."""
        self.regulators.target_kPa = np.zeros_like(self.regulators.target_kPa)

    def confirm(self) -> None:
        """It always takes what it is told."""

    def close(self) -> None:
        """Nothing to let go of."""

    def track(self) -> MarkerTrack | None:
        """What the camera saw, from the opening of the rig; None of fewer than two frames.

        Raises:
            DriverError: The robot's simulation diverged.
        """
        settings = self._settings
        every = 1.0 / (settings.frames_per_second * self._step_s)
        frames = np.arange(0.0, len(self._pressures_kPa) + 1 - 1e-9, every)
        if len(frames) < 2:
            return None
        walked = self._walk(np.array(self._pressures_kPa))
        if walked.status != "completed":
            raise DriverError(f"the virtual robot's simulation {walked.status}")
        self.range_ratio = walked.metadata.get("range_ratio")
        # Of both markers: forward and left of the first, then of the one ahead from there.
        ahead = settings.marker_distance_mm * walked.hub_rotation[:, :2, 0]
        places = np.column_stack([walked.tracked_point_mm[:, :2], ahead])
        steps = np.arange(len(places))
        seen = np.column_stack([np.interp(frames, steps, each) for each in places.T])
        noise = settings.marker_noise_mm * self._rng.standard_normal((2, len(frames), 2))
        seen[:, :2] += noise[0]
        seen[:, 2:] += noise[1] - noise[0]
        turned = np.unwrap(np.degrees(np.arctan2(seen[:, 3], seen[:, 2])), period=360.0)
        return MarkerTrack(frames * self._step_s, seen[:, :2], turned)

    def _advance_to(self, time_s: float) -> None:
        for _ in range(round(time_s / self._step_s) - len(self._pressures_kPa)):
            self.regulators.step()
            noise_kPa = self._settings.regulator_noise_kPa * self._rng.standard_normal(
                len(self._rig.channels)
            )
            self._pressures_kPa.append(np.maximum(0.0, self.regulators.pressure_kPa + noise_kPa))

    def _quantised(self, pressure: np.ndarray) -> np.ndarray:
        step = self._settings.resolution_kPa
        return np.round(pressure / step) * step
