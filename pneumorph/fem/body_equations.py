"""One time step's equations of the nodes of a body: A v = b + impulses from outside.

With M the mass, f(x) all forces but damping, K their negative derivative and D the stiffness that
damping acts on, the converged implicit Euler step of length h asks for v such that

    r(v) = (1 + alpha h) M v + h beta D v - M v_0 - h f(x) = impulses,   x = x_0 + h v.

Newton's method linearises it at a trial v_k: A = (1 + alpha h) M + h beta D + h^2 K and
b = A v_k - r. The linearly implicit step (Baraff and Witkin 1998; the paper's equation for dv) is
one such step from v_k = 0 in which K is D, without geometric and pressure terms.

D is that of the end, x, of objective damping, whose forces then have no moment there. Published
damping takes that of the start, x_0, in both steps: at a trial end, what only turns seems
stretched, and a stiff sheet's D would be of that stretch.

A solid that relaxes adds the force of its branches, which depends on the whole step: on what the
solid remembered at its start and on where it ends (`pneumorph.fem.maxwell_group`).
"""

from __future__ import annotations

import numpy as np

from pneumorph.fem.cavity import Pressure
from pneumorph.fem.compiled_elements import CompiledElements
from pneumorph.fem.maxwell_group import ViscousState
from pneumorph.fem.part_model import PartModel
from pneumorph.physics.physics import Physics


def linearly_implicit_equations(
    part: PartModel,
    x: np.ndarray,
    v: np.ndarray,
    pressure_kPa: Pressure,
    physics: Physics,
    memory: ViscousState | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """A = (1 + alpha h) M + h (h + beta) D and b = M v + h f, at the start of a step.

    Args:
        part: The body.
        x: World positions of the nodes [mm], (node, 3).
        v: Their velocities [mm/s], (node, 3).
        pressure_kPa: Pressure in the cavities, or of each [simulated kPa].
        physics: Time step and the rest.
        memory: What a solid that relaxes remembers at the start of the step.

    Returns:
        Data of A in the pattern of the part's assembly [kg], (entry,), and b [mN s], (3 node,).
    """
    data = physics.stiffness_factor * damped_stiffness_data(part, x, physics)
    data[part.assembly.diagonal] += physics.mass_factor * np.repeat(part.node_mass, 3)
    force = _force(part, x, pressure_kPa, physics)
    if memory is not None:
        force += _add_relaxation(data, part, memory, x, physics, definite=True)
    return data, (part.node_mass[:, None] * v + physics.time_step_s * force).ravel()


def implicit_equations(
    part: PartModel,
    start_velocity: np.ndarray,
    x: np.ndarray,
    v: np.ndarray,
    pressure_kPa: Pressure,
    physics: Physics,
    definite: bool,
    damped: np.ndarray | None,
    memory: ViscousState | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """A and b of the implicit Euler step linearised at a trial end of it.

    Args:
        part: The body.
        start_velocity: v_0, velocities at the start of the step [mm/s], (node, 3).
        x: World positions at the trial end [mm], (node, 3).
        v: Velocities that lead there [mm/s], (node, 3).
        pressure_kPa: Pressure in the cavities, or of each [simulated kPa].
        physics: Time step and the rest.
        definite: Make A positive definite at the price of a slower convergence.
        damped: `damping_data` of the step's start or of the trial, see `damps_by_its_start`.
        memory: What a solid that relaxes remembers at the start of the step.

    Returns:
        As `linearly_implicit_equations`; A v - b is the residual r(v).
    """
    if part.compiled is not None and not definite:
        compiled = implicit_matrix(part, x, pressure_kPa, physics, damped, memory)
        unbalanced = implicit_residual(
            part, start_velocity, x, v, pressure_kPa, physics, damped, memory
        )
        return compiled, part.assembly.matrix(compiled) @ v.ravel() - unbalanced
    h = physics.time_step_s
    mass = np.repeat(part.node_mass, 3)
    data = _inertia_and_damping(part, physics, damped)
    velocity = v.ravel()
    residual = part.assembly.matrix(data) @ velocity - mass * start_velocity.ravel()
    residual -= h * _force(part, x, pressure_kPa, physics).ravel()
    if memory is not None:
        residual -= h * _add_relaxation(data, part, memory, x, physics, definite).ravel()
    data += h**2 * part.tangent_data(x, pressure_kPa, physics.rotation, definite)
    return data, part.assembly.matrix(data) @ velocity - residual


def implicit_residual(
    part: PartModel,
    start_velocity: np.ndarray,
    x: np.ndarray,
    v: np.ndarray,
    pressure_kPa: Pressure,
    physics: Physics,
    damped: np.ndarray | None,
    memory: ViscousState | None = None,
) -> np.ndarray:
    """r(v) of the implicit Euler step at a trial end of it, without its matrix.

    Args:
        part: The body, whose elements the engine knows.
        start_velocity: v_0, velocities at the start of the step [mm/s], (node, 3).
        x: World positions at the trial end [mm], (node, 3).
        v: Velocities that lead there [mm/s], (node, 3).
        pressure_kPa: Pressure in the cavities, or of each [simulated kPa].
        physics: Time step and the rest.
        damped: `damping_data` of the step's start or of the trial, see `damps_by_its_start`.
        memory: What a solid that relaxes remembers at the start of the step.

    Returns:
        r [mN s], (3 node,).
    """
    elements, h = _elements(part), physics.time_step_s
    relaxing = elements.relaxing_stress(memory, h)
    force = elements.force(x, part.pressures_kPa(pressure_kPa), relaxing)
    force += part.node_mass[:, None] * physics.gravity_vector
    residual = part.node_mass[:, None] * (physics.mass_factor * v - start_velocity) - h * force
    if damped is not None:
        resistance = part.assembly.matrix(damped) @ v.ravel()
        residual += h * physics.stiffness_damping_s * resistance.reshape(-1, 3)
    return residual.ravel()


def implicit_matrix(
    part: PartModel,
    x: np.ndarray,
    pressure_kPa: Pressure,
    physics: Physics,
    damped: np.ndarray | None,
    memory: ViscousState | None = None,
    change: np.ndarray | None = None,
) -> np.ndarray:
    """A of `implicit_equations` without b, in the pattern of the part's assembly [kg], (entry,).

    Args:
        part: The body, whose elements the engine knows.
        x: World positions at the trial end [mm], (node, 3).
        pressure_kPa: Pressure in the cavities, or of each [simulated kPa].
        physics: Time step and the rest.
        damped: `damping_data` of the step's start or of the trial, see `damps_by_its_start`.
        memory: What a solid that relaxes remembers at the start of the step.
        change: A step that led there [mm], (node, 3): stiff stresses as it foresaw them.
    """
    elements, h = _elements(part), physics.time_step_s
    data = _inertia_and_damping(part, physics, damped)
    relaxing = elements.relaxing_stress(memory, h)
    elements.force_and_tangent(x, part.pressures_kPa(pressure_kPa), relaxing, data, h**2, change)
    return data


def _elements(part: PartModel) -> CompiledElements:
    assert part.compiled is not None, "asked for of parts whose elements the engine knows"
    return part.compiled


def _inertia_and_damping(
    part: PartModel, physics: Physics, damped: np.ndarray | None
) -> np.ndarray:
    """(1 + alpha h) M + h beta D."""
    factor = physics.time_step_s * physics.stiffness_damping_s
    data = np.zeros(len(part.assembly.indices)) if damped is None else factor * damped
    data[part.assembly.diagonal] += physics.mass_factor * np.repeat(part.node_mass, 3)
    return data


def damps_by_its_start(physics: Physics) -> bool:
    """Whether the stiffness that damps a step is that of its start, not of its end."""
    return physics.damping == "published"


def damping_data(part: PartModel, x: np.ndarray, physics: Physics) -> np.ndarray | None:
    """`damped_stiffness_data` of the implicit Euler step; None where stiffness damps nothing.

    Args:
        part: The body.
        x: World positions of the nodes [mm], (node, 3), see `damps_by_its_start`.
        physics: Which damping.
    """
    if physics.stiffness_damping_s == 0.0:
        return None
    return damped_stiffness_data(part, x, physics)


def damped_stiffness_data(part: PartModel, x: np.ndarray, physics: Physics) -> np.ndarray:
    """D, the stiffness that damping acts on, in the pattern of the part's assembly, (entry,).

    Args:
        part: The body.
        x: World positions of the nodes [mm], (node, 3).
        physics: Which damping.
    """
    if physics.damping == "published":
        return part.stiffness_data(x, physics.rotation)
    return part.objective_stiffness_data(x)


def _add_relaxation(
    data: np.ndarray,
    part: PartModel,
    memory: ViscousState,
    x: np.ndarray,
    physics: Physics,
    definite: bool,
) -> np.ndarray:
    """Add h^2 K of the branches to A in place; return their force at the step's end [mN]."""
    assert part.branches is not None, "memory is of a part that remembers"
    h = physics.time_step_s
    state = part.branches.advanced(memory, x, h)
    entries = part.branches.tangent_entries(state, x, h, definite)
    data += h**2 * part.assembly.symmetric_data([entries])
    return part.relaxing_force(state, x)


def _force(part: PartModel, x: np.ndarray, pressure_kPa: Pressure, physics: Physics) -> np.ndarray:
    """Elastic force, pressure and weight [mN], (node, 3)."""
    force = part.internal_force(x, physics.rotation)
    if np.any(pressure_kPa):
        force += part.pressure_force(x, pressure_kPa)
    force += part.node_mass[:, None] * physics.gravity_vector
    return force
