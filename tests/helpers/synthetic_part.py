"""A small real part of few elements: a box with a cavity and a membrane on its bottom.

It is symmetric under y -> -y, and its elements come in mirror pairs e, e + E/2 with equal shape.
"""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
from scipy.sparse import diags_array
from scipy.sparse.linalg import eigsh

from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.silicones import silicone
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.reduced_part import ReducedPart


def synthetic_mesh(cells: tuple[int, int, int] = (8, 4, 4), wall: int | None = None) -> Mesh:
    """A box 112 x 24 x 16 mm of cubes split into tetrahedra, hollow inside, a sheet at z = 0.

    Args:
        cells: Cubes along x, y (even) and z; the cubes not at the surface are left out.
        wall: Place along x of cubes that stay, and part the hollow into ``cavity`` and
            ``cavity_outer``.
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
        if inside_x and inside_z and j > 0 and i != wall:
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
    sheet = np.concatenate([left, mirror_nodes[left][:, [1, 0, 2]]])
    hollow = boundary[~outer][:, ::-1]
    cavities = {"cavity": hollow}
    if wall is not None:
        beyond = nodes[hollow][:, :, 0].mean(axis=1) > low[0] + (wall + 0.5) * spacing[0]
        cavities = {"cavity": hollow[~beyond], "cavity_outer": hollow[beyond]}
    at = {tuple(node): index for index, node in enumerate(np.round(nodes, 6))}
    attachment = [at[(low[0], y, z)] for y in (low[1], high[1]) for z in (low[2], high[2])]
    return Mesh(
        nodes=nodes,
        tetrahedra=tetrahedra,
        surfaces={**cavities, "skin": boundary[outer], "sheet": sheet},
        node_sets={
            "attachment": np.array(attachment),
            "outer_end_face": np.flatnonzero(nodes[:, 0] > high[0] - 1e-9),
        },
        contact_points=np.array(list(itertools.product((-56.0, 0.0, 56.0), (-12.0, 12.0), (0.0,)))),
        mirror_nodes=mirror_nodes,
    )


def synthetic_part(
    cells: tuple[int, int, int] = (8, 4, 4), law: str = "corotational", quadratic: bool = False
) -> PartModel:
    """Finite elements of `synthetic_mesh`, of the paper's stiffness.

    Args:
        cells: As of the mesh.
        law: Of solid and membrane.
        quadratic: Whether elements have midside nodes.
    """
    mesh = synthetic_mesh(cells)
    sheet = Membrane("sheet", Material(2320.0, 0.49, law), 1.0)
    solid = Material(1160.0, 0.2, law)
    mesh = quadratic_mesh(mesh) if quadratic else mesh
    return PartModel(mesh, solid, 0.105, (sheet,), cavity="cavity")


def rubber_part(cells: tuple[int, int, int] = (4, 4, 4), order: str = "quadratic") -> PartModel:
    """The same mesh of a measured silicone: nearly incompressible, relaxing, on a stiff sheet.

    Args:
        cells: As of the mesh.
        order: ``linear`` or ``quadratic``.
    """
    mesh = synthetic_mesh(cells)
    mesh = quadratic_mesh(mesh) if order == "quadratic" else mesh
    sheet = Membrane("sheet", Material(2e4, 0.3, "st_venant_kirchhoff"), 0.1)
    rubber = silicone("Dragon Skin 30").material(bulk_over_shear=50.0)
    series = PronySeries((0.1, 0.2), (0.65, 0.02))
    return PartModel(mesh, rubber, 0.05, (sheet,), "cavity", "volume", series)


def vibration_modes(part: PartModel, mode_count: int) -> np.ndarray:
    """The softest vibration modes held at the attachment, mass-orthonormal, (node, 3, mode)."""
    held = np.zeros(part.node_count, dtype=bool)
    held[part.mesh.node_set("attachment")] = True
    free = np.flatnonzero(~np.repeat(held, 3))
    mass = np.repeat(part.node_mass, 3)[free]
    scale = diags_array(1.0 / np.sqrt(mass))
    scaled = scale @ part.stiffness(part.rest_nodes).tocsr()[free][:, free] @ scale
    values, vectors = eigsh(scaled.tocsc(), mode_count, sigma=0.0, v0=np.ones(len(free)))
    modes = np.zeros((3 * part.node_count, mode_count))
    modes[free] = scale @ vectors[:, np.argsort(values)]
    # The sign of an eigenvector is the processor's choice; these lift the nodes that come last.
    modes *= np.sign(np.arange(len(modes)) @ modes)
    return modes.reshape(part.node_count, 3, mode_count)


@cache
def synthetic_reduced_part(
    mode_count: int = 6, cells=(8, 4, 4), law: str = "corotational", quadratic: bool = False
) -> ReducedPart:
    """The unsampled reduced part of `synthetic_part` on its vibration modes."""
    part = synthetic_part(cells, law, quadratic)
    return assemble_reduced_part(part, vibration_modes(part, mode_count))


@cache
def rubber_reduced_part(
    mode_count: int = 6,
    cells=(4, 4, 4),
    order: str = "quadratic",
    pressures: int = 0,
    stretches: int = 0,
) -> ReducedPart:
    """The reduced part of `rubber_part` on its vibration modes, every point with its weight.

    Args:
        mode_count: Modes.
        cells: As of the mesh.
        order: ``linear`` or ``quadratic``.
        pressures: Fields of pressure, drawn at random; 0: every element's own.
        stretches: Fields of the sheet's stress, drawn at random; 0: its points.
    """
    part, fields, stresses = rubber_part(cells, order), None, None
    if pressures > 0:
        volume = part.volume_group.rest_volume
        drawn = np.random.default_rng(7).normal(size=(len(volume), pressures))
        fields = np.linalg.qr(drawn)[0] / np.sqrt(volume)[:, None]
    if stretches > 0:
        number = 3 * part.element_groups[1].element_count
        drawn = np.random.default_rng(8).normal(size=(number, stretches))
        stresses = np.linalg.qr(drawn)[0]
    modes = vibration_modes(part, mode_count)
    return assemble_reduced_part(part, modes, pressure_fields=fields, stress_fields=stresses)
