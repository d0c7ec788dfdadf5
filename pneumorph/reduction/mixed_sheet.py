"""The stretch of a stiff sheet in a part's modes: few fields of stress over all its points.

A sheet that hardly stretches, such as paper under rubber, has a part bend as it likes and lets no
line on it grow. In few modes it cannot: a bent state that the modes hold to a hundredth of a
millimetre stretches the sheet, and its stiffness makes that cost hundreds of times the energy of
the bend. Where the snapshots were, the modes are fitted to it; beside them the part is far too
stiff, a leg against sideways loads nearly three times (docs/physics.md). So the stress is reduced
as the displacements are, which is the mixed principle of Hellinger and Reissner (Brezzi and Fortin,
Mixed and Hybrid Finite Element Methods, section I.3): with fields sigma_k over the points,
orthonormal in the work of stress, those of the snapshots' own stress, the energy is that of the
strain's projection on them,

    energy = k/2 sum c_j^2,   k^(1/2) c_j = sum_p measure_p sigma_jp : E_p,

with k the sheet's Young's modulus and E Green's strain. E is quadratic in the nodes and they are
affine in the modes, so c is a quadratic polynomial without any error, and no point is visited:

    c = c1 alpha + 1/2 c2 alpha alpha.

With as many fields as the points have components of strain it is the finite elements' energy.
`mixed_dilatation.py` does the same for the volumes of nearly incompressible solids.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from pneumorph.fem.element_group import ElementGroup
from pneumorph.reduction.leading_vectors import leading_vectors, mirrored_halves

LAW = "st_venant_kirchhoff"
"""The law that is quadratic in Green's strain, and so the only one this holds for."""


_ROUNDING = 1e-9
"""Share of the strains that is no more than rounding: no field is made of it."""


@dataclass(frozen=True, eq=False)
class MixedSheet:
    """Stretches c_j of a sheet and the energy they cost."""

    young_modulus_kPa: float
    """k [kPa]."""
    linear: np.ndarray
    """c1 [mm^1.5 per unit of alpha], (stretch, mode)."""
    quadratic: np.ndarray
    """c2, symmetric in its modes, (stretch, mode, mode)."""

    def stretches(self, alpha: np.ndarray) -> np.ndarray:
        """c [mm^1.5] at modal coordinates (..., mode): (..., stretch)."""
        return self._stretches_and_gradients(alpha)[0]

    def energy(self, alpha: np.ndarray) -> np.ndarray:
        """Stored energy [mN mm] at modal coordinates (..., mode): (...)."""
        energy: np.ndarray = (
            0.5 * self.young_modulus_kPa * np.sum(self.stretches(alpha) ** 2, axis=-1)
        )
        return energy

    def force(self, alpha: np.ndarray) -> np.ndarray:
        """-k c dc/dalpha [mN mm per unit of alpha] at (..., mode), same shape."""
        stretches, gradients = self._stretches_and_gradients(alpha)
        force: np.ndarray = -self.young_modulus_kPa * np.einsum(
            "...k,...ka->...a", stretches, gradients
        )
        return force

    def stiffness(self, alpha: np.ndarray) -> np.ndarray:
        """k dc (x) dc (mode, mode) at alpha (mode,): definite, without the geometric k c c2."""
        gradients = self._stretches_and_gradients(alpha)[1]
        stiffness: np.ndarray = self.young_modulus_kPa * gradients.T @ gradients
        return stiffness

    def _stretches_and_gradients(self, alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        second = np.einsum("kab,...b->...ka", self.quadratic, alpha)
        half = self.linear + 0.5 * second
        return np.einsum("...ka,...a->...k", half, alpha), self.linear + second


def scaled_strain(group: ElementGroup, x: np.ndarray) -> np.ndarray:
    """Green's strain, scaled so that the energy is half the square of its norm [(mN mm)^0.5].

    Args:
        group: Points of a sheet of St. Venant-Kirchhoff's law.
        x: Node positions [mm], (node, 3).

    Returns:
        (3 point,)

    Raises:
        ValueError: The group is no sheet, or of another law.
    """
    if group.dimension != 2 or group.material.law != LAW:
        raise ValueError(
            f"the sheet's law is {group.material.law!r} in {group.dimension} dimensions, expected "
            f"{LAW!r} in 2: of others the stress is not linear in Green's strain; sample its "
            "triangles instead"
        )
    gradient = group.deformation_gradients(x)
    strain = _products(gradient, gradient)
    strain[:2] -= 1.0
    return _scaled(group, 0.5 * strain)


def stress_fields(
    strains: Iterable[tuple[np.ndarray, np.ndarray | None]], limit: int
) -> np.ndarray:
    """The fields of stress that hold the snapshots' own best: their POD in the work of stress.

    Args:
        strains: `scaled_strain` of each snapshot, scaled as it is to count, (3 point,), and the
            same of the mirrored snapshot: every field is then exactly symmetric or antisymmetric,
            so that mirrored parts move alike. None instead where there is no mirror.
        limit: At most so many fields.

    Returns:
        sigma, orthonormal, (3 point, stretch).

    Raises:
        ValueError: The sheet is stretched in no snapshot.
    """
    halves = (mirrored_halves(*each) for each in strains)
    return leading_vectors(halves, _ROUNDING, limit, "strains")


def mixed_sheet(
    group: ElementGroup, nodes: np.ndarray, modes: np.ndarray, fields: np.ndarray
) -> MixedSheet:
    """Expand the stretches in the modal coordinates.

    Args:
        group: The sheet's points.
        nodes: Rest positions [mm], (node, 3).
        modes: Mode shapes, (node, 3, mode).
        fields: sigma, (3 point, stretch).
    """
    mode_count, young = modes.shape[2], group.material.young_modulus_kPa
    rest = group.deformation_gradients(nodes)
    shapes = [group.deformation_gradients(modes[:, :, mode]) for mode in range(mode_count)]
    turned = fields.T / young**0.5
    linear = np.empty((fields.shape[1], mode_count))
    quadratic = np.empty((fields.shape[1], mode_count, mode_count))
    for a, first in enumerate(shapes):
        linear[:, a] = turned @ _scaled(group, _products(rest, first))
        for b in range(a, mode_count):
            column = turned @ _scaled(group, _products(first, shapes[b]))
            quadratic[:, a, b] = quadratic[:, b, a] = column
    return MixedSheet(young, linear, quadratic)


def _products(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """sym(A^T B) of gradients (3, 2, point): its components 11, 22 and 12, (3, point)."""
    both = np.einsum("iap,ibp->abp", first, second)
    return np.stack([both[0, 0], both[1, 1], 0.5 * (both[0, 1] + both[1, 0])])


def _scaled(group: ElementGroup, strain: np.ndarray) -> np.ndarray:
    """The root of lambda tr E^2 + 2 mu E : E times measure, as a vector, (3 point,)."""
    lame_lambda, mu = group.weighted_constants
    mean, half = 0.5 * (strain[0] + strain[1]), 0.5 * (strain[0] - strain[1])
    of_mean, of_shear = np.sqrt(2.0 * (mu + lame_lambda)), np.sqrt(2.0 * mu)
    first = of_mean * mean + of_shear * half
    second = of_mean * mean - of_shear * half
    return np.stack([first, second, 2.0**0.5 * of_shear * strain[2]], axis=1).ravel()
