"""Refuse symmetries of a robot that its hub has not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.geometry.pose import rotation_about

_APART = 0.02
"""Of the hub's size, or of its second moments: meshes of symmetric shapes come closer."""
_POINTS_APART = 0.1
"""Of the hub's size: how far the image of a contact point may be from the nearest node that could
be one. Meshes have their nodes anywhere on an outline."""


def check_hub_images(
    hub: HubSpec, mirror: bool, same: Sequence[str], spacing_mm: float = 0.0
) -> None:
    """Refuse a hub that a symmetry of its robot turns into another one.

    Args:
        hub: The hub, with what it carries.
        mirror: Whether the robot is taken for its own mirror image about the forward axis.
        same: What else is said to leave it as it is: ``mirror``, or a turn about z in degrees.
        spacing_mm: How far apart its contact points were spread over its nodes: a node has one no
            further away [mm]; 0 where all that may touch the floor are points.

    Raises:
        ValueError: The image has its mass, its tracked point or what may touch the floor elsewhere.
    """
    if mirror or "mirror" in same:
        _check(hub, np.diag([1.0, -1.0, 1.0]), "mirror is true", "mirror = false", spacing_mm)
    for text in same:
        if text != "mirror":
            turn = rotation_about("z", float(text))
            _check(hub, turn, f'same has "{text}"', "leave that out", spacing_mm)


def _check(hub: HubSpec, image: np.ndarray, said: str, remedy: str, spacing_mm: float) -> None:
    size_mm, rigid = hub.mesh.longest_side_mm, hub.rigid
    centre = rigid.first_moment / rigid.mass
    about_centre = rigid.second_moment / rigid.mass - np.outer(centre, centre)
    found = []
    for name, point in (("centre of mass", centre), ("tracked point", hub.tracked_point)):
        away_mm = float(np.linalg.norm(image @ point - point))
        if away_mm > _APART * size_mm:
            found.append(f"{name}, which comes {away_mm:.3g} mm from where it is")
    changed = np.abs(image @ about_centre @ image.T - about_centre).max() / np.trace(about_centre)
    if changed > _APART:
        found.append(f"inertia, which changes by {100.0 * changed:.2g} % of its sum")
    if len(hub.contact_points):
        away, _ = KDTree(hub.contact_points).query(hub.contact_points @ image.T)
        if away.max() > _POINTS_APART * size_mm + spacing_mm:
            found.append(f"contact points, of which one comes {away.max():.3g} mm from any")
            remedy += (
                "; of a mesh of the right shape, take points closer together (contact_spacing_mm; "
                'with contact = "mesh" that of pneumorph mesh)'
            )
    if found:
        raise ValueError(
            f"[hub]: designs.{said} and the hub is another then, by its {'; by its '.join(found)}; "
            f"expected a hub that is its own image, or {remedy}"
        )
