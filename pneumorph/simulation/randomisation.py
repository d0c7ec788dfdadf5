"""Domain randomisation: worlds that differ from the simulated one as reality may."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace

import numpy as np

from pneumorph.base.checked import Bounds
from pneumorph.physics.physics import Physics
from pneumorph.simulation.distribution import Distribution

_BOUNDS = {
    "modulus_factor": Bounds(above=0.0),
    "mass_factor": Bounds(above=0.0),
    "floor_slope_deg": Bounds(above=-90.0, below=90.0),
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
    """How steeply the floor rises forward [degrees]."""

    def applied_to(self, physics: Physics) -> Physics:
        """Physics of this world; modulus and mass are the robots', the lag the command's."""
        return replace(physics, friction=self.friction, floor_slope_deg=self.floor_slope_deg)

    def as_dict(self) -> dict[str, float]:
        """The numbers by name."""
        return asdict(self)


@dataclass(frozen=True)
class Randomisation:
    """Distributions of what is uncertain: uniform U(0.9, 1.5), normal N(0, 0.5), or a number."""

    friction: str = "U(0.9, 1.5)"
    """Coulomb friction coefficient."""
    modulus_factor: str = "U(0.8, 1.25)"
    """Young's moduli of the legs over the model's."""
    mass_factor: str = "U(0.9, 1.1)"
    """Masses of legs and hub over the model's."""
    regulator_lag_s: str = "U(0, 0.2)"
    """Time constant of the regulators, first order [s]."""
    floor_slope_deg: str = "N(0, 0.5)"
    """How steeply the floor rises forward [degrees]."""

    def __post_init__(self) -> None:
        for item in fields(self):
            distribution = Distribution.parse(getattr(self, item.name))
            bounds = _BOUNDS.get(item.name, Bounds(least=0.0))
            for drawn in (distribution.lowest, distribution.highest):
                if drawn not in bounds:
                    raise ValueError(
                        f"{item.name} is {getattr(self, item.name)!r}, which may give {drawn:g}; "
                        f"expected every draw to be {bounds}"
                    )

    def draw(self, rng: np.random.Generator) -> World:
        """Draw a world."""
        return World(
            **{
                item.name: Distribution.parse(getattr(self, item.name)).draw(rng)
                for item in fields(self)
            }
        )
