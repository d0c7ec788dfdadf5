"""Newton's method for stiff parts that turn far: stresses as the step before foresaw them.

A Newton step dx stretches what it turns: Green's strain at its end is E + sym(F^T dF) + dF^T dF / 2
where its linearisation saw the first two terms alone. In a stiff sheet, or in what resists a change
of volume, the stress of that last term is large, false, and spoils the geometric part of the next
tangent. Taking that part with the stress that the linearisation foresaw,

    S_foreseen = S(E) + dS/dE : sym(F^T dF),   S = F^+ P,

lets the method take steps many times as long, and changes nothing where it converges: dx is zero
there. Magisano, Leonetti and Garcea, How to improve efficiency and robustness of the Newton method
in geometrically non-linear structural problem discretized via displacement-based finite elements,
Comput. Meth. Appl. Mech. Eng. 313 (2017) 986 (mixed integration points).
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.element_group import ElementGroup
from pneumorph.physics.physics import Rotation


def foreseen_stress_entries(
    group: ElementGroup, x: np.ndarray, change: np.ndarray, rotation: Rotation
) -> np.ndarray:
    """What to add to the tangent of a sheet or solid after a Newton step.

    Args:
        group: The elements.
        x: Node positions where the tangent is taken [mm], (node, 3).
        change: The step that led there, dx [mm], (node, 3).
        rotation: Where a corotational law takes its rotation from.

    Returns:
        Upper triangles [mN/mm], (pair, element), as in `pneumorph.fem.element_stiffness`.
    """
    law = group.law_with(rotation)
    before, after = (group.deformation_gradients(each) for each in (x - change, x))
    turned = after - before
    old = _second_stress(before, law.stress(before))
    rise = np.einsum("iajbe,jbe->iae", law.tangent(before), turned)
    rise -= np.einsum("ibe,bae->iae", turned, old)  # dP = dF S + F dS
    stress = old + _second_stress(before, rise) - _second_stress(after, law.stress(after))
    stress = 0.5 * (stress + np.swapaxes(stress, 0, 1)) * group.measure
    gradients = group.gradients_by_corner
    by_corners = np.einsum("nae,abe,mbe->nme", gradients, stress, gradients, optimize=True)
    size = 3 * len(gradients)
    entries = np.zeros((size * (size + 1) // 2, group.element_count))
    pair = 0
    for p in range(size):
        for q in range(p, size):
            if (q - p) % 3 == 0:
                entries[pair] = by_corners[p // 3, q // 3]
            pair += 1
    return entries


def _second_stress(gradient: np.ndarray, first: np.ndarray) -> np.ndarray:
    """S = (F^T F)^-1 F^T P [kPa], (d, d, element), of P, (3, d, element)."""
    metric = np.einsum("iae,ibe->eab", gradient, gradient)
    pulled = np.einsum("iae,ibe->eab", gradient, first)
    return np.moveaxis(np.linalg.solve(metric, pulled), 0, 2)
