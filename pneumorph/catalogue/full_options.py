"""Options of finite-element robots, and those that a leg brings with it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from pneumorph.base.checked import Checked, Count, CountOrNone, NotNegative
from pneumorph.catalogue.hub_spec import HubModel
from pneumorph.catalogue.leg_kinds import LegKind
from pneumorph.fem.full_order_settings import (
    FrictionSolver,
    FullOrderSettings,
    Integrator,
    NewtonMatrix,
)


@dataclass(frozen=True)
class FullOptions(Checked):
    """Settings of finite-element robots; reduced robots have none of these."""

    hub: HubModel = "soft"
    """Hub of finite elements (soft), or a rigid one."""
    integrator: Integrator = "linearly_implicit"
    """`linearly_implicit`: one linear solve per step, as published. `implicit_euler`: implicit
    Euler, converged by Newton's method."""
    newton_matrix: NewtonMatrix = "fresh"
    """`fresh`: Newton's method with a new tangent in every iteration. `kept`: with an earlier one
    for as long as it serves, which is much faster; for legs whose law the engine has."""
    displacement_tolerance_mm: NotNegative = 0.0
    """Newton's method with kept tangents also stops when the nodes are this close to their end
    positions [mm]; 0 to stop only on the balance of forces."""
    thread_count: CountOrNone = 0
    """Threads over which Newton's method with kept tangents distributes the legs; 0 takes every
    processor if one robot walks alone, and one each if several do."""
    friction_solver: FrictionSolver = "newton"
    """`newton`: Newton's method to the tolerance. `gauss_seidel`: only Gauss-Seidel sweeps, as in
    the published experiment."""
    contact_sweeps: Count = 2000
    """Maximum number of Gauss-Seidel sweeps in a contact solve; the published experiment made
    250."""
    mesh: Path | None = None
    """Mesh of the legs, as `pneumorph mesh` writes it; by default the one that ships."""

    def numerics(self) -> FullOrderSettings:
        """The options that are numerics: those that `FullOrderSettings` has by the same name."""
        known = {each.name for each in fields(FullOrderSettings)}
        names = [each.name for each in fields(self) if each.name in known]
        return FullOrderSettings(**{name: getattr(self, name) for name in names})


def full_of(kind: LegKind) -> dict[str, Any]:
    """Options of finite elements that a leg brings with it."""
    return {
        "hub": kind.hub_model,
        "integrator": kind.full_order.integrator,
        "newton_matrix": kind.full_order.newton_matrix,
        "displacement_tolerance_mm": kind.full_order.displacement_tolerance_mm,
    }
