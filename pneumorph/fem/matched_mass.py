"""Node masses of a mesh that together are a body of given mass, centre and inertia."""

from __future__ import annotations

import numpy as np

from pneumorph.fem.node_mass import node_mass
from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.geometry.mesh import Mesh

_STEP_LIMIT = 100
_TOLERANCE = 1e-12
"""Of moments in units of the mesh's own: some thousand roundings."""
_LEVEL = 1e-6
"""Of the mesh's height: nodes this near count as on one level."""
_FIRST, _SECOND = [0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]
"""Second moments xx, xy, yy, then those with z."""
_ALL, _WITHOUT_HEIGHT = 10, 7


def matched_node_mass(mesh: Mesh, body: MassProperties) -> np.ndarray:
    """Masses of the nodes with a body's mass, centre of mass and inertia tensor [kg], (node,).

    A hollow hub is computed on the mesh of a full disk. Of all positive masses with the body's ten
    moments up to the second order, these are the nearest, in relative entropy, to an even filling
    V_i of the mesh: m_i = V_i exp(q(x_i)) with a quadratic polynomial q, whose coefficients are
    where the convex function sum m_i - q . moments is least; Newton's method finds it.

    A flat mesh may have its nodes on two levels only, as the disk that ships: masses there always
    have the same spread in height about a given centre. Then the products with z are left free, and
    mass, centre and the moment about the vertical are the body's.

    Args:
        mesh: The mesh, in the body's frame.
        body: What the masses are to be together.

    Raises:
        ValueError: No positive masses on these nodes have the body's moments: it reaches beyond the
            mesh, or its place or shape are others. Of a mesh of two levels: its mass, centre and
            moment about the vertical.
    """
    even = node_mass(mesh, 1.0, "volume")
    centre = even @ mesh.nodes
    # About the mesh's centre, and each axis in units of the mesh's extent along it.
    size = np.sqrt(even @ (mesh.nodes - centre) ** 2)
    points = (mesh.nodes - centre) / size
    shift = (body.centre_mm - centre) / size
    second = body.second_moment / body.mass_kg - np.outer(body.centre_mm, body.centre_mm)
    second = second / np.outer(size, size) + np.outer(shift, shift)
    wanted = np.concatenate([[1.0], shift, second[_FIRST, _SECOND]])
    monomials = np.column_stack(
        [np.ones(len(points)), points, points[:, _FIRST] * points[:, _SECOND]]
    )
    for count in (_ALL, _WITHOUT_HEIGHT) if _on_two_levels(mesh) else (_ALL,):
        masses = _nearest(even, monomials[:, :count], wanted[:count])
        if masses is not None:
            result: np.ndarray = body.mass_kg * masses / masses.sum()
            return result
    raise ValueError(
        f"no positive masses on the mesh's {len(mesh.nodes)} nodes have the centre "
        f"({', '.join(f'{v:.1f}' for v in body.centre_mm)}) mm and the principal moments "
        f"{', '.join(f'{m:g}' for m in np.linalg.eigvalsh(body.inertia))} kg mm^2 of "
        f"{body.mass_kg:g} kg; the body is of another shape, or elsewhere"
    )


def _on_two_levels(mesh: Mesh) -> bool:
    """Whether all nodes lie at the mesh's top or at its bottom."""
    height = mesh.nodes[:, 2]
    from_end = np.minimum(height - height.min(), height.max() - height)
    return bool(from_end.max() <= _LEVEL * np.ptp(height))


def _nearest(even: np.ndarray, monomials: np.ndarray, wanted: np.ndarray) -> np.ndarray | None:
    """Positive masses with the wanted moments nearest to `even`, (node,); None if not found."""
    coefficients, masses = np.zeros(len(wanted)), even
    for _ in range(_STEP_LIMIT):
        missing = wanted - masses @ monomials
        if np.abs(missing).max() < _TOLERANCE:
            return masses
        hessian = monomials.T @ (masses[:, None] * monomials)
        step = np.linalg.lstsq(hessian, missing, rcond=1e-12)[0]
        value = masses.sum() - coefficients @ wanted
        # Exponents grow by two at most; then half as far until the function falls.
        step *= min(1.0, 2.0 / np.abs(monomials @ step).max())
        for _ in range(30):
            trial = even * np.exp(monomials @ (coefficients + step))
            if trial.sum() - (coefficients + step) @ wanted <= value + 1e-15 * abs(value):
                break
            step *= 0.5
        coefficients, masses = coefficients + step, trial
    return None
