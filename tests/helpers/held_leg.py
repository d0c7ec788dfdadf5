"""The leg that ships, held at its attachment as on a rigid hub."""

from __future__ import annotations

from pneumorph.catalogue.leg_kinds import load_default_leg
from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.assemble import Cubature, assemble_reduced_part
from pneumorph.reduction.pod import mass_orthonormalise
from pneumorph.reduction.reduced_part import ReducedPart


def held_leg(model: PartModel) -> ReducedPart:
    """Same sampled elements, modes that vanish at the attachment, no mount."""
    shipped = load_default_leg("published")
    modes = shipped.modes.copy()
    modes[model.mesh.node_set("attachment")] = 0.0
    flat = mass_orthonormalise(modes.reshape(-1, shipped.mode_count), model.node_mass)
    cubatures = (
        Cubature(shipped.tetrahedron_index, shipped.tetrahedron_weight),
        Cubature(shipped.membrane_index, shipped.membrane_weight),
    )
    return assemble_reduced_part(model, flat.reshape(modes.shape), cubatures)
