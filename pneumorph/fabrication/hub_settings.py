"""What a hub is printed of, and the sizes of its walls, sockets and holes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pneumorph.base.checked import Bounds, Checked, NotNegative, Positive
from pneumorph.catalogue.masses import PRINT_DENSITY_G_PER_ML


@dataclass(frozen=True)
class HubSettings(Checked):
    """The printed hub: a hollow shell with ribs and a socket for each leg."""

    material: str = "PLA"
    """Name of the printed material, for the parts list."""
    density_g_per_ml: Positive = PRINT_DENSITY_G_PER_ML
    """Density of the printed material [g/ml]; walls are printed solid."""
    wall_mm: Positive = 0.9
    """Thickness of top plate, flank and socket walls [mm]. Thicker ones are stiffer and heavier."""
    rib_mm: Positive = 0.9
    """Thickness of the ribs and of the ring around the central well [mm]."""
    ribs_per_site: Annotated[int, Bounds(least=0, most=8)] = 2
    """Number of ribs behind each socket. It is even, because the tube runs in the middle."""
    rib_spread_mm: Positive = 16.0
    """Distance between the outermost ribs of a socket [mm]."""
    socket_depth_mm: Positive = 5.0
    """How far the walls of a socket overlap the leg's end tooth [mm]."""
    clearance_mm: NotNegative = 0.25
    """Gap between leg and socket, for glue [mm]."""
    channel_radius_mm: Positive = 1.6
    """Radius of the holes for the tubes [mm]."""
    channel_height_mm: Positive | None = None
    """Height of those holes above the leg's underside [mm], within the first chamber; by default
    twice the thickness of its base plate, 8 mm of the paper's leg."""
    well_radius_mm: Positive = 25.0
    """Radius of the central well, where the tubes come out [mm]."""
    smallest_wall_mm: Positive = 0.6
    """Thinnest wall that your printer can make [mm]; thinner walls are refused. A 0.4 mm nozzle
    prints up to 0.6 mm in one line."""

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
