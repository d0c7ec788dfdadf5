"""Triangles of a sheet on a surface: it resists stretching but not bending."""

from __future__ import annotations

import numpy as np

from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.law_registry import make_law
from pneumorph.fem.material import Material
from pneumorph.fem.quadrature import quadrature
from pneumorph.fem.solid import material_frame


def membrane_group(
    nodes: np.ndarray, triangles: np.ndarray, material: Material, thickness_mm: float
) -> ElementGroup:
    """Plane-stress triangles at their integration points.

    Args:
        nodes: Rest positions [mm], (node, 3).
        triangles: Node indices, (element, 3 or 6), midside nodes on the edges 01 12 20.
        material: What the sheet is made of.
        thickness_mm: Its thickness [mm].
    """
    rule = quadrature(2, triangles.shape[1])
    points, count = len(rule.weights), len(triangles)
    # Tangents of the surface at each point, which may be curved.
    tangents = np.einsum("ekx,pkd->epdx", nodes[triangles], rule.gradients).reshape(-1, 2, 3)
    frame = material_frame(tangents)[:, :, :2]
    jacobian = np.swapaxes(tangents @ frame, 1, 2)  # d local / d reference
    gradients = np.repeat(rule.gradients[None], count, axis=0).reshape(points * count, -1, 2)
    lame_lambda, lame_mu = material.lame_constants(2)
    return ElementGroup(
        kind="membrane",
        connectivity=np.repeat(triangles, points, axis=0),
        material_gradients=gradients @ np.linalg.inv(jacobian),
        rest_frame=frame,
        measure=np.linalg.det(jacobian) * np.tile(rule.weights, count) * (0.5 * thickness_mm),
        lame_lambda=np.full(points * count, lame_lambda),
        lame_mu=np.full(points * count, lame_mu),
        material=material,
        law=make_law(material, 2),
        points_per_element=points,
    )
