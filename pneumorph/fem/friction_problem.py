"""Unilateral contact with Coulomb friction at many points: the law as equations, and solvers.

The points' velocities are u = W lambda + q, rows normal, tangent, tangent; impulses lambda obey

    0 <= u_n  perp  lambda_n >= 0,   |lambda_t| <= mu lambda_n,
    u_t = 0  or  lambda_t = -mu lambda_n u_t / |u_t|.

With any positive rho this is lambda = P(lambda - u / rho), P the projection on lambda_n >= 0 and
then on the disc of radius mu lambda_n (Alart and Curnier 1991, in the form of Jean and Moreau). The
equations are piecewise smooth. Each Newton step solves, for the points now pressed,

    u_n = 0,   sticking:  u_t = 0,
    slipping:  lambda_t - mu lambda_n e - s (I - e e^T) (lambda_t - u_t / rho) = 0,

with e the direction of lambda_t - u_t / rho and s the radius over its length, and sets
the impulses of all other points to zero. The law is not regularised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgesv

NEWTON_STEPS = 30
"""Most Newton steps of one attempt; real steps of a walking robot need 6 at the median."""
HALVINGS = 8
"""Most halvings of a Newton step."""
MEMORY = 5
"""A step must improve on the worst of so many last iterates: going through a kink of the law the
residual has to rise for a moment (Grippo, Lampariello and Lucidi 1986)."""
PROXIMAL = 1e-10
"""Share of W's diagonal that pulls a Newton step to the last iterate. Where more points are pressed
than the body has freedoms W is singular, and their impulses are determined in sum only; the pull
picks impulses near the last ones and vanishes as the iteration converges."""


@dataclass(frozen=True, eq=False)
class FrictionSolution:
    """Impulses of the contacts and how well they obey the law."""

    impulses: np.ndarray
    """Normal, tangent, tangent [mN s], (contact, 3); always within the cone."""
    velocities: np.ndarray
    """Velocities u of the contacts, in the same rows [mm/s], (contact, 3)."""
    residual: float
    """Largest velocity by which a contact violates its law [mm/s]."""


@dataclass(frozen=True, eq=False)
class _Iterate:
    impulse: np.ndarray  # (contact, 3)
    violation: np.ndarray  # rho (lambda - P(lambda - u / rho)) [mm/s], (contact, 3)
    normal: np.ndarray  # lambda_n - u_n / rho, (contact,)
    tangent: np.ndarray  # lambda_t - u_t / rho, (contact, 2)
    length: np.ndarray  # its length, (contact,)
    velocity: np.ndarray  # (contact, 3)

    @property
    def merit(self) -> float:
        return float(np.vdot(self.violation, self.violation))

    @property
    def residual(self) -> float:
        normal, tangent = np.abs(self.violation[:, 0]), self.violation[:, 1:]
        return float(max(normal.max(), np.hypot(tangent[:, 0], tangent[:, 1]).max()))


class FrictionProblem:
    """Contacts coupled by a dense operator.

    Args:
        operator: The Delassus operator W [1/kg], symmetric, (3 contact, 3 contact).
        free: Velocities q without impulses, gap over time step included [mm/s], (3 contact,).
        friction: Coulomb's coefficient mu.
    """

    def __init__(self, operator: np.ndarray, free: np.ndarray, friction: float) -> None:
        self.operator: np.ndarray = np.ascontiguousarray(operator)
        self.free, self.friction = free, friction
        normal = 3 * np.arange(len(free) // 3)
        xx, yy = operator[normal + 1, normal + 1], operator[normal + 2, normal + 2]
        xy = operator[normal + 1, normal + 2]
        largest = 0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)
        self._scale = np.stack([operator[normal, normal], largest, largest], axis=1)  # rho

    def solution(self, impulses: np.ndarray) -> FrictionSolution:
        """Return impulses (contact, 3), put into the cone, with their velocities and residual."""
        inside = self._projection(impulses)
        iterate = self._iterate(inside)
        return FrictionSolution(inside, iterate.velocity, iterate.residual)

    def sweep(self, start: np.ndarray, tolerance: float, sweep_count: int) -> np.ndarray:
        """Return impulses after projected Gauss-Seidel sweeps from a start, (contact, 3).

        Args:
            start: Impulses to start from [mN s], (contact, 3).
            tolerance: Stop when a sweep removes no larger violation than this [mm/s].
            sweep_count: Most sweeps.
        """
        import pneumorph._engine as engine

        impulses, _, _ = engine.solve_friction_contacts(
            self.operator,
            self.free,
            self.friction,
            np.ascontiguousarray(start.ravel()),
            tolerance,
            sweep_count,
        )
        swept: np.ndarray = impulses.reshape(-1, 3)
        return swept

    def newton(self, start: np.ndarray, tolerance: float) -> np.ndarray:
        """Return the best impulses that Newton's method finds from a start, (contact, 3).

        Args:
            start: Impulses to start from [mN s], (contact, 3).
            tolerance: Stop when no law is violated by more than this [mm/s].
        """
        now = best = self._iterate(start)
        merits = [now.merit]
        for _ in range(NEWTON_STEPS):
            if now.residual <= tolerance:
                break
            target = self._newton_target(now)
            if target is None:
                break
            step = target - now.impulse
            trials = []
            for halving in range(HALVINGS + 1):
                trials.append(self._iterate(now.impulse + 0.5**halving * step))
                if trials[-1].merit < max(merits[-MEMORY:]):
                    break
            now = min(trials, key=lambda trial: trial.merit)
            merits.append(now.merit)
            if now.residual < best.residual:
                best = now
        return best.impulse

    def _iterate(self, impulse: np.ndarray) -> _Iterate:
        velocity = (self.operator @ impulse.ravel() + self.free).reshape(-1, 3)
        predicted = impulse - velocity / self._scale
        violation = self._scale * (impulse - self._projection(predicted))
        normal, tangent = predicted[:, 0], predicted[:, 1:]
        length = np.hypot(tangent[:, 0], tangent[:, 1])
        return _Iterate(impulse, violation, normal, tangent, length, velocity)

    def _projection(self, impulse: np.ndarray) -> np.ndarray:
        """P: normals made non-negative, then tangents cut to the disc of their normal."""
        normal = np.maximum(impulse[:, 0], 0.0)
        length, limit = np.hypot(impulse[:, 1], impulse[:, 2]), self.friction * normal
        share = np.divide(limit, length, out=np.ones_like(length), where=length > limit)
        return np.column_stack([normal, impulse[:, 1:] * share[:, None]])

    def _newton_target(self, now: _Iterate) -> np.ndarray | None:
        """Solution of the equations linearised at an iterate; None where they are singular."""
        target = np.zeros_like(now.impulse)
        pressed = np.flatnonzero(now.normal > 0.0)
        count = len(pressed)
        if count == 0:
            return target
        unknowns = (3 * pressed[:, None] + np.arange(3)).ravel()
        matrix = self.operator[np.ix_(unknowns, unknowns)]
        pull = PROXIMAL * self._scale[pressed].ravel()
        matrix[np.diag_indices(3 * count)] += pull
        right = (pull * now.impulse[pressed].ravel() - self.free[unknowns]).reshape(count, 3)
        rows = matrix.reshape(count, 3, 3 * count)

        limit = self.friction * now.normal[pressed]
        slipping = np.flatnonzero(now.length[pressed] >= limit)
        points = pressed[slipping]
        length = np.maximum(now.length[points], 1e-300)  # no friction, no motion: 0 / 0
        along = now.tangent[points] / length[:, None]
        across = np.eye(2) - along[:, :, None] * along[:, None, :]
        across *= (limit[slipping] / length)[:, None, None]
        scale = self._scale[points, 1]
        tangential = np.einsum("pij,pjk->pik", across, rows[slipping, 1:])
        own = np.concatenate([-self.friction * along[:, :, None], np.eye(2) - across], axis=2)
        number = np.arange(len(slipping))
        for column in range(3):
            place = 3 * slipping + column
            tangential[number, :, place] += scale[:, None] * own[:, :, column]
        rows[slipping, 1:] = tangential
        right[slipping, 1:] = np.einsum("pij,pj->pi", across, right[slipping, 1:])
        _, _, solution, failed = dgesv(matrix, right.ravel())
        if failed or not np.all(np.isfinite(solution)):
            return None
        target[pressed] = solution.reshape(count, 3)
        return target
