"""Volumes of a nearly incompressible part in its modes: few pressures over all elements.

A part whose elements take their change of volume as wholes (`pneumorph.fem.volume_group`) has the
energy lambda/2 sum_e V_e theta_e^2, theta = v/V - 1. In few modes no element can keep its volume
alone: the error of the nearest modal state, small in displacements, is many times the snapshots'
own theta, and lambda is hundreds of times mu. So the pressure is reduced as the displacements are:
with fields psi_k over the elements, sum_e V_e psi_ke psi_le = delta_kl, those of the snapshots'
own theta, the energy is that of theta's projection on them,

    E = lambda/2 sum_k c_k^2,   c_k = sum_e V_e psi_ke theta_e = sum_e psi_ke (v_e - V_e),

which is the mixed form with p = sum_k psi_k p_k, its pressures eliminated (Brezzi and Fortin, Mixed
and Hybrid Finite Element Methods, section VI.5; a reduced pressure space: Rozza and Veroy, On the
stability of the reduced basis method for Stokes equations, Comput. Meth. Appl. Mech. Eng. 196
(2007) 1244). v_e is a cubic of the nodes and they are affine in the modes, so c_k is a cubic
polynomial without any error, and no element is visited:

    c = c1 alpha + 1/2 c2 alpha alpha + 1/6 c3 alpha alpha alpha.

With as many fields as elements it is the finite elements' energy.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from pneumorph.fem.volume_group import VolumeGroup
from pneumorph.reduction.leading_vectors import leading_vectors, mirrored_halves

_ROUNDING = 1e-11


@dataclass(frozen=True, eq=False)
class MixedDilatation:
    """Changes of volume c_k and the energy they cost."""

    lame_lambda: float
    """lambda [kPa]."""
    linear: np.ndarray
    """c1 [mm^1.5 per unit of alpha], (pressure, mode)."""
    quadratic: np.ndarray
    """c2, symmetric in its modes, (pressure, mode, mode)."""
    cubic: np.ndarray
    """c3, symmetric in its modes, (pressure, mode, mode, mode)."""

    def changes(self, alpha: np.ndarray) -> np.ndarray:
        """c [mm^1.5] at modal coordinates (..., mode): (..., pressure)."""
        return self._changes_and_gradients(alpha)[0]

    def gradients(self, alpha: np.ndarray) -> np.ndarray:
        """dc/dalpha at modal coordinates (..., mode): (..., pressure, mode)."""
        return self._changes_and_gradients(alpha)[1]

    def energy(self, alpha: np.ndarray) -> np.ndarray:
        """Stored energy [mN mm] at modal coordinates (..., mode): (...)."""
        energy: np.ndarray = 0.5 * self.lame_lambda * np.sum(self.changes(alpha) ** 2, axis=-1)
        return energy

    def force(self, alpha: np.ndarray) -> np.ndarray:
        """-lambda c dc/dalpha [mN mm per unit of alpha] at (..., mode), same shape."""
        changes, gradients = self._changes_and_gradients(alpha)
        force: np.ndarray = -self.lame_lambda * np.einsum("...k,...ka->...a", changes, gradients)
        return force

    def stiffness(self, alpha: np.ndarray) -> np.ndarray:
        """lambda dc (x) dc (mode, mode) at alpha (mode,): definite, and zero on rigid motions.

        What it leaves out, lambda c d2c, is the pressures' geometric part, as
        `VolumeGroup.tangent_entries` leaves it out where it must be definite.
        """
        gradients = self.gradients(alpha)
        stiffness: np.ndarray = self.lame_lambda * gradients.T @ gradients
        return stiffness

    def _changes_and_gradients(self, alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        second = np.einsum("kab,...b->...ka", self.quadratic, alpha)
        turned = np.einsum("kabc,...c->...kab", self.cubic, alpha, optimize=True)
        third = 0.5 * np.einsum("...kab,...b->...ka", turned, alpha)
        parts = self.linear + 0.5 * second + third / 3.0
        return np.einsum("...ka,...a->...k", parts, alpha), self.linear + second + third


def pressure_fields(
    group: VolumeGroup,
    swelling: Iterable[np.ndarray],
    tolerance: float,
    limit: int,
    mirror: np.ndarray | None = None,
) -> np.ndarray:
    """The fields that hold the snapshots' changes of volume best: their POD in the volume.

    Args:
        group: The elements.
        swelling: theta = v/V - 1 of each snapshot, scaled as it is to count, (element,).
        tolerance: Relative root mean square of what the fields may leave.
        limit: At most so many fields.
        mirror: Mirror image of each element, (element,): every field is then exactly symmetric or
            antisymmetric, so that mirrored parts move alike. None where there is none.

    Returns:
        psi, orthonormal in the elements' volumes [mm^-1.5], (element, pressure).

    Raises:
        ValueError: No volume changes in any snapshot.
    """
    root = np.sqrt(group.rest_volume)
    halves = (
        mirrored_halves(weighted, None if mirror is None else weighted[mirror])
        for weighted in (each * root for each in swelling)
    )
    return leading_vectors(halves, tolerance, limit, "swelling") / root[:, None]


def every_element(group: VolumeGroup) -> np.ndarray:
    """A field for each element alone: the unreduced pressure, (element, element)."""
    return np.diag(1.0 / np.sqrt(group.rest_volume))


def mixed_dilatation(
    group: VolumeGroup, nodes: np.ndarray, modes: np.ndarray, fields: np.ndarray
) -> MixedDilatation:
    """Expand the changes of volume in the modal coordinates.

    With the symmetric trilinear D of v(x) = D(x, x, x) the coefficients of v are 3 D(Y, Y, Phi_a),
    6 D(Y, Phi_a, Phi_b) and 6 D(Phi_a, Phi_b, Phi_c).

    Args:
        group: The elements.
        nodes: Rest positions [mm], (node, 3).
        modes: Mode shapes, (node, 3, mode).
        fields: psi [mm^-1.5], (element, pressure).
    """
    mode_count, element_count = modes.shape[2], len(group.rest_volume)
    moves = np.moveaxis(modes[group.connectivity], 0, 3)  # (corner, 3, mode, element)
    flat = moves.reshape(-1, mode_count, element_count)

    def projected(field: np.ndarray) -> np.ndarray:
        # Of a field of forces on the corners, (corner, 3, element): (pressure, mode).
        work = np.einsum("ie,iae->ea", field.reshape(-1, element_count), flat, optimize=True)
        result: np.ndarray = fields.T @ work
        return result

    rest = group.volume_field(nodes)
    shapes = [group.volume_field(modes[:, :, mode]) for mode in range(mode_count)]
    count = fields.shape[1]
    quadratic = np.empty((count, mode_count, mode_count))
    cubic = np.empty((count, mode_count, mode_count, mode_count))
    for a, first in enumerate(shapes):
        quadratic[:, a] = projected(rest.mixed(first))
        for b in range(a, mode_count):
            cubic[:, a, b] = cubic[:, b, a] = projected(first.mixed(shapes[b]))
    linear = 0.5 * projected(rest.mixed(rest))
    # Half of the terms of a part with a mirror vanish; where they are zero, its file is smaller.
    largest = np.abs(cubic).max(axis=(1, 2, 3), initial=0.0)
    cubic[np.abs(cubic) < _ROUNDING * largest[:, None, None, None]] = 0.0
    return MixedDilatation(group.lame_lambda, linear, quadratic, cubic)
