"""Reductions in the text files of SOFA's ModelOrderReduction plugin.

All are written as ``rows columns`` on the first line and the rows below:

- modes: three rows a node (x, y, z), a column a mode;
- ``..._RID.txt``: numbers of the sampled elements, one column;
- ``..._weight.txt``: a weight for every element of the mesh, zero where it is not sampled.

The plugin's modes are fixed in the world and may hold rigid motions; ours are in the frame of the
hub and, there, move the attachment only as far as the mount gives way (docs/physics.md), so reading
takes rigid motions out. The files have no place for the mount's stiffness: modes are written in the
basis that makes it diagonal, and the scene has a spring for each (`mounted_modes`).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import read_text, write_text
from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.assemble import Cubature, assemble_reduced_part
from pneumorph.reduction.reduced_part import ReducedPart

MODES_FILE = "modes.txt"

SMALLEST_MODE = 1e-6
"""A combination of modes that is this small beside the largest is none of its own."""


@dataclass(frozen=True, eq=False)
class SofaReduction:
    """What the plugin's files of one part hold.

    Attributes:
        modes: Displacements, (node, 3, mode).
        weights: Weight of every element of each force field, by the file's name.
    """

    modes: np.ndarray
    weights: dict[str, np.ndarray]


def write_table(path: Path, table: np.ndarray) -> Path:
    """Write a table (row, column) as the plugin reads it."""
    whole = np.issubdtype(table.dtype, np.integer)
    rows = table if table.ndim == 2 else table[:, None]
    lines = [f"{rows.shape[0]} {rows.shape[1]}"]
    lines += [" ".join(str(v) if whole else f"{v:.9g}" for v in row) for row in rows]
    text = "\n".join(lines) + "\n"
    return write_text(path, text)


def read_table(path: Path) -> np.ndarray:
    """Read a table, (row, column).

    Raises:
        FileNotFoundError: No such file.
        ValueError: Not a table, or of another size than its first line says.
    """
    first, _, rest = read_text(path, "table").strip().partition("\n")
    try:
        row_count, column_count = (int(text) for text in first.split())
        values = np.array(rest.split(), dtype=float)
        return values.reshape(row_count, column_count)
    except ValueError as error:
        raise ValueError(
            f"{path} begins {first[:40]!r} and cannot be read as a table of that many rows and "
            f"columns ({error}); it is truncated or no file of ModelOrderReduction"
        ) from error


def mounted_modes(part: ReducedPart) -> tuple[np.ndarray, np.ndarray]:
    """Modes of a part turned among themselves until its mount's stiffness is diagonal.

    Returns:
        Modes, still orthonormal in mass, (node, 3, mode), and the stiffness of each [s^-2],
        (mode,); a part with a rigid mount has its own modes and zeros.
    """
    if not part.linear_stiffness.any():
        return part.modes, np.zeros(part.mode_count)
    stiffness, turn = np.linalg.eigh(part.linear_stiffness)
    return part.modes @ turn, np.maximum(stiffness, 0.0)


def write_sofa_reduction(folder: Path, part: ReducedPart, element_counts: dict[str, int]) -> None:
    """Write the files of a part into a folder.

    Args:
        folder: Where to write.
        part: The reduced part.
        element_counts: Elements of the whole mesh: ``tetrahedra`` and ``membrane``.

    Raises:
        ValueError: The part's elements are not the plugin's, linear and corotational.
    """
    if part.tetrahedron_material.law != "corotational":
        raise ValueError(
            f"the part's law is {part.tetrahedron_material.law!r}, expected 'corotational': SOFA's "
            "force fields of the scene know no other"
        )
    if len(part.stretch_1) > 0:
        raise ValueError(
            f"the part's membrane is seen by {len(part.stretch_1)} fields of stress, expected "
            "sampled triangles: SOFA's force fields of the scene know no other"
        )
    write_table(folder / MODES_FILE, mounted_modes(part)[0].reshape(-1, part.mode_count))
    sampled = {
        "tetrahedra": (part.tetrahedron_index, part.tetrahedron_weight),
        "membrane": (part.membrane_index, part.membrane_weight),
    }
    for name, (index, weight) in sampled.items():
        every = np.zeros(element_counts[name])
        every[index] = weight
        write_table(folder / f"{name}_RID.txt", index.astype(np.int64))
        write_table(folder / f"{name}_weight.txt", every)


def read_sofa_reduction(folder: Path) -> SofaReduction:
    """Read the files of a folder; they may lie in its ``data`` as the plugin leaves them.

    Raises:
        FileNotFoundError: No modes or no weights.
        ValueError: A file cannot be read, or a weight is negative.
    """
    place = folder if (folder / MODES_FILE).exists() else folder / "data"
    table = read_table(place / MODES_FILE)
    if table.shape[0] % 3:
        raise ValueError(
            f"{place / MODES_FILE} has {table.shape[0]} rows, expected three for each node"
        )
    weights = {}
    for path in sorted(place.glob("*_weight.txt")):
        weight = read_table(path)[:, 0]
        if np.any(weight < 0.0):
            raise ValueError(f"{path} has a negative weight: the part would be unstable")
        weights[path.name.removesuffix("_weight.txt")] = weight
    if not weights:
        raise FileNotFoundError(f"{place} holds no ..._weight.txt, expected one a force field")
    return SofaReduction(table.reshape(-1, 3, table.shape[1]), weights)


def reduced_part_of(reduction: SofaReduction, model: PartModel) -> ReducedPart:
    """Build the reduced part that a reduction stands for.

    Each force field is recognised by its number of elements.

    Args:
        reduction: The plugin's files.
        model: Finite elements of the part, with the mesh in the order that the reduction was made
            from.

    Returns:
        The part; its metadata say how far modes moved the attachment other than rigidly.

    Raises:
        ValueError: Another mesh, a force field without weights, or modes that tear the attachment.
    """
    mesh = model.mesh
    if len(reduction.modes) != len(mesh.nodes):
        raise ValueError(
            f"the modes are of {len(reduction.modes)} nodes, the mesh has {len(mesh.nodes)}: the "
            "reduction was made from another mesh"
        )
    cubatures = []
    for group in model.element_groups:
        count = len(group.connectivity)
        fitting = [name for name, w in reduction.weights.items() if len(w) == count]
        if len(fitting) != 1:
            sizes = {name: len(w) for name, w in reduction.weights.items()}
            raise ValueError(
                f"a force field of {count} elements fits {len(fitting)} of the weights "
                f"{sizes}, expected exactly 1; the reduction was made from another mesh"
            )
        cubatures.append(Cubature.from_weights(reduction.weights[fitting[0]]))
    modes, torn = in_hub_frame(reduction.modes, mesh.nodes, mesh.node_set("attachment"))
    if torn > 0.05:
        raise ValueError(
            f"the modes tear the attachment: {100 * torn:.1f} % of their motion there is not "
            "rigid, expected 5 % or less; the part was attached elsewhere"
        )
    return assemble_reduced_part(
        model,
        _orthonormal(modes, model.node_mass),
        tuple(cubatures),
        metadata={"source": "ModelOrderReduction", "torn_attachment": torn},
    )


def in_hub_frame(
    modes: np.ndarray, nodes: np.ndarray, attachment: np.ndarray
) -> tuple[np.ndarray, float]:
    """Take out of each mode the rigid motion of the attachment.

    Args:
        modes: Displacements, (node, 3, mode).
        nodes: Rest positions [mm], (node, 3).
        attachment: Nodes of the attachment, (n,).

    Returns:
        Modes that vanish at the attachment, and the largest share of a mode's motion there that was
        not rigid and is set to zero, relative to the mode's largest motion.
    """
    arms = nodes - nodes[attachment].mean(axis=0)
    skew = np.zeros((len(nodes), 3, 3))
    skew[:, 0, 1], skew[:, 0, 2] = arms[:, 2], -arms[:, 1]
    skew[:, 1, 0], skew[:, 1, 2] = -arms[:, 2], arms[:, 0]
    skew[:, 2, 0], skew[:, 2, 1] = arms[:, 1], -arms[:, 0]
    # Displacement of every node by a translation and a small turn, (node, 3, 6).
    rigid = np.concatenate([np.broadcast_to(np.eye(3), (len(nodes), 3, 3)), skew], axis=2)
    at = rigid[attachment].reshape(-1, 6)
    motion, *_ = np.linalg.lstsq(at, modes[attachment].reshape(-1, modes.shape[2]), rcond=None)
    left: np.ndarray = modes - rigid @ motion
    size = np.abs(modes).max(axis=(0, 1))
    torn = np.abs(left[attachment]).max(axis=(0, 1)) / np.where(size > 0.0, size, 1.0)
    left[attachment] = 0.0
    return left, float(torn.max())


def _orthonormal(modes: np.ndarray, node_mass: np.ndarray) -> np.ndarray:
    """Modes of the same span that are orthonormal in mass and nearest to the given ones.

    Symmetric orthonormalisation, Phi (Phi^T M Phi)^(-1/2) (Loewdin 1950); combinations that vanish,
    such as rigid motions, are left out.
    """
    flat = modes.reshape(-1, modes.shape[2])
    weighted = np.repeat(np.sqrt(node_mass), 3)[:, None] * flat
    left, sizes, right = np.linalg.svd(weighted, full_matrices=False)
    kept = sizes > SMALLEST_MODE * sizes[0]
    orthonormal = left @ right if kept.all() else left[:, kept]
    result: np.ndarray = orthonormal / np.repeat(np.sqrt(node_mass), 3)[:, None]
    return result.reshape(*modes.shape[:2], -1)
