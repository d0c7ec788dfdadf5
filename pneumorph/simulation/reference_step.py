"""One step of a reduced robot in dense NumPy: the specification of the compiled stepper.

    step: (state, command) -> state

Numbers in brackets are equations of docs/physics.md. Everything is a pure function of arrays. The
robot's unknowns are the hub's velocity V and turning rate W along the hub's axes, and the modal
rates of one mount after the other. Every step finds its stiffness afresh; what the engine does to
keep one, (25) and (26), is its own affair, as is all that makes it fast.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from pneumorph.fem.rigid_hub import rotation_of
from pneumorph.physics.physics import Physics
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.reduced_state import ReducedState
from pneumorph.simulation.reference_contact import (
    ROWS,
    FrictionLaw,
    contact_flexibility,
    contact_kinematics,
    solve_friction,
    turning_drift,
)
from pneumorph.simulation.reference_forces import (
    advanced_springs,
    elastic_forces,
    pressure_force,
    relaxing_forces,
)
from pneumorph.simulation.reference_mass import (
    hub_moments,
    mass_matrix,
    mount_moments,
    velocity_products,
    weight,
)
from pneumorph.simulation.robot_air import regulators_of
from pneumorph.simulation.stepper_settings import StepperSettings

DEPTH_MM = 0.01
"""How deep a step may leave a point in the floor before it is solved again [mm]."""
MOST_BENDS = 3
"""How often for that, at most."""
SMOOTH_CHANGE_MM = 0.3
"""Motion is smooth where rates change by less in a step, root mean square over a part's mass."""
CONTACT_PASSES = 10
"""How often it is solved at most, with those times when points joined."""


@dataclass(frozen=True, eq=False)
class StepSystem:
    """What (8) is made of, at the start of a step and without contact; all projected (Galerkin)."""

    mass: Float[np.ndarray, "unknown unknown"]
    """M of (19)."""
    stiffness: Float[np.ndarray, "unknown unknown"]
    """K of (15)."""
    relaxing_stiffness: Float[np.ndarray, "unknown unknown"]
    """That of the branches over the step, by (37)."""
    force: Float[np.ndarray, " unknown"]
    """f: elastic, relaxing, pressure, weight (20) and products of velocities (21)."""


def reference_step(
    robot: Robot,
    physics: Physics,
    state: ReducedState,
    command_kPa: Float[np.ndarray, " regulator"],
    friction_tolerance: float = 1e-10,
    margin_mm: float = StepperSettings.contact_margin_mm,
    rates_before: Float[np.ndarray, "mount mode"] | None = None,
) -> ReducedState:
    """Advance by one time step.

    Args:
        robot: The robot.
        physics: What acts on it.
        state: Where it is.
        command_kPa: Real pressure asked of each regulator [kPa].
        friction_tolerance: Largest residual (30) allowed [mm/s].
        margin_mm: Points that the motion before brings nearer to the floor than this take part
            from the start [mm]; others join where the step's impulses throw them into the floor.
        rates_before: Modal rates that the step before began with, by which steps that are
            linearised ahead tell smooth motion and where it leads; None linearises at the start,
            contact points too.

    Raises:
        ArithmeticError: No impulses were found that obey the contact law.
    """
    h, velocity = physics.time_step_s, unknowns_of(robot, state)
    # Regulators, (33) or (41), and (34).
    regulated = regulators_of(robot, physics).after(state.regulated, command_kPa, h)
    pressure = physics.pressure_map.simulated(regulated)
    # The step's equations (8) without impulses.
    leading = _leading(robot, physics, state, rates_before)
    system = step_system(robot, physics, state, pressure, leading)
    matrix, right = step_equations(system, velocity, physics)
    # Points that take part, and what they know of the rest of the robot, (27).
    modes = modes_of(robot, state)
    positions, jacobian = contact_kinematics(robot, state.position, state.rotation, modes)
    floor = physics.floor(robot.standing_points)
    speeds, normals = jacobian @ velocity, floor.frames(positions)[:, 0, ROWS]
    drift = np.zeros_like(positions)
    if rates_before is not None:
        drift = turning_drift(robot, state.rotation, modes, velocity, h)
    coming = floor.gap(positions) + h * np.minimum(_along(normals, speeds), 0.0)
    near = coming < margin_mm
    # Friction (28) of coefficients (42) on the planes (32) that touch the floor: below the points,
    # and below where they come to lie, if the floor bends on their way. Points that the impulses
    # throw into the floor take part as well.
    friction = physics.contact_friction(robot.contact_surfaces, state.impulses[:, 0])
    # Points give way beyond the modes, (47); tangents start from what the last impulses left.
    flexible = contact_flexibility(robot) / h**2
    left = flexible @ state.impulses * [0.0, 1.0, 1.0]
    impulses, under, bends = state.impulses, np.zeros_like(positions), 0
    for _ in range(CONTACT_PASSES):
        frames = floor.frames(positions + under)
        gaps = floor.gap(positions + under) - _along(frames[:, 0], under)
        rows = (frames[near][:, :, ROWS] @ jacobian[near]).reshape(-1, len(velocity))
        response = np.linalg.solve(matrix, np.column_stack([right, rows.T]))
        alone, answers = response[:, 0], response[:, 1:]
        free = rows @ alone + np.kron(gaps[near] / h, [1.0, 0.0, 0.0]) - left[near].ravel()
        free += np.einsum("pij,pj->pi", frames[near][:, :, ROWS], drift[near]).ravel()
        own = np.kron(flexible[np.ix_(near, near)], np.eye(3))
        law = FrictionLaw(rows @ answers + own, free, friction[near])
        found = solve_friction(law, impulses[near], friction_tolerance)
        impulses = np.eye(len(positions))[:, near] @ found
        new = alone + answers @ found.ravel()
        way = np.zeros_like(positions)
        way[:, ROWS] = h * (jacobian @ new)
        lift = h * (flexible @ impulses[:, 0])
        thrown = ~near & (gaps + _along(frames[:, 0], way) + lift < 0.0)
        if not thrown.any():
            deep = np.min(floor.gap(positions + way) + lift, initial=0.0) < -DEPTH_MM
            if not deep or bends == MOST_BENDS:
                break
            under, bends = way, bends + 1
        near = near | thrown
    # And on.
    moved = moved_state(robot, state, new, h)
    return replace(moved, regulated=regulated, impulses=impulses, memory=b"")


def step_system(
    robot: Robot,
    physics: Physics,
    state: ReducedState,
    pressure_kPa: Float[np.ndarray, " regulator"],
    leading: Float[np.ndarray, "mount mode"] | None = None,
) -> StepSystem:
    """Mass, stiffness and force of a robot, summed over the hub and the mounts.

    Args:
        robot: The robot.
        physics: What acts on it.
        state: Where it is.
        pressure_kPa: Simulated pressure of each regulator [kPa].
        leading: Modal rates by which each mount's forces are found ahead of its coordinates, (46);
            zero of one, or None, finds them at the start.
    """
    velocity, h = unknowns_of(robot, state), physics.time_step_s
    turning, gravity = velocity[3:6], state.rotation.T @ physics.gravity_vector
    hub = hub_moments(robot.hub)
    chosen = np.eye(6, len(velocity))  # the hub's unknowns among all
    mass = chosen.T @ mass_matrix(hub) @ chosen
    stiffness, relaxing = np.zeros((2, len(velocity), len(velocity)))
    force = (weight(hub, gravity) + velocity_products(hub, turning, np.zeros(0))) @ chosen
    first = 6
    parts = zip(robot.mounts, modes_of(robot, state), springs_of(robot, state), strict=True)
    for number, (mount, alpha, springs) in enumerate(parts):
        own = np.eye(len(alpha), len(velocity), first)
        body, to_all = mount_moments(mount, alpha), np.concatenate([chosen, own])
        led = np.zeros_like(alpha) if leading is None else h * leading[number, : len(alpha)]
        end = alpha + led
        elastic, stiff = elastic_forces(mount, end, physics.damping)
        relaxed, resisting = relaxing_forces(mount, alpha, end, springs, h)
        elastic = elastic + (stiff + resisting) @ np.pad(led, (6, 0))
        pressing = pressure_force(mount, end, pressure_kPa)
        moving = velocity_products(body, turning, own @ velocity)
        mass = mass + to_all.T @ mass_matrix(body) @ to_all
        stiffness = stiffness + to_all.T @ stiff @ to_all
        relaxing = relaxing + to_all.T @ resisting @ to_all
        force = force + (elastic + relaxed + pressing + weight(body, gravity) + moving) @ to_all
        first += len(alpha)
    return StepSystem(mass, stiffness, relaxing, force)


def _leading(
    robot: Robot, physics: Physics, state: ReducedState, rates_before: np.ndarray | None
) -> np.ndarray:
    """Modal rates of where each mount's step is linearised, (mount, mode): the mean of the last two
    where a part of silicone moves smoothly, and zero elsewhere."""
    damped = physics.damping == "published" or physics.stiffness_damping_s > 0.0
    if rates_before is None or damped:
        return np.zeros_like(state.mode_rates)
    changes = np.linalg.norm(state.mode_rates - rates_before, axis=1)
    allowed = SMOOTH_CHANGE_MM / physics.time_step_s
    masses = np.array([mount.part.mass for mount in robot.mounts])
    silicone = np.array([_is_silicone(mount.part) for mount in robot.mounts])
    smooth = silicone & (changes <= allowed * np.sqrt(masses))
    return np.where(smooth[:, None], 0.5 * (state.mode_rates + rates_before), 0.0)


def _is_silicone(part: ReducedPart) -> bool:
    """Whether a part has anything that parts of measured silicone alone have."""
    fields = len(part.dilatation_1) + len(part.stretch_1) + len(part.wall_axis)
    return part.tetrahedron_material.law == "yeoh" or part.relaxation is not None or fields > 0


def step_equations(
    system: StepSystem, velocity: Float[np.ndarray, " unknown"], physics: Physics
) -> tuple[Float[np.ndarray, "unknown unknown"], Float[np.ndarray, " unknown"]]:
    """Left matrix and right side of (8), with the branches and without impulses.

    Args:
        system: Mass, stiffness and force at the start.
        velocity: The unknowns at the start.
        physics: Time step and damping.
    """
    h = physics.time_step_s
    matrix = (1.0 + physics.mass_damping_per_s * h) * system.mass
    matrix = matrix + h * (h + physics.stiffness_damping_s) * system.stiffness
    matrix = matrix + h**2 * system.relaxing_stiffness
    return matrix, system.mass @ velocity + h * system.force


def moved_state(
    robot: Robot, state: ReducedState, velocity: Float[np.ndarray, " unknown"], time_step_s: float
) -> ReducedState:
    """The state after moving with new unknowns for a time step (24).

    Args:
        robot: The robot.
        state: Where it was.
        velocity: The new unknowns.
        time_step_s: Time step [s].
    """
    moving, turning = state.rotation @ velocity[:3], state.rotation @ velocity[3:6]
    ends = np.cumsum([6] + [mount.part.mode_count for mount in robot.mounts])
    width = state.modes.shape[1]
    rates = [
        np.pad(velocity[first:end], (0, width - (end - first))) for first, end in pairwise(ends)
    ]
    mode_rates = np.reshape(rates, state.modes.shape)
    new = replace(
        state,
        position=state.position + time_step_s * moving,
        rotation=rotation_of(time_step_s * turning) @ state.rotation,
        velocity=moving,
        angular_velocity=turning,
        modes=state.modes + time_step_s * mode_rates,
        mode_rates=mode_rates,
    )
    springs = state.springs.copy()
    for number, (mount, own, before, after) in enumerate(
        zip(
            robot.mounts,
            springs_of(robot, state),
            modes_of(robot, state),
            modes_of(robot, new),
            strict=True,
        )
    ):
        moved = advanced_springs(mount, own, before, after, time_step_s)
        springs[number, : moved.shape[0], : moved.shape[1]] = moved
    return replace(new, springs=springs)


def unknowns_of(robot: Robot, state: ReducedState) -> Float[np.ndarray, " unknown"]:
    """V and W along the hub's axes, then the modal rates of every mount."""
    hub = (state.velocity @ state.rotation, state.angular_velocity @ state.rotation)
    rates = zip(robot.mounts, state.mode_rates, strict=True)
    return np.concatenate([*hub, *(rate[: mount.part.mode_count] for mount, rate in rates)])


def modes_of(robot: Robot, state: ReducedState) -> tuple[np.ndarray, ...]:
    """Modal coordinates of every mount without the padding, each (mode,)."""
    modes = zip(robot.mounts, state.modes, strict=True)
    return tuple(alpha[: mount.part.mode_count] for mount, alpha in modes)


def springs_of(robot: Robot, state: ReducedState) -> tuple[np.ndarray, ...]:
    """Springs of every mount without the padding, each (branch, point, 6)."""
    springs = zip(robot.mounts, state.springs, strict=True)
    return tuple(
        own[: len(mount.part.relaxation_weight), : _relaxing_points(mount)]
        for mount, own in springs
    )


def _relaxing_points(mount: Mount) -> int:
    return 0 if mount.part.relaxation is None else len(mount.part.tetrahedron_measure)


def _along(normals: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """Products of the vectors of each point, (point,)."""
    return np.einsum("pi,pi->p", normals, ways)
