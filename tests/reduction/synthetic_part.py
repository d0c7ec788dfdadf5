"""A small real part made with numpy alone: a box with a cavity and a membrane on its bottom.

It answers what the reduction asks of a full-order part (`pneumorph.reduction.full_part`), is
symmetric under y -> -y, and its elements come in mirror pairs e, e + E/2 with equal shape.
"""

from __future__ import annotations

import hashlib
import itertools
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.sampled_elements import rotated_stress, strain_factors


@dataclass(frozen=True)
class SyntheticMesh:
    nodes: np.ndarray
    tetrahedra: np.ndarray
    surfaces: dict[str, np.ndarray]
    node_sets: dict[str, np.ndarray]
    contact_points: np.ndarray
    mirror_nodes: np.ndarray

    @property
    def connectivity(self) -> np.ndarray:
        return self.tetrahedra

    def digest(self) -> str:
        return hashlib.sha256(self.nodes.tobytes() + self.tetrahedra.tobytes()).hexdigest()


@dataclass(frozen=True)
class SyntheticGroup:
    """Elements with their material frame as `pneumorph.reduction.full_part` describes it."""

    connectivity: np.ndarray
    material_gradients: np.ndarray
    rest_frame: np.ndarray
    measure: np.ndarray
    lame_lambda: np.ndarray
    lame_mu: np.ndarray

    @classmethod
    def build(cls, nodes, connectivity, young, poisson, thickness=None) -> SyntheticGroup:
        corners = nodes[connectivity]
        edges = corners[:, 1:] - corners[:, :1]  # (element, d, 3)
        first = edges[:, 0] / np.linalg.norm(edges[:, 0], axis=1, keepdims=True)
        normal = np.cross(edges[:, 0], edges[:, 1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        dimension = edges.shape[1]
        frame = np.stack([first, np.cross(normal, first), normal][:dimension], axis=2)
        local = edges @ frame  # rows: edges in the material frame
        inner = np.swapaxes(np.linalg.inv(local), 1, 2)  # gradients of nodes 1..d
        gradients = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
        size = np.abs(np.linalg.det(local)) / (6.0 if dimension == 3 else 2.0)
        if dimension == 3:
            lame_lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
        else:
            lame_lambda = young * poisson / (1 - poisson**2)
            size = size * thickness
        count = len(connectivity)
        return cls(
            connectivity,
            gradients,
            frame,
            size,
            np.full(count, lame_lambda),
            np.full(count, young / (2 * (1 + poisson))),
        )

    def forces(self, x: np.ndarray, rotation: str = "edge") -> np.ndarray:
        gradient = np.einsum("eni,end->eid", x[self.connectivity], self.material_gradients)
        stress = rotated_stress(
            gradient, self.lame_lambda * self.measure, self.lame_mu * self.measure, rotation
        )
        return -np.einsum("eid,end->eni", stress, self.material_gradients)

    def stiffness(self, x: np.ndarray, rotation: str = "edge") -> np.ndarray:
        count, k, dimension = self.material_gradients.shape
        gradient = np.einsum("eni,end->eid", x[self.connectivity], self.material_gradients)
        directions = np.zeros((count, 3, dimension, k, 3))
        for axis in range(3):
            directions[:, axis, :, :, axis] = np.swapaxes(self.material_gradients, 1, 2)
        factors = strain_factors(
            gradient,
            directions.reshape(count, 3, dimension, 3 * k),
            self.lame_lambda * self.measure,
            self.lame_mu * self.measure,
            rotation,
        )
        return np.swapaxes(factors, 1, 2) @ factors


@dataclass(frozen=True)
class SyntheticPart:
    mesh: SyntheticMesh
    node_mass: np.ndarray
    element_groups: tuple[SyntheticGroup, ...]
    settings: dict = field(default_factory=dict)

    def internal_force(self, x: np.ndarray, rotation: str = "edge") -> np.ndarray:
        force = np.zeros_like(x)
        for group in self.element_groups:
            np.add.at(force, group.connectivity, group.forces(x, rotation))
        return force

    def stiffness(self, x: np.ndarray, rotation: str = "edge") -> np.ndarray:
        size = x.size
        matrix = np.zeros((size, size))
        for group in self.element_groups:
            unknown = (3 * group.connectivity[:, :, None] + np.arange(3)).reshape(
                len(group.connectivity), -1
            )
            np.add.at(
                matrix, (unknown[:, :, None], unknown[:, None, :]), group.stiffness(x, rotation)
            )
        return matrix

    @cached_property
    def free(self) -> np.ndarray:
        """Unknowns that are not held, for a flattened (node, 3) field."""
        held = np.zeros(len(self.mesh.nodes), dtype=bool)
        held[self.mesh.node_sets["attachment"]] = True
        return np.flatnonzero(~np.repeat(held, 3))


def synthetic_part(cells: tuple[int, int, int] = (8, 4, 4)) -> SyntheticPart:
    """A box 112 x 24 x 16 mm of cubes split into tetrahedra, hollow inside, paper at z = 0.

    Args:
        cells: Cubes along x, y (even) and z; the cubes not at the surface are left out.
    """
    count_x, count_y, count_z = cells
    low = np.array([-56.0, -12.0, 0.0])
    spacing = np.array([112.0 / count_x, 24.0 / count_y, 16.0 / count_z])
    shape = (count_x + 1, count_y + 1, count_z + 1)

    def number(i, j, k):
        return (i * shape[1] + j) * shape[2] + k

    def mirrored(node):
        i, rest = divmod(node, shape[1] * shape[2])
        j, k = divmod(rest, shape[2])
        return number(i, count_y - j, k)

    half: list[tuple[int, ...]] = []
    for i, j, k in itertools.product(range(count_x), range(count_y // 2), range(count_z)):
        inside_x, inside_z = 0 < i < count_x - 1, 0 < k < count_z - 1
        if inside_x and inside_z and j > 0:
            continue
        for order in itertools.permutations(range(3)):  # Kuhn's six tetrahedra of a cube
            corner = np.zeros(3, dtype=int)
            path = [corner.copy()]
            for axis in order:
                corner[axis] += 1
                path.append(corner.copy())
            tetrahedron = [number(i + a, j + b, k + c) for a, b, c in path]
            if round(np.linalg.det(np.diff(np.array(path), axis=0))) < 0:
                tetrahedron[0], tetrahedron[1] = tetrahedron[1], tetrahedron[0]
            half.append(tuple(tetrahedron))
    # Swapping the ends of the first edge keeps the orientation positive in the mirror image and
    # leaves the edge-based rotation the mirrored one.
    other = [(mirrored(b), mirrored(a), mirrored(c), mirrored(d)) for a, b, c, d in half]
    tetrahedra = np.array(half + other)

    grid = np.array(list(itertools.product(*(range(n) for n in shape))))
    used, compact = np.unique(tetrahedra, return_inverse=True)
    tetrahedra = compact.reshape(tetrahedra.shape).astype(np.int32)
    nodes = low + grid[used] * spacing
    mirror_nodes = np.searchsorted(used, [mirrored(int(node)) for node in used]).astype(np.int32)

    faces = np.concatenate(
        [tetrahedra[:, order] for order in ([0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2])]
    )
    _, first, occurrence = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    boundary = faces[first[occurrence == 1]]  # normals out of the solid
    high = low + spacing * np.array(cells)
    flat = [
        np.all(np.abs(nodes[boundary][:, :, axis] - bound[axis]) < 1e-9, axis=1)
        for axis in range(3)
        for bound in (low, high)
    ]
    outer = np.any(flat, axis=0)
    bottom = boundary[flat[4]]
    left = bottom[nodes[bottom][:, :, 1].mean(axis=1) < 0.0]
    paper = np.concatenate([left, mirror_nodes[left][:, [1, 0, 2]]])
    at = {tuple(node): index for index, node in enumerate(np.round(nodes, 6))}
    attachment = [at[(low[0], y, z)] for y in (low[1], high[1]) for z in (low[2], high[2])]
    mesh = SyntheticMesh(
        nodes=nodes,
        tetrahedra=tetrahedra,
        surfaces={"cavity": boundary[~outer][:, ::-1], "skin": boundary[outer], "paper": paper},
        node_sets={
            "attachment": np.array(attachment),
            "outer_end_face": np.flatnonzero(nodes[:, 0] > high[0] - 1e-9),
        },
        contact_points=np.array(list(itertools.product((-56.0, 0.0, 56.0), (-12.0, 12.0), (0.0,)))),
        mirror_nodes=mirror_nodes,
    )
    return SyntheticPart(
        mesh=mesh,
        node_mass=np.full(len(nodes), 0.105 / len(nodes)),
        element_groups=(
            SyntheticGroup.build(nodes, tetrahedra, 1160.0, 0.2),
            SyntheticGroup.build(nodes, paper, 2320.0, 0.49, thickness=1.0),
        ),
    )


def vibration_modes(part: SyntheticPart, mode_count: int) -> np.ndarray:
    """The softest vibration modes held at the attachment, mass-orthonormal, (node, 3, mode)."""
    free = part.free
    mass = np.repeat(part.node_mass, 3)[free]
    stiffness = part.stiffness(part.mesh.nodes)[np.ix_(free, free)]
    scaled = stiffness / np.sqrt(mass[:, None] * mass[None, :])
    _, vectors = np.linalg.eigh(scaled)
    modes = np.zeros((part.mesh.nodes.size, mode_count))
    modes[free] = vectors[:, :mode_count] / np.sqrt(mass)[:, None]
    return modes.reshape(*part.mesh.nodes.shape, mode_count)


def synthetic_reduced_part(mode_count: int = 6, cells=(8, 4, 4)) -> ReducedPart:
    """The unsampled reduced part of `synthetic_part` on its vibration modes."""
    part = synthetic_part(cells)
    return assemble_reduced_part(part, vibration_modes(part, mode_count))


def synthetic_model(cells: tuple[int, int, int] = (8, 4, 4)) -> PartModel:
    """The same part as the package's own finite elements."""
    mesh = synthetic_part(cells).mesh
    paper = Membrane("paper", Material(2320.0, 0.49), 1.0)
    return PartModel(Mesh(**vars(mesh)), Material(1160.0, 0.2), 0.105, (paper,), cavity="cavity")
