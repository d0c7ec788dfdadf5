"""Blocked force of a leg: what keeps its tip from moving while it is inflated.

The leg is held at its attachment, without gravity or floor. A force along the leg's z axis, even
over the outer end face, keeps the mean height of that face; the face may slide and turn. It is the
force that a scale under the tip would read.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import root_scalar

from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import StaticSettings, static_equilibrium
from pneumorph.geometry.face_tie import FaceTie
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.modal_equilibrium import modal_equilibrium
from pneumorph.reduction.reduced_part import ReducedPart

_HEIGHT_MM = 1e-4
"""Height of the tip that counts as none: about 1e-5 of what a leg lifts it by."""
_EQUILIBRIUM = StaticSettings(load_step_kPa=10.0, tolerance=1e-7)
"""A stiff sheet under a small force is balanced to no more than the rounding of its tension."""
_PROBE_MN = 100.0
"""Force that tells how stiff the tip is at rest."""


@dataclass(frozen=True, eq=False)
class BlockedForce:
    """Force on the tip at one pressure."""

    pressure_kPa: float
    force_mN: float
    """Upwards on the tip, along the leg's z axis; NaN where no equilibrium was found."""
    positions: np.ndarray
    """Of the nodes under it [mm], (node, 3)."""


def blocked_forces(
    leg: ReducedPart | PartModel,
    mesh: Mesh,
    pressures_kPa: Iterable[float],
    rotation: Rotation = "edge",
    region: str = "outer_end_face",
) -> Iterator[BlockedForce]:
    """Blocked forces at rising pressures, up to the first that is not found.

    Args:
        leg: The reduced leg, or its finite elements.
        mesh: The leg's mesh.
        pressures_kPa: Simulated pressures [kPa], positive.
        rotation: Where elements take their rotation from.
        region: Node set of the outer end face.

    Raises:
        MeshError: No face of the mesh's skin lies in the region.
    """
    weights = _even_load(mesh, region)
    tip = _ReducedTip if isinstance(leg, ReducedPart) else _FullTip
    pushed = tip(leg, mesh, weights, rotation)  # type: ignore[arg-type]
    force, before = 0.0, 0.0
    for pressure in pressures_kPa:
        guess = force * pressure / before if before else 0.0

        def height(tried: float, at: float = pressure) -> float:
            return pushed.height_mm(at, tried)

        try:
            stiffness = pushed.stiffness_mN_per_mm
            found = root_scalar(
                height,
                method="secant",
                x0=guess,
                x1=guess - stiffness * height(guess),
                xtol=_HEIGHT_MM * stiffness,
                maxiter=20,
            )
        except ArithmeticError:
            yield BlockedForce(pressure, float("nan"), pushed.positions)
            return
        force, before = float(found.root), pressure
        yield BlockedForce(pressure, force if found.converged else float("nan"), pushed.positions)
        if not found.converged:
            return


class _FullTip:
    """Height of the tip of finite elements under pressure and force."""

    def __init__(self, leg: PartModel, mesh: Mesh, weights: np.ndarray, rotation: Rotation) -> None:
        self._leg, self._weights, self._rotation = leg, weights, rotation
        self._held = FaceTie.of(mesh).nodes
        self.positions, self._pressure = leg.rest_nodes, 0.0
        self.stiffness_mN_per_mm = _PROBE_MN / self.height_mm(0.0, _PROBE_MN)

    def height_mm(self, pressure_kPa: float, force_mN: float) -> float:
        """Mean height of the end face over that at rest [mm]."""
        found = static_equilibrium(
            self._leg,
            pressure_kPa,
            self._held,
            start=self.positions,
            start_pressure_kPa=self._pressure,
            external_force=force_mN * self._weights[:, None] * np.array([0.0, 0.0, 1.0]),
            rotation=self._rotation,
            settings=_EQUILIBRIUM,
        )
        if not found.converged:
            raise ArithmeticError(f"no equilibrium above {found.pressure_kPa:g} kPa")
        self.positions, self._pressure = found.positions, pressure_kPa
        return float(self._weights @ (found.positions - self._leg.rest_nodes)[:, 2])


class _ReducedTip:
    """The same of a reduced leg."""

    def __init__(
        self, leg: ReducedPart, mesh: Mesh, weights: np.ndarray, rotation: Rotation
    ) -> None:
        self._leg, self._rotation = leg, rotation
        self._lift = np.einsum("n,nm->m", weights, leg.modes[:, 2])
        self._alpha = np.zeros(leg.mode_count)
        self.stiffness_mN_per_mm = _PROBE_MN / self.height_mm(0.0, _PROBE_MN)

    @property
    def positions(self) -> np.ndarray:
        """Of the nodes [mm], (node, 3)."""
        return self._leg.positions(self._alpha)

    def height_mm(self, pressure_kPa: float, force_mN: float) -> float:
        """Mean height of the end face over that at rest [mm]."""
        found = modal_equilibrium(
            self._leg,
            pressure_kPa,
            external=force_mN * self._lift,
            start=self._alpha,
            rotation=self._rotation,
        )
        if not found.converged:
            raise ArithmeticError(f"no equilibrium at {pressure_kPa:g} kPa")
        self._alpha = found.alpha
        return float(self._lift @ found.alpha)


def _even_load(mesh: Mesh, region: str) -> np.ndarray:
    """Shares of an even traction over a flat face among the nodes, which add up to 1, (node,)."""
    there = np.isin(np.arange(len(mesh.nodes)), mesh.node_set(region))
    skin = mesh.surface_connectivity("skin")
    face = skin[np.all(there[skin], axis=1)]
    if len(face) == 0:
        raise MeshError(f"no triangle of the skin lies in the node set {region}")
    a, b, c = (mesh.nodes[face[:, corner]] for corner in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    # int N dA: a third of a linear triangle at each corner, of a quadratic one at each midside.
    takers = face if face.shape[1] == 3 else face[:, 3:]
    load = np.bincount(takers.ravel(), np.repeat(area / 3.0, 3), minlength=len(mesh.nodes))
    result: np.ndarray = load / load.sum()
    return result
