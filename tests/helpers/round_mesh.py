"""Quarters of tubes and octants of spherical shells, by rounding boxes with a corner left out."""

import dataclasses

import numpy as np

from helpers.box_mesh import box_mesh
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.quadratic import quadratic_mesh


def rounded(nodes: np.ndarray, axes: int) -> np.ndarray:
    """Squares (2 axes) or cubes (3) about the origin made circles or spheres of the same size.

    A point of max-norm r over its first axes moves to the radius r, its direction by the tangents
    of equal angles. Planes through the origin along axes stay where they are.
    """
    radius = np.abs(nodes[:, :axes]).max(axis=1, keepdims=True)
    direction = np.tan(np.pi / 4.0 * nodes[:, :axes] / np.maximum(radius, 1e-300))
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-300)
    return np.hstack([radius * direction, nodes[:, axes:]])


def round_sector(cells: int, axes: int, quadratic: bool, size=(2.0, 2.0, 2.0)) -> Mesh:
    """A quarter tube (2 axes) or an octant of a shell (3) between the radii 1 and 2 mm.

    Its ``inner`` surface has normals into the solid; midside nodes lie on the circles and spheres.

    Args:
        cells: Cubes along an axis, even; half of them through the wall.
        axes: 2 or 3.
        quadratic: With midside nodes.
        size: The box that is rounded [mm]; its third side is a tube's length.
    """
    along = cells if axes == 3 else 1
    box = box_mesh(size, (cells, cells, along), keep=lambda cell: cell[:axes].max() >= cells // 2)
    mesh = quadratic_mesh(box) if quadratic else box
    return dataclasses.replace(mesh, nodes=rounded(mesh.nodes, axes))


def symmetry_unknowns(mesh: Mesh) -> np.ndarray:
    """Unknowns normal to the planes x = 0, y = 0, z = 0 at their nodes, fixed by symmetry."""
    return np.flatnonzero(np.abs(mesh.nodes).ravel() < 1e-9)
