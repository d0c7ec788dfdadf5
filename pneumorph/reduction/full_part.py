"""What the reduction asks of a full-order part; `pneumorph.fem.PartModel` answers it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np


class ElementGroup(Protocol):
    """Elements of one kind: tetrahedra (d = 3, k = 4) or membrane triangles (d = 2, k = 3)."""

    @property
    def connectivity(self) -> np.ndarray:
        """(element, k)"""
        ...

    @property
    def material_gradients(self) -> np.ndarray:
        """Shape-function gradients in the material frame [1/mm], (element, k, d)."""
        ...

    @property
    def rest_frame(self) -> np.ndarray:
        """Rest deformation gradient in that frame, (element, 3, d)."""
        ...

    @property
    def measure(self) -> np.ndarray:
        """Volume, or area times thickness [mm^3], (element,)."""
        ...

    @property
    def lame_lambda(self) -> np.ndarray:
        """(Plane-stress) Lame constant [kPa], (element,)."""
        ...

    @property
    def lame_mu(self) -> np.ndarray:
        """Shear modulus [kPa], (element,)."""
        ...


class FullPart(Protocol):
    """A part of finite elements."""

    @property
    def mesh(self) -> Any: ...
    @property
    def node_mass(self) -> np.ndarray:
        """Lumped mass [kg], (node,)."""
        ...

    @property
    def element_groups(self) -> Sequence[Any]: ...
