"""Tetrahedra of a solid: linear with 4 nodes, quadratic with 10."""

from __future__ import annotations

import numpy as np

from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.law_registry import make_law
from pneumorph.fem.material import Material
from pneumorph.fem.quadrature import quadrature
from pneumorph.fem.volume_group import VolumeGroup
from pneumorph.geometry.mesh import MeshError


def solid_groups(
    nodes: np.ndarray, tetrahedra: np.ndarray, material: Material
) -> tuple[ElementGroup, VolumeGroup | None]:
    """Elements of a solid; with mean dilatation those of its shape, and those of its volume.

    Args:
        nodes: Rest positions [mm], (node, 3).
        tetrahedra: Node indices of positive tetrahedra, (element, 4 or 10).
        material: What the solid is made of.

    Raises:
        MeshError: An element is inverted at one of its points.
        ValueError: The law's energy does not fall into one of shape and one of volume.
    """
    if material.dilatation == "pointwise":
        return tetrahedron_group(nodes, tetrahedra, material), None
    shape = tetrahedron_group(nodes, tetrahedra, material.without_lambda())
    if not getattr(shape.law, "separable_volume", False):
        raise ValueError(
            f'dilatation "mean" needs a law whose energy depends on lambda by lambda/2 (J - 1)^2 '
            f'alone, such as yeoh or stable_neo_hookean, got {material.law!r}; take "pointwise"'
        )
    return shape, VolumeGroup.of_solid(nodes, tetrahedra, material)


def tetrahedron_group(
    nodes: np.ndarray, tetrahedra: np.ndarray, material: Material
) -> ElementGroup:
    """Tetrahedra at their integration points.

    Linear tetrahedra lock: thin walls bend too little. Quadratic ones do not.

    Args:
        nodes: Rest positions [mm], (node, 3).
        tetrahedra: Node indices of positive tetrahedra, (element, 4 or 10), midside nodes on the
            edges 01 12 20 03 13 23.
        material: What the solid is made of.

    Raises:
        MeshError: An element is inverted at one of its points, by a midside node out of place.
    """
    rule = quadrature(3, tetrahedra.shape[1])
    points, count = len(rule.weights), len(tetrahedra)
    corners = nodes[tetrahedra]  # (element, k, xyz)
    frame = material_frame(corners[:, 1:4] - corners[:, :1])
    local = corners @ frame
    jacobian = np.einsum("ekx,pkd->epxd", local, rule.gradients)
    determinant = np.linalg.det(jacobian)
    if determinant.min(initial=np.inf) <= 0.0:
        worst = int(np.argmin(determinant.min(axis=1)))
        raise MeshError(
            f"tetrahedron {worst} is inverted at an integration point; are its corners or midside "
            "nodes in another order than 01 12 20 03 13 23?"
        )
    gradients = np.einsum("pkd,epdx->epkx", rule.gradients, np.linalg.inv(jacobian))
    lame_lambda, lame_mu = material.lame_constants(3)
    return ElementGroup(
        kind="tetrahedron",
        connectivity=np.repeat(tetrahedra, points, axis=0),
        material_gradients=gradients.reshape(points * count, -1, 3),
        rest_frame=np.repeat(frame, points, axis=0),
        measure=(determinant * rule.weights / 6.0).ravel(),
        lame_lambda=np.full(points * count, lame_lambda),
        lame_mu=np.full(points * count, lame_mu),
        material=material,
        law=make_law(material, 3),
        points_per_element=points,
    )


def material_frame(edges: np.ndarray) -> np.ndarray:
    """Axes of the material frame as columns, (element, 3, 3).

    Args:
        edges: Edges from node 0 to nodes 1, 2 (and 3) [mm], (element, 2 or 3, 3).
    """
    first = edges[:, 0] / np.linalg.norm(edges[:, 0], axis=1, keepdims=True)
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first), normal], axis=2)
