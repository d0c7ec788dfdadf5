"""A crawler small enough for pencil and paper, to try tasks and learners without finite elements.

Massless legs shorten as they inflate and drag viscous feet over the floor. Leg ``i`` points along
angle ``a_i``; inflated to the fraction ``u_i`` of the highest pressure it has pulled its foot in
by ``stroke u_i``, and the foot grips with viscosity ``w_i = 1 + grip u_i``. No net force on the
robot, ``sum_i w_i (dx - stroke cos(a_i) du_i) = 0``, gives the forward travel

    dx = stroke sum_i w_i cos(a_i) du_i / sum_i w_i.

Hence what is known in advance: one regulator alone gets nowhere over a closed gait (Purcell's
scallop theorem), the travel does not depend on how fast the gait is walked, and two regulators
travel most by going round the square of their extreme pressures (Green's theorem: the integrand's
curl has one sign there).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.robot.design import Design


class ViscousCrawler:
    """A batch of viscous crawlers that answers the environment's simulator interface.

    Its robots are designs themselves: the robot builder is the identity.
    """

    def __init__(
        self,
        robots: Sequence[Design],
        time_step_s: float = 0.01,
        stroke_mm: float = 20.0,
        grip: float = 4.0,
        maximum_pressure_kPa: float = 90.0,
        pressure_rate_kPa_per_s: float = 150.0,
    ) -> None:
        """Build the batch.

        Args:
            robots: Design of each robot.
            time_step_s: Time step [s].
            stroke_mm: How far a full inflation pulls a foot in [mm].
            grip: Relative growth of a foot's viscosity at full inflation.
            maximum_pressure_kPa: Pressure of full inflation [kPa].
            pressure_rate_kPa_per_s: How fast a pressure follows its command [kPa/s].
        """
        self.time_step_s = time_step_s
        self._stroke_mm = stroke_mm
        self._grip = grip
        self._maximum_kPa = maximum_pressure_kPa
        self._step_kPa = pressure_rate_kPa_per_s * time_step_s
        self.set_robots(robots)

    def set_robots(self, robots: Sequence[Design]) -> None:
        """Replace every robot and reset all."""
        assignment = np.array([design.assignment for design in robots])
        self._has_leg = assignment > 0
        self._regulator = np.maximum(assignment - 1, 0)
        angles = [robots[0].angle_rad(location) for location in range(assignment.shape[1])]
        self._forward = np.cos(angles)
        self._pressure_kPa: np.ndarray | None = None
        self._forward_mm = np.zeros(len(robots))
        self._status = np.zeros(len(robots), dtype=np.uint8)

    def reset(self, active: np.ndarray | None = None) -> None:
        """Deflate robots and put them back to the origin; all, or those marked."""
        chosen = slice(None) if active is None else active
        if self._pressure_kPa is not None:
            self._pressure_kPa[chosen] = 0.0
        self._forward_mm[chosen] = 0.0
        self._status[chosen] = 0

    def advance(
        self, command_kPa: np.ndarray, step_count: int, active: np.ndarray | None = None
    ) -> None:
        """Advance all robots, or those marked, towards real pressures (robot, regulator) [kPa]."""
        command_kPa = np.asarray(command_kPa, dtype=np.float64)
        if self._pressure_kPa is None:
            self._pressure_kPa = np.zeros_like(command_kPa)
        if active is not None:
            command_kPa = np.where(active[:, None], command_kPa, self._pressure_kPa)
        reached_kPa = [self._pressure_kPa]
        for _ in range(step_count):
            change = np.clip(command_kPa - reached_kPa[-1], -self._step_kPa, self._step_kPa)
            if not change.any():
                break
            reached_kPa.append(reached_kPa[-1] + change)
        travel_mm = self._travel_mm(np.array(reached_kPa))
        # Step by step, so that bits depend neither on other robots nor on how steps are grouped.
        self._forward_mm = np.cumsum([self._forward_mm, *travel_mm], axis=0)[-1]
        self._pressure_kPa = reached_kPa[-1]

    def _travel_mm(self, pressure_kPa: np.ndarray) -> np.ndarray:
        """Travel of each step by the midpoint rule, shape (step, robot), while pressures go through
        those of (step + 1, robot, regulator)."""
        inflation = np.take_along_axis(pressure_kPa, self._regulator[None], axis=2)
        inflation /= self._maximum_kPa
        viscosity = self._has_leg * (1.0 + 0.5 * self._grip * (inflation[1:] + inflation[:-1]))
        pull = np.sum(viscosity * self._forward * np.diff(inflation, axis=0), axis=2)
        return self._stroke_mm * pull / viscosity.sum(axis=2)

    @property
    def forward_position_mm(self) -> np.ndarray:
        """Forward place of each robot [mm], shape (robot,)."""
        return self._forward_mm.copy()

    @property
    def status(self) -> np.ndarray:
        """Zero for every robot: a viscous crawler cannot fail. Shape (robot,) uint8."""
        return self._status.copy()


def viscous_crawler_robot(design: Design) -> Design:
    """Robot builder of `ViscousCrawler`: a design is its own robot."""
    return design
