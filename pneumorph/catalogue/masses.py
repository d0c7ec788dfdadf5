"""What the paper's robot weighs: as the published simulation has it, or as it is built.

The leg is what its mould holds and a sheet, the hub what is printed
(`pneumorph.fabrication.hub`); a part that was weighed weighs that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from pneumorph.base.checked import Checked, NotNegative, Positive
from pneumorph.geometry.mass_properties import KG_PER_MM3, MassProperties
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.surface import surface_area

MassModel = Literal["published", "cast"]

PRINT_DENSITY_G_PER_ML = 1.24
"""Density of printed PLA [g/ml]."""

PRINTED_HUB = MassProperties(
    0.0300858,
    np.array([0.0, 0.0, 38.63916]),
    np.diag([30.92346, 30.92346, 59.87020]),
)
"""The hub that `pneumorph.fabrication.hub.make_hub` makes by default, of PLA, in the robot's frame;
tests/fabrication/test_hub.py holds the two together."""


@dataclass(frozen=True)
class CastDensities(Checked):
    """What the leg is cast of."""

    silicone_g_per_ml: Positive = 1.08
    """Density of the silicone [g/ml]; Dragon Skin 30's by its data sheet."""
    sheet_g_per_m2: NotNegative = 80.0
    """Mass per area of the sheet under the leg [g/m^2]; that of office paper, an assumption."""


@dataclass(frozen=True)
class Masses(Checked):
    """What the robot's parts weigh."""

    model: MassModel = "published"
    """`published`: a hub of 75 g, 2.5 times the real mass, and legs with the mass of their
    materials or reduction (105 g for the published leg, 2.5 times the real mass). `cast`: a leg
    weighs the silicone that its mould holds plus its sheet; the hub is the printed one."""
    leg_mass_g: Positive | None = None
    """Weighed mass of a leg [g], instead of the model's."""
    hub_mass_g: Positive | None = None
    """Weighed mass of the hub [g], instead of the model's; its inertia is scaled to match."""
    densities: CastDensities = CastDensities()
    """Densities of cast legs."""

    def __post_init__(self) -> None:
        super().__post_init__()
        weighed = self.model == "published" or self.leg_mass_g is not None
        if weighed and self.densities != CastDensities():
            raise ValueError(
                f"densities are {self.densities}, expected those by default: nothing looks at them "
                'where model is not "cast" or leg_mass_g is given'
            )


def cast_leg_mass_kg(mesh: Mesh, densities: CastDensities | None = None) -> float:
    """Mass of a leg from its shape [kg].

    Args:
        mesh: The leg; its surface ``sheet`` carries the sheet.
        densities: What it is cast of.

    Raises:
        MeshError: The mesh has no surface ``sheet``.
    """
    densities = densities or CastDensities()
    silicone = KG_PER_MM3 * densities.silicone_g_per_ml * float(mesh.volumes.sum())
    # 1 g/m^2 is 1e-9 kg/mm^2.
    sheet = 1e-9 * densities.sheet_g_per_m2 * surface_area(mesh.nodes, mesh.surface("sheet"))
    return silicone + sheet
