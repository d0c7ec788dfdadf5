"""Refuse worlds that a robot cannot be in, before anything walks in them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pneumorph.catalogue.module import Module
from pneumorph.catalogue.part_physics import may_be_measured
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.geometry.contact_surfaces import ContactSurfaces
from pneumorph.physics.surfaces import names_of_friction
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import factors_between
from pneumorph.simulation.randomisation import Randomisation

SAME_SIZE = 0.02
"""Of its longest side, within which a leg of another mesh is the same leg."""


def check_worlds(spec: RobotSpec, drawn: Randomisation, group: str = "randomisation") -> None:
    """Refuse friction of surfaces that the robot has not, and other reductions that cannot stand
    for its modules.

    Args:
        spec: The robot.
        drawn: What worlds are drawn from.
        group: The settings that say it, as messages name them.

    Raises:
        FileNotFoundError: There is no such reduction.
        ArtefactError: It is none.
        ValueError: It is of another physics or size or has other cavities than a module, or
            friction is drawn for a surface that neither modules nor hub have.
    """
    hub = spec.hub.rigid.contact_surfaces
    own = [hub, *(each.reduced.contact_surfaces for each in spec.modules)]
    _check_surfaces(drawn, own, group)
    for file in drawn.reductions:
        other, what = ReducedPart.load(file), f"the reduced leg {file} of {group}.reductions"
        for module in spec.modules:
            _check_alike(other, module, what)
        _check_surfaces(drawn, [hub, other.contact_surfaces], group, f" with {file}")


def _check_alike(other: ReducedPart, module: Module, what: str) -> None:
    own = module.reduced
    for same, is_theirs, is_ours in (
        ("of the published physics", not may_be_measured(other), not may_be_measured(own)),
        ("of silicone that relaxes", other.relaxation is not None, own.relaxation is not None),
    ):
        if is_theirs != is_ours:
            raise ValueError(
                f"{what} is {'' if is_theirs else 'not '}{same}, and {module.name} is "
                f"{'' if is_ours else 'not'}, expected another reduction of that leg"
            )
    if other.cavity_count != own.cavity_count:
        raise ValueError(
            f"{what} has {other.cavity_count} cavities, expected {own.cavity_count} as "
            f"{module.name} has: it stands for the robot's own legs in some worlds"
        )
    size = factors_between(other, own)[0]
    sides, ours = (np.ptp(each.rest_nodes, axis=0) for each in (other, own))
    if np.abs(size * sides - ours).max() > SAME_SIZE * ours.max():
        said, expected = (" x ".join(f"{side:.1f}" for side in each) for each in (sides, ours))
        raise ValueError(
            f"{what} is {said} mm large, expected {expected} as {module.name} is, another "
            "reduction of the same leg: it stands for the robot's own legs in some worlds"
        )


def _check_surfaces(
    drawn: Randomisation, surfaces: Iterable[ContactSurfaces | None], group: str, of: str = ""
) -> None:
    known = {name for each in surfaces if each is not None for name in each.known_names()}
    named = ", ".join(sorted(known)) or "none, its meshes name no regions"
    for name, text in drawn.friction_by_surface:
        if name not in names_of_friction(known):
            raise ValueError(
                f"{group}.friction_by_surface has {name!r} ({text}), expected one of the "
                f"surfaces of the robot{of}: {named}"
            )
