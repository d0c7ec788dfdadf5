"""How well Newton's method does with kept factors, told by the sizes of its changes.

The error that is left after a change dv_k that is theta times the one before is at most

    theta / (1 - theta) |dv_k|

where changes go on to shrink so (Deuflhard, Newton Methods for Nonlinear Problems, section 2.1.2).
Their norm is that of kinetic energy. Unbalanced impulses tell little: a stiff sheet that turns by a
small angle is stretched a little by a good iteration, and its false tension outweighs all else.
Errors of stiff and soft motions take turns, so theta is the worse of the last change over the one
before and the root of the last over the last but one.
"""

from __future__ import annotations

import numpy as np

POOR_CONTRACTION = 0.3
"""Share of a change that may be left after two iterations."""
PATIENCE = 8
"""Changes since the smallest, the last of them poor, that lead nowhere. Where a sheet springs a
change may be three times as large as the one before, and the method still converge."""


class Contraction:
    """Sizes of the changes that one set of factors has led to.

    Args:
        earlier: Whether the factors are of an earlier step. Then the second change alone must be
            small beside the first; that by factors of the first trial itself is much better than
            later ones, and the next need only be smaller.
    """

    def __init__(self, earlier: bool) -> None:
        self.earlier = earlier
        self._sizes: list[float] = []

    def accept(self, size: float) -> bool:
        """Take in a change; whether it is worth making: whether the factors still do.

        Args:
            size: Its size, in any unit.
        """
        if len(self._sizes) > 1 and size > POOR_CONTRACTION * self._sizes[-2]:
            return False
        share = POOR_CONTRACTION if self.earlier else 1.0
        if len(self._sizes) == 1 and size > share * self._sizes[0]:
            return False
        if self.earlier and not np.isfinite(size):
            return False
        self._sizes.append(size)
        return True

    def goes_on_poorly(self, size: float) -> bool:
        """Take in a change that was not accepted; whether to give up.

        Args:
            size: Its size.
        """
        self._sizes.append(size)
        best = int(np.argmin(self._sizes))
        return not np.isfinite(size) or len(self._sizes) - 1 - best >= PATIENCE

    @property
    def left(self) -> float:
        """Estimate of the error after the last change; infinite before there are three."""
        if len(self._sizes) < 3:
            return np.inf
        first, second, last = self._sizes[-3:]
        if last == 0.0:
            return 0.0
        share = max(last / second, np.sqrt(last / first))
        return last * share / (1.0 - share) if share < 1.0 else np.inf
