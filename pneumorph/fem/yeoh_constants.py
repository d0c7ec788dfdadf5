"""Constants of Yeoh's law: the material they make, the tension curve, and where it turns down.

Incompressible rubber pulled to a stretch s has y = I1 - 3 and the force over area at rest

    one way            y = s^2 + 2 / s - 3        P = 2 (s - s^-2) psi'(y)
    two ways alike     y = 2 s^2 + s^-4 - 3       P = 2 (s - s^-5) psi'(y)
    at constant width  y = s^2 + s^-2 - 2         P = 2 (s - s^-3) psi'(y)

with psi'(y) = C1 + 2 C2 y + 3 C3 y^2 (Treloar, The Physics of Rubber Elasticity, chapter 5).
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.material import Dilatation, Material

STEADY_INVARIANT = 2.0
"""y up to which stress must rise with strain: a bar pulled to twice its length."""

_LARGEST_STRETCH = 20.0  # rubber breaks long before


def yeoh_material(
    c1_kPa: float,
    c2_kPa: float = 0.0,
    c3_kPa: float = 0.0,
    *,
    bulk_over_shear: float = 200.0,
    dilatation: Dilatation = "mean",
) -> Material:
    """A material of Yeoh's law from its constants.

    Args:
        c1_kPa: C1, half the shear modulus [kPa].
        c2_kPa: C2 [kPa].
        c3_kPa: C3 [kPa].
        bulk_over_shear: K / mu.
        dilatation: Where elements take their change of volume.

    Raises:
        ValueError: C1 is not positive, K / mu below 2/3, or stress falls within range.
    """
    if not 0.0 < c1_kPa < np.inf:
        raise ValueError(
            f"c1_kPa must be positive and finite, got {c1_kPa}: the shear modulus is 2 C1; was the "
            "fit free to leave the origin with a falling stress?"
        )
    if not 2.0 / 3.0 <= bulk_over_shear < np.inf:
        raise ValueError(
            "bulk_over_shear must be finite and at least 2/3, which is Poisson's ratio 0, got "
            f"{bulk_over_shear}"
        )
    refuse_falling_stress(c1_kPa, c2_kPa, c3_kPa)
    poisson = (3.0 * bulk_over_shear - 2.0) / (6.0 * bulk_over_shear + 2.0)
    return Material(
        4.0 * c1_kPa * (1.0 + poisson),
        poisson,
        "yeoh",
        yeoh_c2_over_c1=c2_kPa / c1_kPa,
        yeoh_c3_over_c1=c3_kPa / c1_kPa,
        dilatation=dilatation,
    )


def tension_stress(stretch: np.ndarray, c1: float, c2: float = 0.0, c3: float = 0.0) -> np.ndarray:
    """Force over area at rest of a bar pulled one way, in the unit of the constants, (n,).

    Args:
        stretch: s, (n,).
        c1: C1.
        c2: C2.
        c3: C3.
    """
    y = stretch**2 + 2.0 / stretch - 3.0
    return 2.0 * (stretch - stretch**-2) * (c1 + y * (2.0 * c2 + 3.0 * c3 * y))


def turning_invariant(c1: float, c2: float, c3: float) -> float:
    """Least y at which the stress of one of the three tests stops rising; infinity if none does.

    Args:
        c1: C1, positive.
        c2: C2.
        c3: C3.
    """
    s = np.geomspace(1.0, _LARGEST_STRETCH, 20_000)
    tests = (
        (s**2 + 2.0 / s - 3.0, s - s**-2),
        (2.0 * s**2 + s**-4 - 3.0, s - s**-5),
        (s**2 + s**-2 - 2.0, s - s**-3),
    )
    turns = [np.inf]
    for y, pull in tests:
        stress = pull * (c1 + y * (2.0 * c2 + 3.0 * c3 * y))
        falling = np.flatnonzero(np.diff(stress) < 0.0)
        turns += [float(y[falling[0]])] if len(falling) else []
    return min(turns)


def refuse_falling_stress(c1: float, c2: float, c3: float) -> None:
    """Refuse constants whose stress falls while strain rises to that of twice the length.

    Args:
        c1: C1, positive.
        c2: C2.
        c3: C3.

    Raises:
        ValueError: The stress turns down at y below `STEADY_INVARIANT`.
    """
    turn = turning_invariant(c1, c2, c3)
    if turn < STEADY_INVARIANT:
        raise ValueError(
            f"Yeoh constants C1 {c1:g}, C2 {c2:g}, C3 {c3:g} kPa make a stress that falls from "
            f"I1 - 3 = {turn:.3g} on, expected a rising one up to {STEADY_INVARIANT:g} (twice the "
            "length); were they fitted to smaller strains than that? Fit fewer constants, or to "
            "more of the curve"
        )
