"""Elastic forces, stiffness and pressure of one mounted part of a reduced robot in NumPy.

Numbers in brackets are equations of docs/physics.md. Unknowns are the hub's velocity and turning
rate along the hub's axes and the modal rates, as in `reference_mass`.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pneumorph.physics.physics import Damping
from pneumorph.reduction.sampled_elements import SampledElements
from pneumorph.robot.robot import Mount

_COMPONENTS = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
"""Rows and columns of a symmetric matrix that its six components are."""


def elastic_forces(
    mount: Mount, alpha: Float[np.ndarray, " mode"], damping: Damping
) -> tuple[Float[np.ndarray, " 6+mode"], Float[np.ndarray, "6+mode 6+mode"]]:
    """Forces and the stiffness that a step takes, (15) with the turns' columns (22).

    Args:
        mount: The part and its pose.
        alpha: Modal coordinates.
        damping: With ``published`` the stiffness is that of (6), or the definite part of dP/dF by
            (16), and acts on turns of the hub; with ``objective`` it is that of (10) and acts on
            the modes alone.

    Returns:
        Force [mN, mm], and stiffness.
    """
    mounting = mount.part.linear_stiffness
    # Volumes of whole elements, a sheet seen by fields of stress, walls (45): all blind to turns.
    volumes, sheet, walls = mount.part.dilatation, mount.part.sheet, mount.part.walls
    whole = volumes.force(alpha) + sheet.force(alpha) + walls.force(alpha) - mounting @ alpha
    resisting = volumes.stiffness(alpha) + sheet.stiffness(alpha) + walls.stiffness(alpha)
    force, stiffness = np.pad(whole, (6, 0)), np.pad(resisting + mounting, (6, 0))
    for elements in (mount.part.tetrahedra, mount.part.membrane):
        gradient = elements.gradients(alpha)  # (14)
        if damping == "published":
            stress = elements.stress(gradient, "edge")
            tangent = elements.published_tangent(gradient, "edge")
            turning = _turns(mount, gradient)
        else:
            stress = elements.stress(gradient, "polar")
            tangent = elements.objective_tangent(gradient)
            turning = np.zeros((*gradient.shape, 3))
        columns = _columns(elements, turning)
        answers = tangent @ columns  # C dF
        flat = columns.reshape(-1, columns.shape[2])
        force = force - stress.ravel() @ flat
        stiffness = stiffness + flat.T @ answers.reshape(flat.shape)
    return force, stiffness


def relaxing_forces(
    mount: Mount,
    alpha: Float[np.ndarray, " mode"],
    end: Float[np.ndarray, " mode"],
    springs: Float[np.ndarray, "branch point 6"],
    step_s: float,
) -> tuple[Float[np.ndarray, " 6+mode"], Float[np.ndarray, "6+mode 6+mode"]]:
    """Forces of the branches at the end of a step (37), and their stiffness there.

    Both are blind to turns of the hub. A part that does not relax has none.

    Args:
        mount: The part and its pose.
        alpha: Modal coordinates at its start.
        end: Those at its end.
        springs: At the start of the step.
        step_s: h [s].

    Returns:
        Force [mN, mm], and stiffness, which h^2 acts on.
    """
    branches = mount.part.branches
    if branches is None:
        return np.zeros(6 + len(alpha)), np.zeros((6 + len(alpha),) * 2)
    moved = branches.advanced(matrices_of(springs), alpha, end, step_s)
    force = branches.force(moved, end)
    return np.pad(force, (6, 0)), np.pad(branches.stiffness(end, step_s), (6, 0))


def advanced_springs(
    mount: Mount,
    springs: Float[np.ndarray, "branch point 6"],
    before: Float[np.ndarray, " mode"],
    after: Float[np.ndarray, " mode"],
    step_s: float,
) -> Float[np.ndarray, "branch point 6"]:
    """Springs at the end of a step (37).

    Args:
        mount: The part and its pose.
        springs: At its start.
        before: Modal coordinates then.
        after: Modal coordinates at its end.
        step_s: h [s].
    """
    branches = mount.part.branches
    if branches is None:
        return springs
    moved = branches.advanced(matrices_of(springs), before, after, step_s)
    rows, columns = _COMPONENTS
    return moved[..., rows, columns]


def matrices_of(springs: np.ndarray) -> np.ndarray:
    """Q, (..., 3, 3), of its components 00, 11, 22, 01, 02, 12, (..., 6)."""
    matrices = np.empty((*springs.shape[:-1], 3, 3))
    rows, columns = _COMPONENTS
    matrices[..., rows, columns] = matrices[..., columns, rows] = springs
    return matrices


def pressure_force(
    mount: Mount, alpha: Float[np.ndarray, " mode"], pressure_kPa: Float[np.ndarray, " regulator"]
) -> Float[np.ndarray, " 6+mode"]:
    """Pressure's force (7) by the cavities' polynomials (17) [mN, mm].

    A closed cavity has neither resultant nor moment.

    Args:
        mount: The part, and the regulator of each cavity.
        alpha: Modal coordinates.
        pressure_kPa: Simulated pressure of each regulator [kPa].
    """
    each = [
        pressure_kPa[regulator] * mount.part.cavity(number).gradient(alpha)
        for number, regulator in enumerate(mount.regulators)
    ]
    return np.pad(np.sum([np.zeros_like(alpha), *each], axis=0), (6, 0))


def _turns(mount: Mount, gradient: np.ndarray) -> np.ndarray:
    """dF = e x F by turns about the hub's axes e, as the part sees them (22), (point, 3, d, 3)."""
    axes = mount.pose.rotation.T  # columns
    return np.stack([np.cross(axis, gradient, axisb=1, axisc=1) for axis in axes.T], axis=3)


def _columns(elements: SampledElements, turning: np.ndarray) -> np.ndarray:
    """dF of every unknown, (point, 3 d, 6 + mode); velocities of the hub deform nothing."""
    columns = np.concatenate([np.zeros_like(turning), turning, elements.mode_gradient], axis=3)
    return columns.reshape(len(columns), 3 * elements.dimension, columns.shape[3])
