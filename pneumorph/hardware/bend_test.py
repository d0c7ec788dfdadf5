"""Simulated pressures at which the model bends as a real leg did (paper, appendix B).

A leg is held at its root in free air, inflated, and the turn of its free end is measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from pneumorph.base.checked import rises
from pneumorph.base.progress import ProgressReport
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh
from pneumorph.hardware.measured_table import read_measured_table
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.held_bend import held_bends
from pneumorph.reduction.reduced_part import ReducedPart

MOST_KPA = 3000.0
"""Nobody inflates a soft leg with more: the published one is simulated with 345."""

CLEAR_BEND = 0.1
"""A bend of this share of the largest is that of an inflated leg, and no noise of a reading."""


@dataclass(frozen=True, eq=False)
class MonotoneBend:
    """Bend of a simulated leg against simulated pressure, rising from zero.

    Attributes:
        pressure_kPa: Simulated pressures [kPa], (pressure,), the first is 0.
        bend_deg: Bend at each [degrees], (pressure,).

    Raises:
        ValueError: The bend does not rise with the pressure.
    """

    pressure_kPa: np.ndarray
    bend_deg: np.ndarray

    def __post_init__(self) -> None:
        if not rises(self.bend_deg) or not rises(self.pressure_kPa):
            raise ValueError(
                "the simulated bend does not rise with the pressure, so that no pressure of equal "
                "bend is defined; the leg may be damaged or the pressures too high"
            )

    def bend(self, pressure_kPa: np.ndarray | float) -> np.ndarray:
        """Bend at simulated pressures [degrees], by a monotone cubic; NaN beyond the curve."""
        curve = PchipInterpolator(self.pressure_kPa, self.bend_deg, extrapolate=False)
        value: np.ndarray = curve(pressure_kPa)
        return value

    def pressure(self, bend_deg: np.ndarray | float) -> np.ndarray:
        """Simulated pressures of equal bend [kPa], any shape.

        Raises:
            ValueError: A bend is beyond the curve.
        """
        wanted = np.asarray(bend_deg, dtype=float)
        lowest, highest = self.bend_deg[[0, -1]]
        if not np.all((wanted >= lowest) & (wanted <= highest)):
            # NaN is beyond any curve, and the largest of what holds one.
            worst = float(wanted.min() if wanted.max() <= highest else wanted.max())
            raise ValueError(
                f"bend_deg {worst:g} is beyond the simulated leg's {lowest:g} to {highest:g} "
                f"degrees (0 to {self.pressure_kPa[-1]:g} simulated kPa); raise the largest "
                "simulated pressure, or the bends are not in degrees"
            )
        low, high = np.zeros_like(wanted), np.full_like(wanted, self.pressure_kPa[-1])
        # Bisection: 60 halvings of 1000 kPa are below rounding.
        for _ in range(60):
            middle = 0.5 * (low + high)
            below = self.bend(middle) < wanted
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return 0.5 * (low + high)


def simulated_bend_curve(
    leg: ReducedPart | PartModel,
    mesh: Mesh,
    largest_kPa: float = 450.0,
    step_kPa: float = 10.0,
    rotation: Rotation = "edge",
    progress: ProgressReport | None = None,
) -> MonotoneBend:
    """Bend a simulated leg held at its attachment, without gravity or floor.

    Args:
        leg: The reduced leg, or its finite elements.
        mesh: The leg's mesh.
        largest_kPa: Last simulated pressure [kPa]; the curve ends earlier where the leg finds no
            equilibrium or bends no further.
        step_kPa: Step between pressures [kPa].
        rotation: Where elements take their rotation from.
        progress: Told how many pressures are done.

    Raises:
        ValueError: Hardly any equilibrium was found.
    """
    pressures = np.arange(step_kPa, largest_kPa + 0.5 * step_kPa, step_kPa)
    bends = [0.0]
    for bend, found in held_bends(leg, mesh, pressures, rotation):
        if not found.converged or bend <= bends[-1]:
            break  # A leg too soft for this pressure; the curve ends at the one before.
        bends.append(bend)
        if progress is not None:
            progress(len(bends) - 1, len(pressures), "bending the simulated leg")
    if len(bends) < 3:
        raise ValueError(
            f"the leg found equilibria at {len(bends) - 1} of the pressures from {step_kPa:g} kPa, "
            "expected at least 2; the reduction or the material is at fault"
        )
    return MonotoneBend(np.concatenate([[0.0], pressures])[: len(bends)], np.array(bends))


@dataclass(frozen=True, eq=False)
class PressurePairs:
    """Real pressures and the simulated ones of equal bend [kPa], each (pair,)."""

    real_kPa: np.ndarray
    simulated_kPa: np.ndarray


def read_pairs(path: Path | str) -> PressurePairs:
    """Read pairs that were found before: ``real_pressure_kPa,simulated_pressure_kPa``.

    Raises:
        ValueError: The table is damaged, or its pressures are those of no soft leg.
    """
    table = read_measured_table(path, {"real_pressure": "kPa", "simulated_pressure": "kPa"})
    highest = max(table["real_pressure"].max(), table["simulated_pressure"].max())
    if highest > MOST_KPA:
        raise ValueError(
            f"{path}: a pressure is {highest:g} kPa, expected at most {MOST_KPA:g}: it may be in "
            "Pa, which columns real_pressure_Pa and simulated_pressure_Pa would say"
        )
    return PressurePairs(table["real_pressure"], table["simulated_pressure"])


def read_bends(path: Path | str) -> tuple[np.ndarray, np.ndarray]:
    """Read measured bends: columns ``pressure`` and ``bend`` with units; repeats are welcome.

    Returns:
        Real pressures [kPa], (measurement,), and bends [degrees], (measurement,).
    """
    table = read_measured_table(path, {"pressure": "kPa", "bend": "deg"})
    return table["pressure"], table["bend"]


def equal_bend_pairs(
    pressure_kPa: np.ndarray, bend_deg: np.ndarray, curve: MonotoneBend
) -> PressurePairs:
    """Find the simulated pressure of equal bend for each measurement.

    Where a bend is not above zero the simulated pressure is zero or cut off (`PressureMap`), and
    what is measured there and below, and without pressure, is noise, of which the positive half
    would tilt the line: these pressures take no part in it.

    Raises:
        ValueError: A bend beyond the curve, one that is not positive where the leg bends clearly,
            or fewer than three bends at pressures that bend the leg.
    """
    _refuse_slips(pressure_kPa, bend_deg)
    straight = pressure_kPa[~(bend_deg > 0.0)]
    bent = pressure_kPa > straight.max(initial=0.0)
    if bent.sum() < 3:
        above = int((bend_deg > 0.0).sum())
        raise ValueError(
            f"{above} measured bends are above zero, {int(bent.sum())} of them at pressures above "
            "that of the last one that is not, expected at least 3; bends are counted positive "
            "towards the paper side"
        )
    return PressurePairs(pressure_kPa[bent], curve.pressure(bend_deg[bent]))


def _refuse_slips(pressure_kPa: np.ndarray, bend_deg: np.ndarray) -> None:
    """Refuse a bend that is not positive at a pressure at which, or below which, the leg bends
    clearly: all that was measured up to there would be taken for noise.

    Raises:
        ValueError: There is one; names its row and one that it contradicts.
    """
    clear = bend_deg > CLEAR_BEND * np.abs(bend_deg).max(initial=0.0)
    for row in np.flatnonzero(~(bend_deg > 0.0)):
        others = np.flatnonzero(clear & (pressure_kPa <= pressure_kPa[row]))
        if not len(others):
            continue
        other = others[np.argmax(bend_deg[others])]
        raise ValueError(
            f"row {row + 1}: the bend at {pressure_kPa[row]:g} kPa is {bend_deg[row]:g} degrees, "
            f"expected a positive one: row {other + 1} has {bend_deg[other]:g} degrees at "
            f"{pressure_kPa[other]:g} kPa; likely cause: a slip of the sign, or a reading that was "
            "not taken"
        )
