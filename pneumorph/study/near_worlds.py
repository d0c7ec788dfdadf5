"""Worlds that nobody could tell apart: how well a walk repeats itself.

Feet that stick in one world and slip in the next take a robot elsewhere. Where a thousandth of its
friction, stiffness or mass decides that, the walk is chaotic, and one walk of any model says little
of another, or of the robot's next one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pneumorph.physics.physics import Physics
from pneumorph.simulation.randomisation import World

NEAR_SHARE = 1e-3
"""Standard deviation of each number of a near world, relative to the world's."""
NEAR_COUNT = 16
"""Near worlds in which a walk is repeated."""


def near_worlds(
    world: World, physics: Physics, count: int = NEAR_COUNT, seed: int = 0
) -> list[World]:
    """Worlds whose friction, moduli and masses are those of a world but for a thousandth.

    Changes are normal.

    Args:
        world: The world.
        physics: Says the friction of surfaces that the world does not.
        count: How many.
        seed: Of the changes.
    """
    draw = np.random.default_rng([seed, 17]).standard_normal

    def near(value: float) -> float:
        return value * (1.0 + NEAR_SHARE * float(draw()))

    surfaces = {**dict(physics.friction_by_surface), **dict(world.friction_by_surface)}
    return [
        replace(
            world,
            friction=near(world.friction),
            modulus_factor=near(world.modulus_factor),
            mass_factor=near(world.mass_factor),
            friction_by_surface=tuple((name, near(each)) for name, each in surfaces.items()),
        )
        for _ in range(count)
    ]
