"""How the chambers of several kinds of modules grow together."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

import numpy as np


def mean_growth(
    volumes_mm3: Sequence[float], growths: Sequence[tuple[float, ...]]
) -> tuple[float, ...]:
    """The growth that all chambers of a robot's modules have together, one module of each kind; see
    `pneumorph.physics.air.Air.chamber_growth`.

    Args:
        volumes_mm3: Volume of the chambers of each kind at rest [mm^3].
        growths: Growth of each, powers of the pressure rising.

    Returns:
        The mean by volume, to three digits where kinds differ.
    """
    if len(set(growths)) == 1:
        return growths[0]
    orders = np.array(list(zip_longest(*growths, fillvalue=0.0)))
    mean = orders @ np.array(volumes_mm3) / sum(volumes_mm3)
    return tuple(float(f"{order:.3g}") for order in mean)
