"""The physics of a page's numbers, in a line: what most decides how far a robot walks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any, Protocol, get_args, runtime_checkable

from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.catalogue.part_physics import PhysicsName
from pneumorph.physics.air import Air
from pneumorph.physics.physics import Physics
from pneumorph.report.floor_slope import slope_words
from pneumorph.trajectory import Trajectory

_SURFACE = {
    "friction": "friction",
    "friction_by_surface": "friction",
    "friction_pressure": "friction",
    "floor_slope_deg": "slope",
    "ground": "ground",
    "start": "start",
    "floor_height_mm": "floor height",
    "pressure_map": "pressure map",
}
"""Settings that tell where a robot walks, or what its pressures mean, rather than how it is
simulated, as they are called."""


def physics_name(physics: Physics) -> str:
    """What a physics is called, such as ``measured physics``, or ``measured physics but for
    friction`` where only surfaces differ; its damping where it is none that has a name. How many
    regulators there are and how chambers grow is of the robot."""
    own = _whatever_the_robot(physics)
    for name in get_args(PhysicsName):
        usual = _whatever_the_robot(leg_kind(name).physics)
        other = [field for field in usual if usual[field] != own[field]]
        if set(other) <= _SURFACE.keys():
            differ = " and ".join(dict.fromkeys(_SURFACE[field] for field in other))
            return f"{name} physics" + (f" but for {differ}" if differ else "")
    return f"{physics.damping} damping"


def _whatever_the_robot(physics: Physics) -> dict[str, Any]:
    """Its settings but for those that a robot decides."""
    content = settings_to_dict(physics)
    del content["regulator_count"], content["air"]["chamber_growth"]
    return content


def physics_words(physics: Physics) -> str:
    """Name, damping, friction of each surface, slope, ground, start and air, such as ``published
    physics, published damping, friction 1.2, pressures by 150 kPa/s``."""
    words = [physics_name(physics)]
    if words[0] != f"{physics.damping} damping":
        words.append(f"{physics.damping} damping")
    words.append(f"friction {physics.friction:g}")
    words += [f"of {name} {value:g}" for name, value in physics.friction_by_surface]
    if physics.friction_pressure.exponent != 0.0:
        words.append(f"by contact pressure to the power {physics.friction_pressure.exponent:g}")
    if slope := slope_words([physics.floor_slope_deg]):
        words.append(slope)
    if not physics.ground.is_plane:
        words.append(physics.ground.description)
    if not physics.start.is_usual:
        words.append(physics.start.description)
    if physics.air.law == "rate_limit":
        words.append(f"pressures by {physics.pressure_rate_kPa_per_s:g} kPa/s")
    else:
        words.append(f"air through valves from {physics.air.supply_kPa:g} kPa")
        usual = (Air().chamber_growth, leg_kind("measured").physics.air.chamber_growth)
        if physics.air.chamber_growth not in usual:
            growth = " ".join(f"{order:.3g}" for order in physics.air.chamber_growth)
            words.append(f"chamber growth {growth or 'none'}")
    return ", ".join(words)


def physics_of_walks(trajectories: Iterable[Trajectory]) -> str:
    """The names of what robots walked in, each once, as their trajectories tell; empty where none
    does."""
    told = (trajectory.metadata.get("settings") for trajectory in trajectories)
    names = [physics_name(physics) for each in told if (physics := _read(each)) is not None]
    return ", ".join(dict.fromkeys(names))


def _read(settings: Any) -> Physics | None:
    """The physics among settings of a trajectory, of which an earlier version may lack some."""
    if not isinstance(settings, Mapping) or "damping" not in settings:
        return None
    known = {field.name for field in fields(Physics)}
    try:
        return settings_from_dict(Physics, {k: v for k, v in settings.items() if k in known})
    except ValueError:
        return None


@runtime_checkable
class Damped(Protocol):
    """A result whose robots were simulated."""

    @property
    def damping(self) -> str | None: ...


@runtime_checkable
class InPhysics(Protocol):
    """A result that knows all of the physics; of earlier versions it is None."""

    @property
    def physics(self) -> Physics | None: ...


@dataclass(frozen=True)
class Simulated:
    """What a result of any kind tells of how its robots were simulated."""

    physics: Physics | None = None
    damping: str | None = None
    model: str | None = None


MEAN_OVER_WORLDS = "mean over the training's worlds"
"""What the numbers of a training's pairs are, where designs walk in several worlds each."""


def walked_in(physics: str, drawn: bool = False) -> str:
    """A sentence of where robots walk; empty where that is not known.

    Args:
        physics: Its words.
        drawn: Whether their worlds are drawn at random.
    """
    around = "worlds drawn around " if drawn else ""
    return f"Robots walk in {around}{physics}." if physics else ""


def physics_of(found: object) -> str:
    """The words of what a result's robots were simulated in, empty where none were; results of
    earlier versions know their damping alone."""
    if isinstance(found, InPhysics) and found.physics is not None:
        return physics_words(found.physics)
    return f"{found.damping} damping" if isinstance(found, Damped) and found.damping else ""
