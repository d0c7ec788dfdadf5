"""Membrane triangles in plane stress: a sheet that resists stretching but not bending."""

from __future__ import annotations

import numpy as np

from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.material import Material
from pneumorph.fem.tetrahedra import material_frame, shape_gradients


def membrane_group(
    nodes: np.ndarray, triangles: np.ndarray, material: Material, thickness_mm: float
) -> ElementGroup:
    """Corotational plane-stress triangles.

    Args:
        nodes: Rest positions [mm], (node, 3).
        triangles: Node indices, (element, 3).
        material: What the sheet is made of.
        thickness_mm: Its thickness [mm].
    """
    edges = nodes[triangles[:, 1:]] - nodes[triangles[:, :1]]  # (element, 2, xyz)
    frame = material_frame(edges)[:, :, :2]
    local = edges @ frame
    return ElementGroup(
        kind="membrane",
        connectivity=triangles,
        material_gradients=shape_gradients(local),
        rest_frame=frame,
        measure=np.linalg.det(local) / 2.0 * thickness_mm,
        lame_lambda=np.full(len(triangles), material.plane_stress_lambda),
        lame_mu=np.full(len(triangles), material.lame_mu),
    )
