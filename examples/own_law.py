"""A law of one's own: the neo-Hookean rubber of most finite-element codes, in one file.

    psi = C10 (I1 J^(-2/3) - 3) + (J - 1)^2 / D1,   I1 = |F|^2,   J = det F,

with C10 = mu / 2 and D1 = 2 / (lambda + 2 mu / 3), so that it is Hooke's law at rest.

    python examples/own_law.py

A bar of quadratic tetrahedra is pulled by 700 kPa: to 2.3 times its length by this law, 1.4 to 2.2
by three that come with the package. All have the same E and nu and agree at small strain.
"""

from __future__ import annotations

import itertools

import numpy as np

from pneumorph.fem.law import Strain, differentiated_stress
from pneumorph.fem.law_registry import register_law
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rotation import cofactor
from pneumorph.fem.static import static_equilibrium
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.quadratic import quadratic_mesh

SIDE_MM = 5.0
CUBE_COUNT = 4
STRESS_KPA = 700.0
"""Pull over the area at rest."""


class IsochoricNeoHookean:
    """A solid; sheets are refused.

    Args:
        material: Lame's constants.
        dimension: 3.

    Raises:
        ValueError: The dimension is another.
    """

    damped_strain: Strain = "green"
    separable_volume = True  # 1 / D1 = lambda / 2 + mu / 3: lambda times (J - 1)^2 / 2 and no more

    def __init__(self, material: Material, dimension: int) -> None:
        if dimension != 3:
            raise ValueError(
                f"isochoric_neo_hookean is for solids (dimension 3), got {dimension}; give the "
                "sheet another law"
            )
        self.c10 = 0.5 * material.lame_mu
        self.d1 = 2.0 / (material.lame_lambda + 2.0 / 3.0 * material.lame_mu)

    def energy(self, gradient: np.ndarray) -> np.ndarray:
        """psi [kPa], (point,)."""
        squares, volume_ratio, _ = _invariants(gradient)
        shape = squares * volume_ratio ** (-2.0 / 3.0) - 3.0
        energy: np.ndarray = self.c10 * shape + (volume_ratio - 1.0) ** 2 / self.d1
        return energy

    def stress(self, gradient: np.ndarray) -> np.ndarray:
        """P = 2 C10 J^(-2/3) (F - I1 / (3 J) cof F) + 2 / D1 (J - 1) cof F [kPa]."""
        squares, volume_ratio, cof = _invariants(gradient)
        shape = gradient - squares / (3.0 * volume_ratio) * cof
        stress: np.ndarray = (
            2.0 * self.c10 * volume_ratio ** (-2.0 / 3.0) * shape
            + 2.0 / self.d1 * (volume_ratio - 1.0) * cof
        )
        return stress

    def tangent(self, gradient: np.ndarray) -> np.ndarray:
        """dP/dF [kPa]; no formula is needed."""
        return differentiated_stress(self, gradient)


def _invariants(gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """I1, J and cof F."""
    cof = cofactor(gradient)
    return np.sum(gradient**2, axis=(0, 1)), np.sum(gradient[:, 0] * cof[:, 0], axis=0), cof


register_law("isochoric_neo_hookean", IsochoricNeoHookean)


def bar_mesh() -> Mesh:
    """Cubes in a row along x, each of six tetrahedra round its diagonal."""
    tetrahedra = []
    for cube in range(CUBE_COUNT):
        for order in itertools.permutations((4, 2, 1)):  # numbers of a step along x, y and z
            path = 4 * cube + np.cumsum([0, *order])
            even = order in ((4, 2, 1), (2, 1, 4), (1, 4, 2))
            tetrahedra.append(path if even else path[[1, 0, 2, 3]])
    corners = itertools.product(range(CUBE_COUNT + 1), (0, 1), (0, 1))
    nodes = SIDE_MM * np.array(list(corners), dtype=float)
    ends = {"left": np.arange(4), "right": 4 * CUBE_COUNT + np.arange(4)}
    return quadratic_mesh(Mesh(nodes, np.array(tetrahedra), node_sets=ends))


def pulled_length_ratio(law: str) -> float:
    """Length over that at rest of the bar, held at its left end and pulled at its right."""
    mesh = bar_mesh()
    part = PartModel(mesh, Material(1000.0, 0.45, law), mass_kg=0.001)
    right = mesh.node_set("right")
    # An even traction on quadratic triangles loads their midside nodes alone: the edges of the
    # square by a sixth of the whole each, its diagonal by a third.
    off_centre = np.abs(mesh.nodes[right][:, 1:] / SIDE_MM - 0.5)
    middle = np.any(off_centre < 0.1, axis=1)
    centre = np.all(off_centre < 0.1, axis=1)
    force = np.zeros_like(mesh.nodes)
    force[right, 0] = STRESS_KPA * SIDE_MM**2 * np.where(centre, 1 / 3, np.where(middle, 1 / 6, 0))
    x = mesh.nodes
    for share in (0.25, 0.5, 0.75, 1.0):
        result = static_equilibrium(
            part,
            0.0,
            mesh.node_set("left"),
            start=x,
            external_force=share * force,
            rotation="polar",
        )
        if not result.converged:
            raise RuntimeError(f"no equilibrium of {law} at {share:.0%} of the load")
        x = result.positions
    return float(x[right, 0].mean() / (CUBE_COUNT * SIDE_MM))


def main() -> dict[str, float]:
    """Length ratio of the pulled bar by name of the law."""
    laws = ("isochoric_neo_hookean", "stable_neo_hookean", "st_venant_kirchhoff", "corotational")
    ratios = {law: pulled_length_ratio(law) for law in laws}
    for law, ratio in ratios.items():
        print(f"{law:24s} {ratio:.3f} times its length")
    return ratios


if __name__ == "__main__":
    main()
