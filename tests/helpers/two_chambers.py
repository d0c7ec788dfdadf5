"""A leg with two chambers side by side, each the mirror image of the other, and so the mesh."""

import numpy as np

from helpers.box_mesh import box_mesh
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.surface import boundary_triangles

SIZE_MM = (48.0, 14.0, 6.0)
_CELLS = (8, 7, 3)
"""Of one half."""


def two_chamber_mesh() -> Mesh:
    """A bar along x with a chamber left (y > 0) and one right of a wall in its middle.

    Regions ``cavity_left``, ``cavity_right``, ``sheet``, ``skin``; node sets ``attachment`` and
    ``outer_end_face``. The right half's elements are images of the left half's.
    """

    # Cubes lean one way, so the bar is half of one and its image.
    half = box_mesh(
        (SIZE_MM[0], SIZE_MM[1] / 2.0, SIZE_MM[2]), _CELLS, keep=lambda cell: not _hollow(cell)
    )
    on_middle = np.abs(half.nodes[:, 1]) < 1e-9
    image = np.empty(len(half.nodes), dtype=int)
    image[on_middle] = np.flatnonzero(on_middle)
    image[~on_middle] = len(half.nodes) + np.arange((~on_middle).sum())
    nodes = np.vstack([half.nodes, half.nodes[~on_middle] * [1.0, -1.0, 1.0]])
    tetrahedra = np.vstack([half.tetrahedra, image[half.tetrahedra][:, [1, 0, 2, 3]]])
    boundary = boundary_triangles(tetrahedra)
    centre = nodes[boundary].mean(axis=1)
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    outer = np.any((centre < low + 1e-9) | (centre > high - 1e-9), axis=1)
    inner, side = boundary[~outer][:, ::-1], centre[~outer][:, 1]
    skin = boundary[outer]
    bottom = skin[centre[outer][:, 2] < 1e-9]
    sets = {
        "attachment": np.flatnonzero(nodes[:, 0] < 1e-9),
        "outer_end_face": np.flatnonzero(nodes[:, 0] > SIZE_MM[0] - 1e-9),
    }
    corners = [
        int(np.argmin(np.linalg.norm(nodes - [x, y, 0.0], axis=1)))
        for x in (0.5 * SIZE_MM[0], SIZE_MM[0])
        for y in (low[1], high[1])
    ]
    return Mesh(
        nodes,
        tetrahedra,
        {
            "skin": skin,
            "sheet": bottom,
            "cavity_left": inner[side > 0.0],
            "cavity_right": inner[side < 0.0],
        },
        sets,
        contact_points=nodes[corners],
        mirror_nodes=_partners(nodes),
    )


def _hollow(cell: np.ndarray) -> bool:
    return 0 < cell[0] < _CELLS[0] - 1 and 1 <= cell[1] <= 4 and cell[2] == 1


def _partners(nodes: np.ndarray) -> np.ndarray:
    number = {tuple(np.round(node, 6) + 0.0): place for place, node in enumerate(nodes)}
    return np.array([number[tuple(np.round(node * [1, -1, 1], 6) + 0.0)] for node in nodes])


def two_chamber_leg(young_kPa: float = 300.0) -> PartModel:
    """The leg of silicone with a stiff sheet below."""
    mesh = two_chamber_mesh()
    sheet = Membrane("sheet", Material(10.0 * young_kPa, 0.4), 0.2)
    return PartModel(
        mesh, Material(young_kPa, 0.3), 0.01, (sheet,), ("cavity_left", "cavity_right")
    )
