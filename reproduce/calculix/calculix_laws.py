"""CalculiX's laws: their cards in a deck, and two of them for pneumorph, to compare like with like.

=======================  ==============================  ========================================
law of a Material        card                            the same law here
=======================  ==============================  ========================================
st_venant_kirchhoff      *ELASTIC with NLGEOM            pneumorph's own
stable_neo_hookean       *HYPERFOAM, N=2                 pneumorph's own
yeoh                     *HYPERELASTIC, YEOH             pneumorph's own, volume at every point
calculix_neo_hooke       *HYPERELASTIC, NEO HOOKE        `CalculixNeoHooke`
calculix_corotational    *USER MATERIAL, LIN_EL_COROT    `CalculixCorotational`
=======================  ==============================  ========================================

Importing this file registers the last two with `pneumorph.fem.law_registry`.
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.corotational import Corotational
from pneumorph.fem.law import Strain, differentiated_stress
from pneumorph.fem.law_registry import register_law
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.rotation import cofactor, element_rotation

MILLIPASCAL = 1e6
"""mPa in a kPa. CalculiX takes a residual below 1e-6 for none, whatever its unit; in mm and mPa the
unit of force is 1e-6 mN, and that floor far below what matters."""


def material_card(name: str, material: Material) -> tuple[str, str]:
    """What a material is called in a deck, and its lines there [mPa].

    Args:
        name: What to call it; some laws are chosen by how this begins.
        material: The material.

    Raises:
        ValueError: CalculiX has no such law.
    """
    young, poisson = material.young_modulus_kPa * MILLIPASCAL, material.poisson_ratio
    mu, lame = material.lame_mu * MILLIPASCAL, material.lame_lambda * MILLIPASCAL
    if material.law == "st_venant_kirchhoff":
        lines = f"*ELASTIC\n{_join(young, poisson)}"
    elif material.law == "calculix_neo_hooke":
        bulk = lame + 2.0 * mu / 3.0
        lines = f"*HYPERELASTIC, NEO HOOKE\n{_join(mu / 2.0, 2.0 / bulk)}"
    elif material.law == "yeoh" and material.dilatation == "pointwise":
        # sum_i C_i (I1 - 3)^i + sum_i (J - 1)^(2 i) / D_i; of the D only the first counts.
        c1, bulk = mu / 2.0, lame + 2.0 * mu / 3.0
        c2, c3 = c1 * material.yeoh_c2_over_c1, c1 * material.yeoh_c3_over_c1
        lines = f"*HYPERELASTIC, YEOH\n{_join(c1, c2, c3, 2.0 / bulk, _NO_TERM, _NO_TERM)}"
    elif material.law == "calculix_corotational":
        name = f"LIN_EL_COROT_{name}"
        lines = f"*USER MATERIAL, CONSTANTS=2\n{_join(young, poisson)}"
    elif material.law == "stable_neo_hookean":
        # Hyperfoam: sum_i 2 mu_i / a_i^2 (sum_j l_j^a_i - 3 + (J^(-a_i b_i) - 1) / b_i) with
        # b_i = nu_i / (1 - 2 nu_i). With a = 2 and b = -1/2 (nu = infinity), -1 (nu = 1) it is
        # (mu_1 + mu_2) / 2 (|F|^2 - 3) - mu_1 (J - 1) - mu_2 / 2 (J^2 - 1): ours.
        bulk = lame + mu
        lines = f"*HYPERFOAM, N=2\n{_join(mu + bulk, 2.0, -bulk, 2.0, 1e12, 1.0)}"
    else:
        raise ValueError(
            "law must be st_venant_kirchhoff, stable_neo_hookean, yeoh (pointwise dilatation), "
            f"calculix_neo_hooke or calculix_corotational to write it for CalculiX, got "
            f"{material.law!r} with {material.dilatation} dilatation; the nearest to corotational "
            "is calculix_corotational"
        )
    return name, f"*MATERIAL, NAME={name}\n{lines}"


def sheet_card(name: str, membrane: Membrane) -> tuple[str, float]:
    """Lines of a membrane's material [mPa] and the thickness of the shell that stands for it [mm].

    CalculiX's own membranes stand beside a solid badly: those of 3 nodes leave a singular system,
    those of 6 nodes are 10 % off. Its shells (S3, S6) carry bending and resist the shear across
    them. One as stiff in its plane, a hundred times as thin, and with 0.1 % of the shear
    stiffness across is a membrane: nodes of a box with a sheet of either move alike to 1e-4.

    Args:
        name: What to call the material.
        membrane: The sheet, in St. Venant-Kirchhoff's law.

    Raises:
        ValueError: The sheet follows another law.
    """
    material = membrane.material
    if material.law != "st_venant_kirchhoff":
        raise ValueError(
            f"law of a sheet must be st_venant_kirchhoff to write it for CalculiX, got "
            f"{material.law!r}"
        )
    young = material.young_modulus_kPa * MILLIPASCAL * _THINNER
    shear = material.lame_mu * MILLIPASCAL * _THINNER
    across = _SHEAR_ACROSS * shear
    lines = (
        f"*MATERIAL, NAME={name}\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
        # E and nu of the plane, E and nu across, G of the plane, G across.
        f"{_join(young, young, young, material.poisson_ratio, 0.0, 0.0, shear, across)}\n"
        f"{_join(across)}"
    )
    return lines, membrane.thickness_mm / _THINNER


_THINNER, _SHEAR_ACROSS = 100.0, 1e-3
_NO_TERM = 1e20  # a D so large that its term vanishes; zero would ask for a default


def _join(*values: float) -> str:
    """Numbers of at most 20 characters, all that CalculiX reads of one."""
    return ", ".join(f"{value:.12e}" for value in values)


class CalculixNeoHooke:
    """Rubber whose shear energy does not depend on volume.

        psi = C (J^(-2/3) |F|^2 - 3) + (J - 1)^2 / D,   C = mu / 2,   D = 2 / (lambda + 2 mu / 3).

    Args:
        material: Lame's constants.
        dimension: 3; there is no sheet of it here.

    Raises:
        ValueError: A sheet is wanted.
    """

    damped_strain: Strain = "green"

    def __init__(self, material: Material, dimension: int) -> None:
        if dimension != 3:
            raise ValueError(
                f"calculix_neo_hooke is a law of solids (dimension 3), got {dimension}; give the "
                "sheet st_venant_kirchhoff"
            )
        self._mu = material.lame_mu
        self._bulk = material.lame_lambda + 2.0 * self._mu / 3.0

    def energy(self, gradient: np.ndarray) -> np.ndarray:
        """psi [kPa], (point,)."""
        volume_ratio = self._volume_ratio(gradient)
        squares = np.sum(gradient * gradient, axis=(0, 1))
        energy: np.ndarray = 0.5 * self._mu * (volume_ratio ** (-2.0 / 3.0) * squares - 3.0)
        return energy + 0.5 * self._bulk * (volume_ratio - 1.0) ** 2

    def stress(self, gradient: np.ndarray) -> np.ndarray:
        """P = mu J^(-2/3) (F - |F|^2 / (3 J) cof F) + K (J - 1) cof F [kPa], (3, 3, point)."""
        volume_ratio = self._volume_ratio(gradient)
        squares = np.sum(gradient * gradient, axis=(0, 1))
        shear = self._mu * volume_ratio ** (-2.0 / 3.0)
        along = self._bulk * (volume_ratio - 1.0) - shear * squares / (3.0 * volume_ratio)
        stress: np.ndarray = shear * gradient + along * cofactor(gradient)
        return stress

    def tangent(self, gradient: np.ndarray) -> np.ndarray:
        """dP/dF [kPa], (3, 3, 3, 3, point)."""
        return differentiated_stress(self, gradient)

    def _volume_ratio(self, gradient: np.ndarray) -> np.ndarray:
        """J, (point,)."""
        ratio: np.ndarray = np.sum(gradient[:, 0] * cofactor(gradient)[:, 0], axis=0)
        return ratio


class CalculixCorotational:
    """Hooke's law between the stretch and the second Piola-Kirchhoff stress.

        S = lambda tr(U - I) I + 2 mu (U - I),   P = F S,   F = R U.

    pneumorph's corotational law has P = R S instead; the two differ in the second order of the
    strain. With nu above 0 it has no potential, and its tangent is not symmetric.

    Args:
        material: Lame's constants.
        dimension: 3 for a solid, 2 for a sheet.
    """

    damped_strain: Strain = "stretch"

    def __init__(self, material: Material, dimension: int) -> None:
        self._biot = Corotational(material, dimension, "polar")

    def energy(self, gradient: np.ndarray) -> np.ndarray:
        """There is none.

        Raises:
            ValueError: Always.
        """
        raise ValueError("calculix_corotational has no energy; ask for its stress")

    def stress(self, gradient: np.ndarray) -> np.ndarray:
        """P = F R^T (R S) [kPa], (3, d, point)."""
        rotation = element_rotation(gradient, "polar")
        stress: np.ndarray = np.einsum(
            "iap,jap,jbp->ibp", gradient, rotation, self._biot.stress(gradient)
        )
        return stress

    def tangent(self, gradient: np.ndarray) -> np.ndarray:
        """dP/dF [kPa], (3, d, 3, d, point)."""
        return differentiated_stress(self, gradient)


register_law("calculix_neo_hooke", CalculixNeoHooke)
register_law("calculix_corotational", CalculixCorotational)
