"""Pressures beyond those that a robot's legs were reduced from."""

from __future__ import annotations

from pneumorph.catalogue.robot_spec import RobotSpec

_NEAR = 1.05
"""Times the highest pressure of the snapshots from which on it is told."""


def unseen_pressure_note(spec: RobotSpec, largest_kPa: float) -> str | None:
    """What to say before reduced legs are inflated further than in any of their snapshots; None
    where they are not.

    Args:
        spec: The robot.
        largest_kPa: Highest real pressure of what walks [kPa].
    """
    simulated_kPa = float(spec.physics.pressure_map.simulated(largest_kPa))
    for module in spec.modules:
        bend = module.reduced.describe(module.name).bend or {}
        seen_kPa = max(bend.get("pressure_kPa") or [0.0])
        if 0.0 < seen_kPa * _NEAR < simulated_kPa:
            return (
                f"legs are inflated to {simulated_kPa:.4g} kPa, {module.name} has snapshots up to "
                f"{seen_kPa:.4g}: it extrapolates beyond; ask for lower pressures "
                "(--expert.amplitude-kPa of a walk, half of its highest; of a training "
                "--task.maximum-pressure-kPa and --baseline.gait.amplitude-kPa), or reduce it with "
                "a higher --largest-pressure-kPa"
            )
    return None
