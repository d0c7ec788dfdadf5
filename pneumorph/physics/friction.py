"""How Coulomb's coefficient changes with the pressure on a contact."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pneumorph.base.checked import Bounds, Checked, Positive

FRICTION_BOUNDS = Bounds(
    least=0.0, most=10.0, why="it is a ratio of forces, of rubber up to 3: 55 percent are 0.55"
)
"""Of a coefficient."""
FrictionCoefficient = Annotated[float, FRICTION_BOUNDS]


@dataclass(frozen=True)
class FrictionPressure(Checked):
    """Coefficient mu = mu_0 (p / p_0)^e, kept between two factors.

    A friction force in proportion to the true area of contact, which between elastic spheres grows
    as load^(2/3) (Hertz), gives e = -1/3 (Schallamach 1952, rubber); a soft adhesive elastomer
    under a steel indenter follows a power law as well (Biomimetics 9, 2024, 52). More asperities
    that touch under more load bring e to 0 (Archard 1957). Where load presses a soft layer into
    roughness the coefficient rises, e > 0. The pressure is that of the last step: within a step the
    law is Coulomb's.

    Raises:
        ValueError: A number is out of range.
    """

    exponent: Annotated[
        float, Bounds(above=-1.0, most=1.0, why="at -1 and below, a heavier load grips no better")
    ] = 0.0
    """Exponent e of that pressure. 0: the coefficient is always the same (Coulomb's law). -1/3: it
    falls with pressure as between elastic spheres (Hertz). Positive: it rises."""
    pressure_kPa: Positive = 10.0
    """Pressure p_0 at which the coefficient is the given one [kPa]."""
    least_factor: Annotated[float, Bounds(above=0.0, most=1.0)] = 0.5
    """Lower limit of the coefficient, relative to the given one."""
    most_factor: Annotated[float, Bounds(least=1.0)] = 2.0
    """Upper limit of the coefficient, relative to the given one."""

    def factor(self, pressure_kPa: np.ndarray) -> np.ndarray:
        """Coefficient over the given one at pressures [kPa], same shape."""
        with np.errstate(divide="ignore"):
            factor = (np.asarray(pressure_kPa) / self.pressure_kPa) ** self.exponent
        return np.clip(factor, self.least_factor, self.most_factor)


def check_surfaces(friction_by_surface: Sequence[tuple[str, object]]) -> None:
    """Refuse a surface that has no name, or more than one coefficient.

    Args:
        friction_by_surface: Name of each surface and its coefficient, or its distribution.

    Raises:
        ValueError: There is one.
    """
    for name, count in Counter(name for name, _ in friction_by_surface).items():
        if count > 1 or not name:
            said = "has no name" if not name else f"names {name!r} {count} times"
            raise ValueError(f"friction_by_surface {said}, expected each surface's name once")
