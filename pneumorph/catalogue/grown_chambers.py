"""The air of a robot whose modules say themselves how their chambers grow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest

from pneumorph.catalogue.module import Module
from pneumorph.catalogue.paper_leg import PhysicsName, leg_kind
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap


def with_growth_of(modules: Sequence[Module], physics: Physics, based_on: PhysicsName) -> Physics:
    """A physics whose chambers grow as the snapshots of a robot's modules say, where nothing else
    was asked for; the mean by volume of modules that grow otherwise than each other.

    Modules that do not know it grow as the physics has it. Where simulated pressures are not real
    ones, the growth would be of the simulated ones, and stays what it was.

    Args:
        modules: The kinds of modules.
        physics: What acts on the robot.
        based_on: The physics by name that it differs from.
    """
    usual = leg_kind(based_on).physics.air.chamber_growth
    own = [module.reduced.chamber_growth for module in modules]
    asked = physics.air.law == "rate_limit" or physics.air.chamber_growth != usual
    if asked or physics.pressure_map != PressureMap(1.0, 0.0) or not any(own):
        return physics
    volumes = [float(module.reduced.cavity_volume.sum()) for module in modules]
    orders = zip_longest(*(usual if each is None else each for each in own), fillvalue=0.0)
    growth = tuple(
        sum(volume * each for volume, each in zip(volumes, order, strict=True)) / sum(volumes)
        for order in orders
    )
    return replace(physics, air=replace(physics.air, chamber_growth=growth))
