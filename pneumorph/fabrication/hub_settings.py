"""What a hub is printed of, and the sizes of its walls, sockets and holes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pneumorph.base.checked import Bounds, Checked, NotNegative, Positive
from pneumorph.catalogue.masses import PRINT_DENSITY_G_PER_ML


@dataclass(frozen=True)
class HubSettings(Checked):
    """What the hub is printed of, and its sizes [mm]."""

    material: str = "PLA"
    """Name of the material."""
    density_g_per_ml: Positive = PRINT_DENSITY_G_PER_ML
    """Its density [g/ml]; printed walls are solid."""
    wall_mm: Positive = 0.9
    """Thickness of the plate on top, the flank and the sockets."""
    rib_mm: Positive = 0.9
    """Thickness of ribs and ring."""
    ribs_per_site: Annotated[int, Bounds(least=0, most=8)] = 2
    """Ribs behind every socket, an even number: the tube lies between them."""
    rib_spread_mm: Positive = 16.0
    """Distance between the outermost ribs of a socket."""
    socket_depth_mm: Positive = 5.0
    """How far a socket's walls reach over the leg's end tooth."""
    clearance_mm: NotNegative = 0.25
    """Gap around the leg, for glue."""
    channel_radius_mm: Positive = 1.6
    """Radius of the holes for the tubes."""
    channel_height_mm: Positive = 8.0
    """Height of a tube above the leg's bottom, within the first chamber's."""
    well_radius_mm: Positive = 25.0
    """Radius of the well in the middle, where the tubes come out."""
    smallest_wall_mm: Positive = 0.6
    """Thinnest wall that can be printed: a nozzle of 0.4 mm lays up to 0.6 mm in one line."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.ribs_per_site % 2:
            raise ValueError(
                f"ribs_per_site must be even, got {self.ribs_per_site}; a rib in the middle would "
                "lie in the tube's way"
            )
        for name in ("wall_mm", "rib_mm"):
            if getattr(self, name) < self.smallest_wall_mm:
                raise ValueError(
                    f"{name} must be at least smallest_wall_mm, {self.smallest_wall_mm:g}, got "
                    f"{getattr(self, name):g}; it cannot be printed"
                )

    def rib_places_mm(self) -> np.ndarray:
        """Where the ribs of a socket stand across the leg's axis [mm], (rib,)."""
        return np.linspace(-0.5, 0.5, self.ribs_per_site) * self.rib_spread_mm
