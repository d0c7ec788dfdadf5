"""What a trial end of a step leaves unbalanced, and how that turns with the hub."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.fem.contact_points import Contacts
from pneumorph.fem.hub_body import HubState
from pneumorph.fem.robot_body import RobotBody
from pneumorph.fem.trial_step import TrialStep


@dataclass(frozen=True, eq=False)
class TrialBalance:
    """The balance of impulses at a trial.

    Attributes:
        unbalanced: Norm of the impulses that are left [mN s].
        turning: What the hub's turning adds to the tangent of its equations, for each second that
            the step lasts, (unknown, unknown): what legs and floor press on it turns its arms.
            None where they do not turn.
    """

    unbalanced: float
    turning: np.ndarray | None


def trial_balance(
    robot: RobotBody[HubState],
    hub_equations: tuple[np.ndarray, np.ndarray],
    residuals: Sequence[np.ndarray],
    trial: TrialStep[HubState],
    contacts: Contacts,
) -> TrialBalance:
    """Add up what acts on legs and hub at a trial.

    Args:
        robot: The robot.
        hub_equations: A and b of the hub, linearised at the trial.
        residuals: r of each leg there [mN s], each (3 node,).
        trial: The trial.
        contacts: The floor, linearised at the trial.
    """
    hub = robot.hub
    matrix, right = hub_equations
    of_hub = matrix @ trial.hub.velocity - right
    impulses = _world_impulses(robot, trial, contacts)
    points, pushes = [hub.contact_points[contacts.points[-1]]], [impulses[-1]]
    of_hub -= hub.point_map(trial.hub, points[0]).T @ impulses[-1].ravel()
    squares = 0.0
    for leg, residual, active, impulse in zip(
        robot.legs, residuals, contacts.points, impulses, strict=False
    ):
        of_leg = residual.reshape(-1, 3) - leg.contact_weights[active].T @ impulse
        taken_up = leg.at_attachment(of_leg.ravel())
        of_hub += hub.point_map(trial.hub, leg.attachment_in_hub).T @ taken_up
        points.append(leg.attachment_in_hub)
        pushes.append(-taken_up.reshape(-1, 3))
        of_leg[leg.tie.nodes] = 0.0
        squares += float(np.vdot(of_leg, of_leg))
    unbalanced = float(np.sqrt(squares + hub.residual_size(of_hub) ** 2))
    turning = hub.turning_matrix(trial.hub, np.concatenate(points), np.concatenate(pushes))
    return TrialBalance(unbalanced, turning)


def _world_impulses(
    robot: RobotBody[HubState], trial: TrialStep[HubState], contacts: Contacts
) -> list[np.ndarray]:
    """Impulses on the points of each body along the world's axes, each (contact, 3)."""
    numbers = robot.contact_numbers_by_body(contacts.points)
    return [
        np.einsum("pra,pr->pa", frames, trial.impulses[chosen])
        for frames, chosen in zip(contacts.frames, numbers, strict=True)
    ]
