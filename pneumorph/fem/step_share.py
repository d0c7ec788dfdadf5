"""How much of a Newton step to take: where the step's energy is least along it.

Implicit Euler's end is a minimum of kinetic, elastic and potential energy and of what friction
dissipates, over all motions that the floor allows (Kane, Marsden, Ortiz and West, Int. J. Numer.
Meth. Eng. 49 (2000) 1295). So the slope of that energy along a Newton step decides: what is
unbalanced times the step's velocities. The floor's normal impulses do no work between motions that
it allows; a point that the last trial left below the floor is lifted against its impulse (the exact
penalty of Han, J. Optim. Theory Appl. 22 (1977) 297). Where the slope is still downhill at the
step's end, all of the step is taken; where it has become uphill, what lies before the lowest point:
a stiff sheet that turns is stretched by the square of a step, and that outweighs all that the step
has gained.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Generic

import numpy as np
from scipy.optimize import brentq

from pneumorph.fem.contact_points import Contacts
from pneumorph.fem.hub_body import HubState
from pneumorph.fem.robot_body import RobotBody
from pneumorph.fem.trial_step import TrialStep

UPHILL = 0.5
"""All of a step is taken whose end is at most this many times as steep as its start."""
ACCURACY = 0.02
"""How closely the share is found."""
_STEEPEST = 1e9
"""What is steeper than the start by more, or not finite, counts as this."""
_BEFORE_THE_END = 1.0 - 1e-6
"""Where a point comes to stick at the step's end, friction is taken as just before."""


class EnergyAlong(Generic[HubState]):
    """The slope of a step's energy along the way from a trial to the next.

    Args:
        robot: The robot.
        contacts: The floor, linearised at the first trial.
        first: Where the way begins.
        second: Where it ends.
        friction: Coefficient at each of the robot's contact points, (contact,).
        time_step_s: Length of the step [s].
    """

    def __init__(
        self,
        robot: RobotBody[HubState],
        contacts: Contacts,
        first: TrialStep[HubState],
        second: TrialStep[HubState],
        friction: np.ndarray,
        time_step_s: float,
    ) -> None:
        self._robot, self._contacts, self._first, self._second = robot, contacts, first, second
        numbers = robot.contact_numbers(contacts.points)
        start, end = self._contact_velocities(first), self._contact_velocities(second)
        self._sliding = start[:, 1:], end[:, 1:]
        self._standing = robot.numerics.contact_tolerance_mm_per_s
        self._holding = friction[numbers] * second.impulses[numbers, 0]
        gap_speeds = contacts.gaps / time_step_s
        self._above = start[:, 0] + gap_speeds, end[:, 0] + gap_speeds
        pressed = second.impulses[numbers, 0]
        self._stays_down = pressed > 0.0
        self._pressed = np.maximum(first.impulses[numbers, 0], pressed)

    def slope(
        self,
        share: float,
        at: TrialStep[HubState],
        hub_equations: tuple[np.ndarray, np.ndarray],
        residuals: Sequence[np.ndarray],
    ) -> float:
        """Slope at a trial on the way [mN mm].

        Args:
            share: How far it is on the way.
            at: The trial.
            hub_equations: A and b of the hub, linearised there.
            residuals: r of each leg there [mN s], each (3 node,).
        """
        hub, first, second = self._robot.hub, self._first, self._second
        matrix, right = hub_equations
        turned = second.hub.velocity - first.hub.velocity
        slope = float((matrix @ at.hub.velocity - right) @ turned)
        for leg, residual, a, b in zip(
            self._robot.legs, residuals, first.velocities, second.velocities, strict=True
        ):
            change = b - a
            carried = hub.point_map(at.hub, leg.attachment_in_hub) @ turned
            change[leg.tie.nodes] = leg.tie.spread(carried.reshape(-1, 3))
            slope += float(residual @ change.ravel())
        return slope + self._friction_slope(share) - self._lifting_slope(share)

    def _friction_slope(self, share: float) -> float:
        start, end = self._sliding
        sliding = start + min(share, _BEFORE_THE_END) * (end - start)
        speed = np.maximum(np.linalg.norm(sliding, axis=1), self._standing)
        return float(self._holding @ (np.sum(sliding * (end - start), axis=1) / speed))

    def _lifting_slope(self, share: float) -> float:
        """Of points below the floor, up to where the way brings them out of it."""
        start, end = self._above
        below = (start < -self._standing) & (
            self._stays_down | (start + share * (end - start) < 0.0)
        )
        return float(self._pressed[below] @ (end - start)[below])

    def _contact_velocities(self, trial: TrialStep[HubState]) -> np.ndarray:
        """Along normal, tangent, tangent [mm/s], (contact, 3)."""
        velocities = self._robot.contact_velocities(trial)
        each = zip(self._contacts.frames, velocities, self._contacts.points, strict=True)
        return np.concatenate(
            [np.einsum("pra,pa->pr", frames, v[points]) for frames, v, points in each]
        )


def share_of_step(slope: Callable[[float], float]) -> float:
    """Share of a step to take, (0, 1].

    Args:
        slope: Slope of the energy along the step at a share of it; not finite is uphill.
    """
    ends = {0.0: slope(0.0), 1.0: slope(1.0)}
    if not ends[0.0] < 0.0:
        return 1.0
    highest = -_STEEPEST * ends[0.0]

    def bounded(share: float) -> float:
        value = ends[share] if share in ends else slope(share)
        return value if value < highest else highest  # NaN compares false

    if bounded(1.0) <= -UPHILL * ends[0.0]:
        return 1.0
    lowest = brentq(bounded, 0.0, 1.0, xtol=ACCURACY, rtol=ACCURACY, disp=False)
    return max(float(lowest), ACCURACY)
