"""The leg of the paper as finite elements."""

from __future__ import annotations

from pneumorph.fem.material import LegMaterials, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.region_names import cavity_regions


def leg_model(mesh: Mesh, materials: LegMaterials | None = None) -> PartModel:
    """The leg of the paper, or one like it: silicone with a sheet and cavities, all surface regions
    whose names begin with ``cavity``."""
    materials = materials or LegMaterials()
    sheet = Membrane("sheet", materials.sheet, materials.sheet_thickness_mm)
    return PartModel(
        mesh,
        materials.silicone,
        materials.mass_kg,
        (sheet,),
        cavity_regions(mesh) or "cavity",
        materials.mass_lumping,
        materials.relaxation,
    )
