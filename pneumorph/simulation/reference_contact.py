"""Contact with Coulomb friction of a reduced robot in NumPy: where its points are, and the law.

Numbers in brackets are equations of docs/physics.md. Rows of a point are its normal and two
tangents: on a plane floor z, x, y.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag

from pneumorph.robot.robot import Robot

ROWS = [2, 0, 1]
"""World axes in the order of the rows of `contact_kinematics`: z, x, y."""
SWEEPS = (0, 100, 400, 1600)
"""Gauss-Seidel sweeps before each attempt of Newton's method."""
NEWTON_STEPS = 40
"""Most steps of one; walking robots need five on average."""
SHARES = 0.5 ** np.arange(8)
"""Parts of a Newton step, of which the best is taken."""
PULL = 1e-3, 1e-9
"""Share of the equations' diagonal that pulls a step to where it starts: at a residual of 1 mm/s
and more, and the least. Where points have more freedoms than the body W is singular; with the
pull impulses drift to where the law has a solution."""


@dataclass(frozen=True, eq=False)
class FrictionLaw:
    """Points coupled by an operator, and the law that they obey. Rows of a point: z, x, y."""

    operator: Float[np.ndarray, "row row"]
    """Delassus operator W of (27) [1/kg]."""
    free: Float[np.ndarray, " row"]
    """q of (27): velocities without impulses, gap over time step included [mm/s]."""
    friction: Float[np.ndarray, " point"]
    """Coulomb's coefficient mu of each, (42)."""

    @cached_property
    def scale(self) -> Float[np.ndarray, "point 3"]:
        """rho of (29) [1/kg]."""
        count = len(self.free) // 3
        number = np.arange(count)
        blocks = self.operator.reshape(count, 3, count, 3)[number, :, number]
        tangents = np.linalg.eigvalsh(blocks[:, 1:, 1:])[:, -1]
        return np.stack([blocks[:, 0, 0], tangents, tangents], axis=1)

    def predicted(self, impulses: Float[np.ndarray, "point 3"]) -> Float[np.ndarray, "point 3"]:
        """lambda - v / rho of (29) [mN s]."""
        velocity = (self.operator @ impulses.ravel() + self.free).reshape(-1, 3)
        return impulses - velocity / self.scale

    def violation(self, impulses: Float[np.ndarray, "point 3"]) -> Float[np.ndarray, "point 3"]:
        """What (29) leaves, times rho [mm/s]."""
        inside = projection(self.predicted(impulses), self.friction)
        wrong: np.ndarray = self.scale * (impulses - inside)
        return wrong

    def residual(self, impulses: Float[np.ndarray, "point 3"]) -> float:
        """r of (30), the largest among normals and tangents [mm/s]."""
        wrong = self.violation(impulses)
        tangents = np.linalg.norm(wrong[:, 1:], axis=1)
        return float(max(np.abs(wrong[:, 0]).max(initial=0.0), tangents.max(initial=0.0)))


def contact_kinematics(
    robot: Robot,
    position: Float[np.ndarray, " 3"],
    rotation: Float[np.ndarray, "3 3"],
    modes: tuple[np.ndarray, ...],
) -> tuple[Float[np.ndarray, "point 3"], Float[np.ndarray, "point 3 unknown"]]:
    """Where the contact points are by (11), and how they move by (18).

    Args:
        robot: The robot.
        position: Hub's origin in the world [mm].
        rotation: Hub frame to world.
        modes: Modal coordinates of each mount, each (mode,).

    Returns:
        World positions [mm], the hub's points first, and velocities by the unknowns in
        rows z, x, y: J.
    """
    counts = [len(alpha) for alpha in modes]
    arms, fields = _arms_and_fields(robot, modes)
    starts = np.concatenate([[0, 0], np.cumsum(counts)])
    jacobians = [
        _jacobian(arm, field, int(start), sum(counts))
        for arm, field, start in zip(arms, fields, starts, strict=False)
    ]
    positions = position + np.concatenate(arms) @ rotation.T
    return positions, np.einsum("ij,pja->pia", rotation[ROWS], np.concatenate(jacobians))


def turning_drift(
    robot: Robot,
    rotation: Float[np.ndarray, "3 3"],
    modes: tuple[np.ndarray, ...],
    velocity: Float[np.ndarray, " unknown"],
    time_step_s: float,
) -> Float[np.ndarray, "point 3"]:
    """What the hub's turning adds to the way of contact points in a step, over the step, (48).

    Args:
        robot: The robot.
        rotation: Hub frame to world.
        modes: Modal coordinates of each mount, each (mode,).
        velocity: The unknowns at the start.
        time_step_s: Time step [s].

    Returns:
        [mm/s], the hub's points first, in rows z, x, y.
    """
    arms, fields = _arms_and_fields(robot, modes)
    rates = np.split(velocity[6:], np.cumsum([0, *map(len, modes)]))[: len(arms)]
    bending = np.concatenate([field @ own for field, own in zip(fields, rates, strict=True)])
    turning = velocity[3:6]
    inward = np.cross(turning, np.cross(turning, np.concatenate(arms)) + 2.0 * bending)
    drift: np.ndarray = 0.5 * time_step_s * (inward @ rotation.T)[:, ROWS]
    return drift


def contact_flexibility(robot: Robot) -> Float[np.ndarray, "point point"]:
    """How far points give way beyond the modes under forces at others [mm/mN], the hub's first;
    points of different parts do not feel each other."""
    hub = np.zeros((len(robot.hub.contact_points),) * 2)
    blocks = [hub]
    for mount in robot.mounts:
        own, count = mount.part.contact_flexibility, len(mount.part.contact_points)
        blocks.append(own if len(own) > 0 else np.zeros((count, count)))
    flexibility: np.ndarray = block_diag(*blocks)
    return flexibility


def _arms_and_fields(
    robot: Robot, modes: tuple[np.ndarray, ...]
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Of the hub and of each mount where the contact points are from the hub's origin, (point, 3),
    and their modes, (point, 3, mode), both along the hub's axes."""
    arms, fields = [robot.hub.contact_points], [np.zeros((*robot.hub.contact_points.shape, 0))]
    for mount, alpha in zip(robot.mounts, modes, strict=True):
        part, turn = mount.part, mount.pose.rotation
        arms.append(mount.pose.apply(part.contact_points + part.contact_modes @ alpha))
        fields.append(np.einsum("ij,pja->pia", turn, part.contact_modes))
    return arms, fields


def _jacobian(arms: np.ndarray, fields: np.ndarray, start: int, count: int) -> np.ndarray:
    """Unknowns to V + W x y + Phi rate, with modes from a start on, (point, 3, 6 + count)."""
    moving = np.broadcast_to(np.eye(3), (len(arms), 3, 3))
    turning = np.stack([np.cross(axis, arms) for axis in np.eye(3)], axis=2)
    behind = count - start - fields.shape[2]
    padded = np.pad(fields, ((0, 0), (0, 0), (start, behind)))
    return np.concatenate([moving, turning, padded], axis=2)


def solve_friction(
    law: FrictionLaw, start: Float[np.ndarray, "point 3"], tolerance: float
) -> Float[np.ndarray, "point 3"]:
    """Impulses that obey the contact law (28), by Newton's method (31) on its equation (29).

    Where it fails, it starts again from where more and more Gauss-Seidel sweeps lead: (29) for one
    point after the other.

    Args:
        law: The contacts.
        start: Impulses to start from [mN s].
        tolerance: Largest residual (30) allowed [mm/s].

    Returns:
        Impulses within their cones [mN s]. Where W is singular, others give the same
        velocities.

    Raises:
        ArithmeticError: The residual is larger after the last attempt.
    """
    for sweeps in SWEEPS:
        for point in np.tile(np.arange(len(start)), sweeps):
            alone = np.arange(len(start))[:, None] == point
            start = np.where(alone, projection(law.predicted(start), law.friction), start)
        found = projection(_newton(law, start, tolerance), law.friction)
        if law.residual(found) <= tolerance:
            return found
    raise ArithmeticError(
        f"friction at {len(start)} points is violated by {law.residual(found):.3g} mm/s after "
        f"{len(SWEEPS)} attempts of Newton's method, expected {tolerance:g}; under a large mu "
        "there may be no solution"
    )


def _newton(law: FrictionLaw, impulses: np.ndarray, tolerance: float) -> np.ndarray:
    size = impulses.size
    for _ in range(NEWTON_STEPS):
        if law.residual(impulses) <= tolerance:
            break
        # d of the prediction is I - W / rho; a point's three rows of it go through dP.
        predicted = np.eye(size) - law.operator / law.scale.reshape(-1, 1)
        slope = projection_slope(law.predicted(impulses), law.friction)
        change = (slope @ predicted.reshape(-1, 3, size)).reshape(size, size)
        wrong = (law.violation(impulses) / law.scale).ravel()
        pull = max(PULL[0] * min(1.0, law.residual(impulses)), PULL[1])
        step = np.linalg.solve((1.0 + pull) * np.eye(size) - change, wrong).reshape(-1, 3)
        trials = [impulses - share * step for share in SHARES]
        impulses = min(trials, key=lambda trial: float(np.sum(law.violation(trial) ** 2)))
    return impulses


def projection(
    impulses: Float[np.ndarray, "point 3"], friction: Float[np.ndarray, " point"]
) -> Float[np.ndarray, "point 3"]:
    """P of (29): normals made non-negative, tangents cut to the disc of the normal."""
    normal = np.maximum(impulses[:, :1], 0.0)
    length = np.linalg.norm(impulses[:, 1:], axis=1, keepdims=True)
    limit = friction[:, None] * normal
    share = np.where(length > limit, limit / np.maximum(length, 1e-300), 1.0)
    return np.concatenate([normal, share * impulses[:, 1:]], axis=1)


def projection_slope(
    impulses: Float[np.ndarray, "point 3"], friction: Float[np.ndarray, " point"]
) -> Float[np.ndarray, "point 3 3"]:
    """dP by the impulses, where a point is free, sticks or slips as in (31)."""
    normal, tangent = impulses[:, 0], impulses[:, 1:]
    length = np.maximum(np.linalg.norm(tangent, axis=1), 1e-300)
    limit = friction * normal
    along = tangent / length[:, None]
    across = np.eye(2) - along[:, :, None] * along[:, None, :]
    rows = [(friction[:, None] * along)[:, :, None], (limit / length)[:, None, None] * across]
    first = np.broadcast_to([[1.0, 0.0, 0.0]], (len(normal), 1, 3))
    slipping = np.concatenate([first, np.concatenate(rows, axis=2)], axis=1)
    sticks, pressed = length < limit, normal > 0.0
    return np.where(sticks[:, None, None], np.eye(3), slipping) * pressed[:, None, None]
