"""Bend of a single held leg against pressure: reduced beside full."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.held_bend import held_bends
from pneumorph.reduction.reduced_part import ReducedPart


@dataclass(frozen=True, eq=False)
class BendComparison:
    """Bends of both models at each pressure.

    Attributes:
        pressure_kPa: Simulated pressures [kPa], (pressure,).
        full_deg: Bend of the finite elements [degrees], (pressure,).
        reduced_deg: Bend of the reduced leg [degrees], (pressure,).
    """

    pressure_kPa: np.ndarray
    full_deg: np.ndarray
    reduced_deg: np.ndarray

    @property
    def error_percent(self) -> float:
        """Largest error over the pressures, in percent of the full model's bend there."""
        return float(100.0 * np.max(np.abs(self.reduced_deg / self.full_deg - 1.0)))


def bend_of_report(
    reduced: ReducedPart, mesh: Mesh, limit_kPa: float, rotation: Rotation = "edge"
) -> BendComparison:
    """Bend a reduced leg again through the full model's equilibria that its report holds.

    Args:
        reduced: The reduced leg, with the report of its reduction.
        mesh: Its mesh.
        limit_kPa: Largest simulated pressure [kPa].
        rotation: Where elements take their rotation from.

    Raises:
        ValueError: No report, no pressure below the limit, or a search that did not converge.
        ArtefactError: A reduction of another mesh.
    """
    reduced.check_mesh(mesh)
    table = reduced.metadata.get("report", {}).get("bend", {})
    pressures = np.array(table.get("pressure_kPa", []))
    chosen = pressures <= limit_kPa
    if not chosen.any():
        raise ValueError(
            f"the reduction's report holds bends at {pressures.tolist()} kPa, expected some up to "
            f"{limit_kPa:g} kPa; give the pressures, and both models are bent anew"
        )
    bends = list(_bends("reduced", reduced, mesh, pressures[chosen], rotation))
    return BendComparison(pressures[chosen], np.array(table["full_deg"])[chosen], np.array(bends))


def compare_bend(
    full: PartModel,
    reduced: ReducedPart,
    pressures_kPa: Sequence[float],
    rotation: Rotation = "edge",
    progress: Callable[[int, int, str], None] | None = None,
) -> BendComparison:
    """Bend a leg held at its attachment, without gravity or floor, by both models.

    Args:
        full: The leg's finite elements.
        reduced: Its reduction.
        pressures_kPa: Simulated pressures, rising from above 0 [kPa].
        rotation: Where elements take their rotation from.
        progress: Told how many pressures are done.

    Raises:
        ValueError: Pressures that do not rise from above 0, a search that did not converge, or a
            reduction of another mesh.
    """
    pressures = np.asarray(pressures_kPa, dtype=float)
    if len(pressures) == 0 or pressures[0] <= 0 or np.any(np.diff(pressures) <= 0):
        raise ValueError(f"pressures_kPa is {list(pressures_kPa)}, expected rising from above 0")
    reduced.check_mesh(full.mesh)
    exact = _bends("full", full, full.mesh, pressures, rotation)
    small = _bends("reduced", reduced, full.mesh, pressures, rotation)
    bends = []
    for both in zip(exact, small, strict=True):
        bends.append(both)
        if progress is not None:
            progress(len(bends), len(pressures), "bending one leg")
    full_deg, reduced_deg = np.array(bends).T
    return BendComparison(pressures, full_deg, reduced_deg)


def _bends(
    name: str,
    leg: ReducedPart | PartModel,
    mesh: Mesh,
    pressures_kPa: np.ndarray,
    rotation: Rotation,
) -> Iterator[float]:
    """Bend at each pressure [degrees].

    Raises:
        ValueError: There is no equilibrium.
    """
    found = held_bends(leg, mesh, pressures_kPa, rotation)
    for pressure, (bend, result) in zip(pressures_kPa, found, strict=True):
        if not result.converged:
            raise ValueError(
                f"the {name} leg found no equilibrium at {pressure:g} kPa (relative residual "
                f"{result.relative_residual:.1e}); add pressures in between"
            )
        yield bend
