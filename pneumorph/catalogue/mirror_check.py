"""Refuse to mirror robots whose modules have a left and a right that differ."""

from __future__ import annotations

import numpy as np

from pneumorph.catalogue.module import Module
from pneumorph.geometry.pose import Pose

TOLERANCE = 0.02
"""Of the width of a module, and of the volume of its largest cavity; meshes of symmetric shapes
come closer."""


def check_mirror(module: Module, apart: bool) -> None:
    """Refuse a module that is not its own mirror image about the plane y = 0 of its attachment.

    The mirror image of a robot has its cavities in the opposite order.

    Args:
        module: The module.
        apart: Whether its cavities may be driven by different regulators.

    Raises:
        ValueError: It reaches further or has more volume to one side, or cavities that the mirror
            exchanges are of different volumes and driven apart.
    """
    part = module.reduced
    face = module.face or Pose(np.eye(3), np.zeros(3))
    corners = ((part.rest_nodes - face.translation) @ face.rotation)[part.skin]
    sideways = corners[..., 1]
    width = float(np.ptp(sideways))
    sixths = np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    centre = float(sixths @ sideways.sum(axis=1) / (4.0 * sixths.sum()))
    aside = max(abs(sideways.max() + sideways.min()), abs(centre))
    rest = part.cavity_volume
    unlike = float(np.abs(rest - rest[::-1]).max(initial=0.0)) if apart else 0.0
    if aside <= TOLERANCE * width and unlike <= TOLERANCE * float(rest.max(initial=0.0)):
        return
    cavities = ", ".join(f"{1e-3 * each:.2f}" for each in rest)
    raise ValueError(
        f"the designs have mirror images, and {module.name} is not its own: it lies "
        f"{centre:.1f} mm to the left, from {sideways.min():.1f} to {sideways.max():.1f} mm, and "
        f"its cavities hold {cavities} ml, expected the same on both sides, since a mirror "
        "exchanges the first with the last; set mirror = false in the robot's [designs], or "
        'space.mirror to "none"'
    )
