"""Boxes of either element with a sheet, for the tests of parts."""

import dataclasses

import numpy as np

from helpers.box_mesh import box_mesh
from helpers.law_cases import SHEET_LAWS, case_material
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.geometry.surface import TETRAHEDRON_FACES

ORDERS = ("linear", "quadratic")


def irregular_box(order: str, cells=(3, 3, 2)) -> Mesh:
    """A box of unequal tetrahedra with straight edges, 4 x 4 x 4 mm, over the origin.

    Corners inside are moved at random, those of the middle plane z = 2 within it; its faces are
    the surface ``middle``, and ``outside`` the nodes on the box's sides.
    """
    mesh = box_mesh((4.0, 4.0, 4.0), cells)
    nodes = mesh.nodes.copy()
    inside = np.all((nodes > 1e-9) & (nodes < 4.0 - 1e-9), axis=1)
    middle = np.abs(nodes[:, 2] - 2.0) < 1e-9
    moves = np.random.default_rng(0).uniform(-0.25, 0.25, nodes.shape)
    moves[middle, 2] = 0.0
    nodes[inside] += moves[inside]
    faces = mesh.tetrahedra[:, TETRAHEDRON_FACES].reshape(-1, 3)
    faces = faces[middle[faces].all(axis=1)]
    upward = np.cross(*np.moveaxis(nodes[faces[:, 1:]] - nodes[faces[:, :1]], 1, 0))[:, 2] > 0.0
    mesh = dataclasses.replace(
        mesh, nodes=nodes, surfaces={**mesh.surfaces, "middle": faces[upward]}
    )
    if order == "quadratic":
        mesh = quadratic_mesh(mesh)
    outside = np.any((mesh.nodes < 1e-9) | (mesh.nodes > 4.0 - 1e-9), axis=1)
    return dataclasses.replace(mesh, node_sets={"outside": np.flatnonzero(outside)})


def box_part(law: str, order: str, young: float = 100.0, hollow: bool = False) -> PartModel:
    """A box of one law, with a sheet of it below where the law has one, perhaps with a cavity."""
    mesh = (
        box_mesh((3.0, 3.0, 3.0), (3, 3, 3), hollow=True)
        if hollow
        else box_mesh((4.0, 2.0, 2.0), (2, 1, 1))
    )
    mesh = quadratic_mesh(mesh) if order == "quadratic" else mesh
    sheets = (Membrane("bottom", Material(5.0 * young, 0.3, law), 0.3),)
    return PartModel(
        mesh,
        case_material(law, young),
        0.001,
        sheets if law in SHEET_LAWS else (),
        "cavity" if hollow else None,
        mass_lumping="volume",
    )


def wobbled(part: PartModel, size: float, seed: int = 1) -> np.ndarray:
    """Nodes moved at random by up to `size` [mm] from where a strongly sheared part has them."""
    sheared = part.rest_nodes @ np.array([[1.2, 0.3, 0.0], [0.0, 0.9, 0.1], [-0.2, 0.0, 1.1]])
    noise = np.random.default_rng(seed).uniform(-size, size, sheared.shape)
    return sheared + noise
