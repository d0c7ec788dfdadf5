"""Surfaces that some designs of a robot have and others have not: of legs that are not mounted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.module import Module
from pneumorph.fem.part_model import PartModel
from pneumorph.physics.physics import Physics
from pneumorph.physics.surfaces import SURFACE_NAMES


def surfaces_of(modules: Sequence[Module]) -> frozenset[str]:
    """Names of the surfaces of all reduced modules; nothing of one, which every design has."""
    if len(modules) == 1:
        return frozenset()
    surfaces = (module.reduced.contact_surfaces for module in modules)
    return frozenset(name for each in surfaces for name in each.known_names())


def without_idle_surfaces(
    physics: Physics,
    hub: HubSpec,
    mounted: Sequence[tuple[PartModel, Any, Any]],
    modules: Sequence[Module],
) -> Physics:
    """The physics without friction of surfaces of modules that are not mounted.

    Args:
        physics: The robot's.
        hub: What carries the modules.
        mounted: Finite elements of each leg of a design, with what else goes with them.
        modules: All modules of the robot.
    """
    own = {name for part, *_ in mounted for name in _names_of(part)}
    strange = {name for name, _ in physics.friction_by_surface} - own
    strange -= {*SURFACE_NAMES, hub.surface}
    if not strange:
        return physics
    idle = strange & {name for module in modules for name in _names_of(module.full)}
    named = tuple(each for each in physics.friction_by_surface if each[0] not in idle)
    return replace(physics, friction_by_surface=named)


def _names_of(part: PartModel) -> list[str]:
    return part.mesh.contact_surfaces.known_names()
