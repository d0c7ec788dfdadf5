"""Air: how fast a regulator fills and vents its tube and the chambers behind it.

A regulator opens to the supply while the pressure is below its command, opens to the outside while
it is above, and holds it there. Air flows through the valve as ISO 6358 has it, choked or not; it
is an ideal gas that keeps the room's temperature, so that its content P V, absolute pressure times
volume, changes by what flows. How a pressure moves by it: `pneumorph.physics.regulators`. Numbers
in brackets are equations of docs/physics.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np

from pneumorph.base.checked import Bounds, Checked

AirLaw = Literal["rate_limit", "orifice"]
Conductance = Annotated[
    float, Bounds(least=1e-3, most=1e9, why="10 000 mm^3/(s kPa) are 1 dm^3/(s bar)")
]
"""Of a valve [mm^3/(s kPa)]; from a pinhole's to a water main's."""

ATMOSPHERE_KPA = 101.325
"""Absolute pressure of the outside [kPa]."""

REFERENCE_KPA = 100.0
"""Absolute pressure of the reference atmosphere that conductances are stated in [kPa] (ISO 8778);
its temperature is taken for the room's."""


@dataclass(frozen=True)
class Air(Checked):
    """Where regulators get their air from, and what holds it up.

    Conductances are sonic ones of ISO 6358, of one regulator after the other; a single one is that
    of all. 10 000 mm^3/(s kPa) are 1 dm^3/(s bar), a hole of 2.5 mm without losses.

    Raises:
        ValueError: A number is out of range, or there is no such law.
    """

    law: AirLaw = "rate_limit"
    """`rate_limit`: pressures move at `pressure_rate_kPa_per_s`, as published, and the other
    settings of air have no effect. `orifice`: air flows through a valve into tube and chambers."""
    supply_kPa: Annotated[
        float, Bounds(least=1.0, most=1e4, why="pressure above the outside's, in kPa, not in Pa")
    ] = 200.0
    """Gauge pressure of the regulators' supply [kPa]."""
    filling_mm3_per_s_kPa: tuple[Conductance, ...] = (78.0,)
    """Sonic conductance (ISO 6358) from the supply into each regulator's tubes, or one for all
    [mm^3/(s kPa)]."""
    venting_mm3_per_s_kPa: tuple[Conductance, ...] = (1100.0,)
    """Sonic conductance from each regulator's tubes to the outside, or one for all [mm^3/(s
    kPa)]."""
    critical_ratio: Annotated[float, Bounds(least=0.0, most=0.99)] = 0.5
    """Ratio of absolute pressures after and before a valve below which the flow is choked."""
    tube_mm3: Annotated[float, Bounds(least=1e-3, most=1e9)] = 1000.0
    """Volume of each regulator's tubes [mm^3]."""
    chamber_growth: tuple[Annotated[float, Bounds(0.0, 100.0)], ...] = (0.009, 0.00019)
    """Growth g1, g2 ... of a chamber's volume with real pressure p [kPa]: relative to rest it is 1
    + g1 p + g2 p^2 ... Of the measured physics it comes with a part of one's own."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("filling_mm3_per_s_kPa", "venting_mm3_per_s_kPa"):
            if not getattr(self, name):
                raise ValueError(f"{name} is empty, expected a conductance of each regulator")

    def check_supply(self, commands_kPa: np.ndarray | float) -> None:
        """Refuse commands that the supply cannot reach.

        Args:
            commands_kPa: Real pressures asked of regulators [kPa], any shape.

        Raises:
            ValueError: One is above the supply's pressure, and the law knows of a supply.
        """
        highest = np.max(commands_kPa, initial=0.0)
        if self.law == "orifice" and highest > self.supply_kPa:
            raise ValueError(
                f"a command asks for {highest:g} kPa from a supply of {self.supply_kPa:g} kPa "
                "(air.supply_kPa), expected no more than that: the supply's pressure may be given "
                "in bar or psi"
            )

    def of_each(self, name: str, regulator_count: int) -> tuple[float, ...]:
        """Conductances of every regulator [mm^3/(s kPa)].

        Args:
            name: ``filling_mm3_per_s_kPa`` or ``venting_mm3_per_s_kPa``.
            regulator_count: How many there are.

        Raises:
            ValueError: Another number was given.
        """
        given: tuple[float, ...] = getattr(self, name)
        if len(given) not in (1, regulator_count):
            raise ValueError(
                f"{name} has {len(given)} numbers for {regulator_count} regulators, expected one "
                "for each, or one for all"
            )
        return given if len(given) == regulator_count else given * regulator_count

    def scaled(self, filling_factor: float, venting_factor: float) -> Air:
        """The same with conductances times factors."""
        return replace(
            self,
            filling_mm3_per_s_kPa=tuple(filling_factor * c for c in self.filling_mm3_per_s_kPa),
            venting_mm3_per_s_kPa=tuple(venting_factor * c for c in self.venting_mm3_per_s_kPa),
        )

    def volume_mm3(self, pressure_kPa: np.ndarray, chamber_mm3: float) -> np.ndarray:
        """Volume of a regulator's tubes and chambers at rest under a pressure, (39).

        Args:
            pressure_kPa: Above the outside's [kPa], any shape.
            chamber_mm3: Volume of all its chambers without pressure [mm^3].
        """
        grown = np.polynomial.polynomial.polyval(pressure_kPa, (1.0, *self.chamber_growth))
        volume: np.ndarray = self.tube_mm3 + chamber_mm3 * grown
        return volume

    def content(self, pressure_kPa: np.ndarray, chamber_mm3: float) -> np.ndarray:
        """Content P V [kPa mm^3] at a pressure above the outside's [kPa]; arguments as above."""
        content: np.ndarray = (pressure_kPa + ATMOSPHERE_KPA) * self.volume_mm3(
            pressure_kPa, chamber_mm3
        )
        return content

    def capacity_mm3(self, pressure_kPa: np.ndarray, chamber_mm3: float) -> np.ndarray:
        """d(P V)/dP [mm^3]: what a rise by a pressure takes of content; arguments as above."""
        slope = np.polynomial.polynomial.polyder((1.0, *self.chamber_growth))
        growing = chamber_mm3 * np.polynomial.polynomial.polyval(pressure_kPa, slope)
        capacity: np.ndarray = (
            self.volume_mm3(pressure_kPa, chamber_mm3) + (pressure_kPa + ATMOSPHERE_KPA) * growing
        )
        return capacity


def orifice_flow(
    upstream_kPa: np.ndarray,
    downstream_kPa: np.ndarray,
    conductance_mm3_per_s_kPa: float,
    critical_ratio: float,
) -> np.ndarray:
    """Content that flows through an orifice in a second [kPa mm^3/s], (38); ISO 6358-1:2013.

    Args:
        upstream_kPa: Absolute pressure before it [kPa], any shape.
        downstream_kPa: And behind it, not higher.
        conductance_mm3_per_s_kPa: Sonic conductance [mm^3/(s kPa)].
        critical_ratio: Ratio of the pressures below which the flow is choked.
    """
    beyond = (downstream_kPa / upstream_kPa - critical_ratio) / (1.0 - critical_ratio)
    share = np.sqrt(np.maximum(1.0 - np.maximum(beyond, 0.0) ** 2, 0.0))
    flow: np.ndarray = conductance_mm3_per_s_kPa * REFERENCE_KPA * upstream_kPa * share
    return flow
