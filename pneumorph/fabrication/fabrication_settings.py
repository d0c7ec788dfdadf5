"""Shapes of the parts that a workshop makes, and how they are made."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from pneumorph.base.checked import Checked, Positive
from pneumorph.fabrication.hub_settings import HubSettings
from pneumorph.fabrication.hub_stiffness import HubCheckSettings
from pneumorph.fabrication.leg_mould import MouldSettings
from pneumorph.fabrication.workshop_settings import WorkshopSettings
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pneunet import PneuNetShape


@dataclass(frozen=True)
class FabricationSettings(Checked):
    """Shapes of the parts, and how they are made. Leg, disk and mounting are the paper's robot's;
    a robot's file has its own."""

    mesh: Path | None = None
    """Mesh of the simulated leg, whose volume the casting is compared with; by default the one that
    ships."""
    surface_size_mm: Positive = 8.0
    """Largest edge of the triangles in the STL files [mm]."""
    leg: PneuNetShape = field(default_factory=PneuNetShape)
    disk: DiskShape = field(default_factory=DiskShape)
    mounting: RadialMounting = field(default_factory=RadialMounting)
    mould: MouldSettings = field(default_factory=MouldSettings)
    hub: HubSettings = field(default_factory=HubSettings)
    workshop: WorkshopSettings = field(default_factory=WorkshopSettings)
    check_hub: bool = False
    """Compute the deflection of the paper's hub with finite elements, about a minute."""
    hub_check: HubCheckSettings = field(default_factory=HubCheckSettings)

    def idle_settings(self) -> dict[str, str]:
        """As `pneumorph.base.idle_settings` has them: of a check that is not made."""
        return {} if self.check_hub else {"hub_check": "without --check-hub"}
