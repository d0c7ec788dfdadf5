"""Materials and supplies of a workshop."""

from __future__ import annotations

from dataclasses import dataclass

from pneumorph.base.checked import Checked, NotNegative, Positive
from pneumorph.catalogue.masses import PRINT_DENSITY_G_PER_ML, CastDensities
from pneumorph.fem.silicones import SILICONES


@dataclass(frozen=True)
class WorkshopSettings(Checked):
    """Materials and supplies, for the parts list."""

    silicone: str | None = None
    """Name of the silicone; by default what the simulated leg is of, Dragon Skin 30 where that is
    none of the table."""
    silicone_density_g_per_ml: Positive | None = None
    """Density of the silicone [g/ml]; by default its supplier's, that of Dragon Skin 30 where that
    is not known."""
    sheet_g_per_m2: NotNegative = CastDensities().sheet_g_per_m2
    """Mass per area of the sheet under the leg [g/m^2]."""
    silicone_waste: NotNegative = 0.2
    """Additional silicone that stays in cups, holes and syringes, relative to what is cast."""
    print_density_g_per_ml: Positive = PRINT_DENSITY_G_PER_ML
    """Density of the printed moulds [g/ml]; the default is PLA's."""
    tube: str = "silicone tube 2 x 3 mm"
    """Name of the tube."""
    supply_tube_mm: Positive = 800.0
    """Length of tube from the middle of the hub to a regulator [mm]."""
    tube_slack_mm: NotNegative = 40.0
    """Length added to each leg's tube [mm], for its end in the leg and slack at the hub."""

    def silicone_for(self, simulated: str | None) -> tuple[str, float]:
        """Name and density [g/ml] of what a leg is cast of.

        Args:
            simulated: What the simulated leg is of; None where that is not known.
        """
        name = self.silicone or simulated or "Dragon Skin 30"
        known = SILICONES.get(name)
        usual = CastDensities().silicone_g_per_ml
        density = usual if known is None else known.density_g_per_ml
        return name, self.silicone_density_g_per_ml or density
