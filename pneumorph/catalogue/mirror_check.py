"""Refuse to mirror robots whose modules have a left and a right that differ."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.spatial import KDTree

from pneumorph.catalogue.module import Module
from pneumorph.geometry.pose import Pose
from pneumorph.reduction.reduced_part import ReducedPart

TOLERANCE = 0.02
"""Of the width of a module, and of the volume of its largest cavity; meshes of symmetric shapes
come closer."""
_NO_MIRROR = 'set mirror = false in the robot\'s [designs], or space.mirror to "none"'


def check_mirror(module: Module, apart: bool) -> None:
    """Refuse a module that is not its own mirror image about the plane y = 0 of its attachment.

    The mirror image of a robot has its cavities in the opposite order.

    Args:
        module: The module.
        apart: Whether its cavities may be driven by different regulators.

    Raises:
        ValueError: It reaches further or has more volume to one side, or cavities that the mirror
            exchanges are of different volumes or not each other's images, and driven apart.
    """
    part = module.reduced
    face = module.face or Pose(np.eye(3), np.zeros(3))
    nodes = (part.rest_nodes - face.translation) @ face.rotation
    corners = nodes[part.skin]
    sideways = corners[..., 1]
    width = float(np.ptp(sideways))
    sixths = np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    centre = float(sixths @ sideways.sum(axis=1) / (4.0 * sixths.sum()))
    aside = max(abs(sideways.max() + sideways.min()), abs(centre))
    rest = part.cavity_volume
    unlike = float(np.abs(rest - rest[::-1]).max(initial=0.0)) if apart else 0.0
    if aside <= TOLERANCE * width and unlike <= TOLERANCE * float(rest.max(initial=0.0)):
        if apart:
            _check_exchanged(part, nodes, face.rotation, module.name)
        return
    cavities = ", ".join(f"{1e-3 * each:.2f}" for each in rest)
    raise ValueError(
        f"the designs have mirror images, and {module.name} is not its own: it lies "
        f"{centre:.1f} mm to the left, from {sideways.min():.1f} to {sideways.max():.1f} mm, and "
        f"its cavities hold {cavities} ml, expected the same on both sides, since a mirror "
        f"exchanges the first with the last; {_NO_MIRROR}"
    )


def unlike_sides_note(modules: Iterable[Module]) -> str | None:
    """What to say of modules whose modes do not treat left and right alike, where robots have
    mirror images; None where all do.

    Args:
        modules: All of the robot's. What does not say how it was reduced is passed over.
    """
    unlike = [
        each.name
        for each in modules
        if each.reduced.metadata.get("report", {}).get("symmetric_mode_count") == 0
    ]
    if not unlike:
        return None
    return (
        f"the modes of {', '.join(unlike)} do not treat left and right alike (reduced from a mesh "
        "whose sides are meshed apart, or without reduction.symmetric): mirror images of a design, "
        "taken for one, walk alike only roughly"
    )


def _check_exchanged(part: ReducedPart, nodes: np.ndarray, axes: np.ndarray, name: str) -> None:
    """Refuse cavities of which some is less like the image of the one in its place in the opposite
    order than like another's: each is known by how its pressure moves the nodes.

    Args:
        part: The module's.
        nodes: Its nodes at rest in the frame of its attachment [mm], (node, 3).
        axes: That frame's, as columns, (3, 3).
        name: The module's.
    """
    pushed = np.einsum("nim,cm,ij->cnj", part.modes, part.cavity_volume_1, axes)
    mirror = np.array([1.0, -1.0, 1.0])
    _, image_of = KDTree(nodes).query(nodes * mirror)
    images = pushed[:, image_of] * mirror
    apart = np.linalg.norm(images[:, None] - pushed[None], axis=(2, 3))
    nearest, expected = apart.argmin(axis=1), np.arange(len(pushed))[::-1]
    wrong = np.flatnonzero(nearest != expected)
    if len(wrong) == 0:
        return
    first = wrong[0]
    raise ValueError(
        f"the designs have mirror images, in which cavity {first + 1} of {name} changes places "
        f"with cavity {expected[first] + 1}, and its own mirror image pushes like cavity "
        f"{nearest[first] + 1}, expected cavities from left to right in the mesh's order; "
        f"{_NO_MIRROR}, or give its cavities one regulator"
    )
