"""Bend of a leg that is held at its attachment and inflated, without gravity or floor."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import StaticResult, rising_equilibria
from pneumorph.geometry.face_tie import FaceTie
from pneumorph.geometry.mesh import Mesh
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.modal_equilibrium import ModalEquilibrium, rising_modal_equilibria
from pneumorph.reduction.reduced_part import ReducedPart


def held_bends(
    leg: ReducedPart | PartModel,
    mesh: Mesh,
    pressures_kPa: Iterable[float],
    rotation: Rotation = "edge",
) -> Iterator[tuple[float, ModalEquilibrium | StaticResult]]:
    """Bends at rising pressures [degrees], and the equilibria they are of; look at `converged`.

    Args:
        leg: The reduced leg, or its finite elements, whose last equilibrium may be missing.
        mesh: The leg's mesh.
        pressures_kPa: Simulated pressures [kPa].
        rotation: Where elements take their rotation from.
    """
    if isinstance(leg, ReducedPart):
        for small in rising_modal_equilibria(leg, pressures_kPa, rotation):
            yield end_face_bend_deg(mesh, leg.positions(small.alpha)), small
    else:
        held = FaceTie.of(mesh).nodes
        for exact in rising_equilibria(leg, pressures_kPa, held, rotation=rotation):
            yield end_face_bend_deg(mesh, exact.positions), exact
