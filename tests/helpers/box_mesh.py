"""Boxes of cubes split into tetrahedra, with a closed cavity where asked."""

import itertools

import numpy as np

from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.surface import boundary_triangles


def box_mesh(size=(10.0, 6.0, 4.0), cells=(5, 3, 2), hollow=False, keep=None) -> Mesh:
    """A box from the origin; with `hollow` the cubes not at the surface are left out.

    `keep` says of a cube's indices whether it stays, all by default. Regions: surfaces ``skin``,
    ``bottom`` (z = 0), ``cavity`` where hollow, and with `keep` ``inner``, what is not on the box's
    sides, normals into the solid; node sets ``left`` (x = 0) and ``right``.
    """
    shape = np.array(cells) + 1

    def number(corner):
        return (corner[0] * shape[1] + corner[1]) * shape[2] + corner[2]

    tetrahedra = []
    for cell in itertools.product(*(range(n) for n in cells)):
        inside = all(0 < c < n - 1 for c, n in zip(cell, cells, strict=True))
        if (hollow and inside) or (keep and not keep(np.array(cell))):
            continue
        for order in itertools.permutations(range(3)):  # Kuhn's six tetrahedra of a cube
            path = [np.array(cell)]
            for axis in order:
                path.append(path[-1] + np.eye(3, dtype=int)[axis])
            corners = [number(point) for point in path]
            if np.linalg.det(np.diff(np.array(path), axis=0)) < 0:
                corners[0], corners[1] = corners[1], corners[0]
            tetrahedra.append(corners)
    grid = np.array(list(itertools.product(*(range(n) for n in shape))))
    used, compact = np.unique(tetrahedra, return_inverse=True)
    tetrahedra = compact.reshape(-1, 4)
    nodes = grid[used] * np.array(size) / np.array(cells)
    boundary = boundary_triangles(tetrahedra)
    centre = nodes[boundary].mean(axis=1)
    outer = np.any((centre < 1e-9) | (centre > np.array(size) - 1e-9), axis=1)
    surfaces = {"skin": boundary[outer], "bottom": boundary[centre[:, 2] < 1e-9]}
    if hollow:
        surfaces["cavity"] = boundary[~outer][:, ::-1]
    if keep:
        surfaces["inner"] = boundary[~outer][:, ::-1]
    return Mesh(
        nodes,
        tetrahedra,
        surfaces,
        {
            "left": np.flatnonzero(nodes[:, 0] < 1e-9),
            "right": np.flatnonzero(nodes[:, 0] > size[0] - 1e-9),
        },
    )
