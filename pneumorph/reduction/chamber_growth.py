"""How a part's chambers grow with the pressure in them, for the air that fills them."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

DEGREE = 3
"""Of the polynomial."""


def fitted_growth(pressure_kPa: np.ndarray, volume_ratio: np.ndarray) -> tuple[float, ...]:
    """Growth g1, g2, g3 of chambers: relative to rest their volume is 1 + g1 p + g2 p^2 + g3 p^3.

    Least squares of the relative error; none of the numbers is negative, so that what is between
    and beyond the pressures grows too.

    Args:
        pressure_kPa: Pressures above zero [kPa], (bend,).
        volume_ratio: Volume of all chambers over that at rest, at equilibrium, (bend,).

    Returns:
        g1 [1/kPa], g2 [1/kPa^2], g3 [1/kPa^3], to three digits: a cubic misses volumes of legs by
        0.2 to 2 %, and reductions of one leg shall agree. Empty where there is no pressure.
    """
    if len(pressure_kPa) == 0:
        return ()
    scale = float(np.max(pressure_kPa))
    powers = np.vander(pressure_kPa / scale, DEGREE + 1, increasing=True)[:, 1:]
    found, _ = nnls(powers / volume_ratio[:, None], (volume_ratio - 1.0) / volume_ratio)
    return tuple(float(f"{each / scale ** (1 + order):.3g}") for order, each in enumerate(found))
