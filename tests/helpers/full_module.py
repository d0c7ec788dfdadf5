"""A module that is known as finite elements alone."""

from __future__ import annotations

from functools import partial

from pneumorph.catalogue.module import Module
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.attachment import face_of_mesh
from pneumorph.reduction.reduced_part import ReducedPart


def full_module(name: str, part: PartModel) -> Module:
    """A module of finite elements that cannot be changed, and that nobody has reduced."""
    return Module(
        name,
        partial(_not_reduced, name),
        partial(_as_it_is, name, part),
        find_face=partial(face_of_mesh, part.mesh),
    )


def _not_reduced(name: str) -> ReducedPart:
    raise ValueError(f"{name} has not been reduced; it walks as finite elements only")


def _as_it_is(name: str, part: PartModel, modulus_factor: float, mass_factor: float) -> PartModel:
    if modulus_factor != 1.0 or mass_factor != 1.0:
        raise ValueError(
            f"{name} is asked for with modulus_factor {modulus_factor:g} and mass_factor "
            f"{mass_factor:g}, expected 1: it is known as the finite elements that it is"
        )
    return part
