"""Domain randomisation: worlds that differ from the simulated one as reality may."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.checked import Bounds, Checked
from pneumorph.base.settings import settings_known_before, settings_to_dict
from pneumorph.physics.friction import FRICTION_BOUNDS, check_surfaces
from pneumorph.physics.physics import Physics
from pneumorph.simulation.distribution import Distribution

_LATER_CHOICES = (
    "filling_factor",
    "venting_factor",
    "friction_by_surface",
    "damping_factor",
    "mounting_angle_deg",
    "reductions",
    "measured",
    "ground_roughness_mm",
)
"""What could not be drawn when the first trainings were kept."""

_OWN_GENERATOR = {"filling_factor": 0, "venting_factor": 0}
_OWN_GENERATOR |= {"damping_factor": 2, "mounting_angle_deg": 2, "ground_roughness_mm": 3}
"""Which generator draws what could not be drawn then; surfaces have the second."""

_FACTOR = Bounds(above=0.0, most=50.0, why="it is a factor: 85 percent are 0.85")
_BOUNDS = {
    "friction": FRICTION_BOUNDS,
    "modulus_factor": _FACTOR,
    "mass_factor": _FACTOR,
    "regulator_lag_s": Bounds(least=0.0, most=10.0, why="it is in seconds"),
    "filling_factor": _FACTOR,
    "venting_factor": _FACTOR,
    "floor_slope_deg": Bounds(above=-90.0, below=90.0),
    "damping_factor": _FACTOR,
    "mounting_angle_deg": Bounds(least=-15.0, most=15.0),
}
"""Of every draw; others are not negative."""


@dataclass(frozen=True)
class World:
    """One draw of what is uncertain."""

    friction: float
    """Coulomb friction coefficient."""
    modulus_factor: float
    """Young's moduli of the legs relative to the model's."""
    mass_factor: float
    """Masses of legs and hub relative to the model's."""
    regulator_lag_s: float
    """Time constant of the regulators, first order [s]."""
    floor_slope_deg: float
    """How much more steeply the floor rises forward than that of the physics [degrees]."""
    filling_factor: float = 1.0
    """The regulators' filling conductances relative to the model's."""
    venting_factor: float = 1.0
    """Their venting conductances relative to the model's."""
    friction_by_surface: tuple[tuple[str, float], ...] = ()
    """Friction coefficients of surfaces by name; others that the physics names keep theirs."""
    damping_factor: float = 1.0
    """The legs' damping relative to the model's: branches that relax, and stiffness damping."""
    mounting_angle_deg: float = 0.0
    """How much further down legs point than their mounting has it, however they are rolled
    [degrees]."""
    reduction: str = ""
    """File of the reduced part that all legs are; empty for the robot's own."""
    ground_roughness_mm: float = 0.0
    """Roughness of a ground of its own [mm]; 0 for that of the physics."""
    ground_seed: int = 0
    """Which surface of that roughness it is."""

    @classmethod
    def nominal(cls, physics: Physics) -> World:
        """The world as physics have it, with regulators that do not lag."""
        return cls(physics.friction, 1.0, 1.0, 0.0, 0.0)

    def applied_to(self, physics: Physics) -> Physics:
        """Physics of this world; what is said of the legs is the robots', the lag the command's."""
        by_surface = {**dict(physics.friction_by_surface), **dict(self.friction_by_surface)}
        ground = physics.ground
        if self.ground_roughness_mm > 0.0:
            rough = replace(
                ground.rough, roughness_mm=self.ground_roughness_mm, seed=self.ground_seed
            )
            ground = replace(ground, rough=rough)
        return replace(
            physics,
            ground=ground,
            friction=self.friction,
            floor_slope_deg=physics.floor_slope_deg + self.floor_slope_deg,
            friction_by_surface=tuple(by_surface.items()),
            air=physics.air.scaled(self.filling_factor, self.venting_factor),
            stiffness_damping_s=self.damping_factor * physics.stiffness_damping_s,
        )

    def of_full_order(self) -> dict[str, Any]:
        """All of it that decides how finite elements walk by name, which tells kept walks apart; a
        ground of its own where it has one."""
        content = settings_to_dict(replace(self, reduction=""))
        if self.ground_roughness_mm == 0.0:
            del content["ground_roughness_mm"], content["ground_seed"]
        return content

    @property
    def numbers(self) -> dict[str, float]:
        """Its numbers by name, such as ``modulus_factor`` and ``friction sheet``; the roughness
        where it has a ground of its own."""
        own = {name: value for name, value in vars(self).items() if isinstance(value, float)}
        if self.ground_roughness_mm == 0.0:
            del own["ground_roughness_mm"]
        return own | {f"friction {name}": value for name, value in self.friction_by_surface}


@dataclass(frozen=True)
class Randomisation(Checked):
    """Distributions of what is uncertain: uniform U(0.9, 1.5), normal N(0, 0.5), or a number."""

    friction: str = "U(0.9, 1.5)"
    """Coulomb friction coefficient of surfaces that have no coefficient of their own."""
    modulus_factor: str = "U(0.8, 1.25)"
    """Young's moduli of the legs, relative to the model's."""
    mass_factor: str = "U(0.9, 1.1)"
    """Masses of legs and hub, relative to the model's."""
    regulator_lag_s: str = "U(0, 0.2)"
    """Time constant of the regulators, first order [s]."""
    floor_slope_deg: str = "N(0, 0.5)"
    """How much more steeply the floor rises forward than that of the physics [degrees]."""
    filling_factor: str = "1"
    """Conductances through which regulators fill, relative to the model's, where air flows through
    valves."""
    venting_factor: str = "1"
    """Conductances through which they vent, relative to the model's."""
    friction_by_surface: tuple[tuple[str, str], ...] = ()
    """Distributions for surfaces by name, such as `sheet "U(0.4, 1)" hub 0.3`."""
    damping_factor: str = "1"
    """The legs' damping, relative to the model's: relaxing branches and stiffness damping."""
    mounting_angle_deg: str = "0"
    """How much further down all legs point than they are mounted, however they are rolled
    [degrees]."""
    ground_roughness_mm: str = "0"
    """Roughness of a surface drawn for each world [mm], with the ground's `rough.correlation_mm`; 0
    for the ground of the physics."""
    reductions: tuple[Path, ...] = ()
    """Files of other reductions of the leg: the legs of a world use one of these or the robot's
    own, with equal probability."""
    measured: tuple[tuple[str, float, float], ...] = ()
    """Results of tests on the robot: name of a world's number, value and standard deviation, such
    as `"friction sheet" 0.62 0.03`. Worlds are drawn from the distributions above combined with
    these."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_surfaces(self.friction_by_surface)
        named = [(name, text, FRICTION_BOUNDS) for name, text in self.friction_by_surface]
        for name, text in self._numbers().items():
            named.append((name, text, _BOUNDS.get(name, Bounds(least=0.0))))
        laws = self.distributions
        for name, count in Counter(name for name, _, _ in self.measured).items():
            if count > 1:
                raise ValueError(
                    f"measured names {name!r} {count} times, expected each number once: combine "
                    "what was found, by calibrate --bench with all readings in one file, say"
                )
        for name, value, deviation in self.measured:
            if name not in laws:
                raise ValueError(f"measured names {name!r}, expected one of {', '.join(laws)}")
            laws[name].check_measured(name, value, deviation)
        for name, text, bounds in named:
            distribution = Distribution.parse(text, name)
            for drawn in (distribution.lowest, distribution.highest):
                if drawn not in bounds:
                    raise ValueError(
                        f"{name} is {text!r}, which may give {drawn:g}; "
                        f"expected every draw to be {bounds}{bounds.why and f'; {bounds.why}'}"
                    )

    @property
    def distributions(self) -> dict[str, Distribution]:
        """What each number of a world is drawn from, by the names of `World.numbers`."""
        texts = self._numbers()
        texts |= {f"friction {name}": text for name, text in self.friction_by_surface}
        return {name: Distribution.parse(text, name) for name, text in texts.items()}

    def numbers_of(self, worlds: Sequence[World]) -> dict[str, np.ndarray]:
        """Numbers of worlds drawn from this, by name, each (world,); where there are several
        reductions, ``reduction`` counts them, 0 being the robot's own.

        A roughness is told of all worlds if one has a ground of its own; it is 0 of the others.
        """
        numbers = [world.numbers for world in worlds]
        # A world that drew a roughness of 0 leaves it out.
        filled = [{"ground_roughness_mm": 0.0, **each} for each in numbers]
        found = {name: np.array([each[name] for each in filled]) for name in max(numbers, key=len)}
        if self.reductions:
            files = ["", *map(str, self.reductions)]
            found["reduction"] = np.array([float(files.index(each.reduction)) for each in worlds])
        return found

    def described(self) -> dict[str, Any]:
        """Distributions by name, which tell kept things apart; those that earlier versions did not
        have are named where they are not as usual, so that what was kept then is found."""
        return settings_known_before(self, _LATER_CHOICES)

    def draw(self, rng: np.random.Generator) -> World:
        """Draw a world.

        What could not be drawn at first has generators of its own, so that what else a seed draws
        is what it was then.
        """
        air, surfaces = rng.spawn(2)
        legs = air.spawn(1)[0]
        ground = legs.spawn(1)[0]
        own = {name: (air, surfaces, legs, ground)[place] for name, place in _OWN_GENERATOR.items()}
        known = {name: (value, deviation) for name, value, deviation in self.measured}

        def drawn(name: str, text: str, generator: np.random.Generator) -> float:
            law = Distribution.parse(text, name)
            value = law.draw(generator)
            return law.drawn_given(value, *known[name]) if name in known else value

        numbers = {
            name: drawn(name, text, own.get(name, rng)) for name, text in self._numbers().items()
        }
        reductions = ("", *map(str, self.reductions))
        by_surface = tuple(
            (name, drawn(f"friction {name}", text, surfaces))
            for name, text in self.friction_by_surface
        )
        return World(
            **numbers,
            friction_by_surface=by_surface,
            reduction=reductions[int(legs.integers(len(reductions)))],
            ground_seed=int(ground.integers(2**31)) if numbers["ground_roughness_mm"] > 0.0 else 0,
        )

    def _numbers(self) -> dict[str, str]:
        """Distributions of all numbers but surfaces', by name."""
        others = ("friction_by_surface", "reductions", "measured")
        names = (item.name for item in fields(self) if item.name not in others)
        return {name: getattr(self, name) for name in names}
