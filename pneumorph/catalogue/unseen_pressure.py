"""Pressures beyond those that a robot's legs were reduced from, or kept below the usual ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from pneumorph.catalogue.part_physics import may_be_measured
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA
from pneumorph.reduction.reduced_part import ReducedPart

_NEAR = 1.05
"""Times the highest pressure of the snapshots from which on it is told."""


def lowest_seen_kPa(parts: Iterable[ReducedPart]) -> float | None:
    """Where the first of reduced legs' snapshots ends, if that is below the pressures of the usual
    gaits [kPa]; else None. Those of legs of the published physics are no real ones."""
    ends = (part.seen_pressure_kPa for part in parts if may_be_measured(part))
    return min(filter(_ends_below_usual, ends), default=None)


def _ends_below_usual(seen_kPa: float) -> bool:
    """Whether snapshots up to a pressure, zero where that is not known, end below the usual."""
    return 0.0 < seen_kPa * _NEAR < HIGHEST_COMMAND_KPA


def unseen_pressure_note(spec: RobotSpec, largest_kPa: float) -> str | None:
    """What to say before reduced legs are inflated further than in any of their snapshots, or just
    as far, which is less than usual; None of others.

    Args:
        spec: The robot.
        largest_kPa: Highest real pressure of what walks [kPa].
    """
    simulated_kPa = float(spec.physics.pressure_map.simulated(largest_kPa))
    for module in spec.modules:
        seen_kPa = module.reduced.seen_pressure_kPa
        if 0.0 < seen_kPa * _NEAR < simulated_kPa:
            return (
                f"legs are inflated to {simulated_kPa:.4g} kPa, {module.name} has snapshots up to "
                f"{seen_kPa:.4g}: it extrapolates beyond; ask for lower pressures "
                "(--expert.amplitude-kPa of a walk, half of its highest; of a training "
                "--task.maximum-pressure-kPa and --baseline.gait.amplitude-kPa), or reduce it with "
                "a higher --largest-pressure-kPa"
            )
    return lowered_pressure_note(spec, largest_kPa)


def say_unseen_pressure(spec: RobotSpec, largest_kPa: float, say: Callable[[str], None]) -> None:
    """Say it, where there is something to say; arguments as of `unseen_pressure_note`."""
    _say(unseen_pressure_note(spec, largest_kPa), say)


def lowered_pressure_note(spec: RobotSpec, largest_kPa: float) -> str | None:
    """What to say before legs are inflated as far as their snapshots went, which is less than
    usual; None of others. Arguments as of `unseen_pressure_note`."""
    simulated_kPa = float(spec.physics.pressure_map.simulated(largest_kPa))
    for module in spec.modules:
        seen_kPa = module.reduced.seen_pressure_kPa
        if _ends_below_usual(seen_kPa) and seen_kPa / _NEAR <= simulated_kPa <= seen_kPa * _NEAR:
            return (
                f"legs are inflated to {simulated_kPa:.4g} kPa and not to {HIGHEST_COMMAND_KPA:g}: "
                f"{module.name} has snapshots up to {seen_kPa:.4g}"
            )
    return None


def say_lowered_pressure(spec: RobotSpec, largest_kPa: float, say: Callable[[str], None]) -> None:
    """Say it, where there is something to say; arguments as of `unseen_pressure_note`."""
    _say(lowered_pressure_note(spec, largest_kPa), say)


def _say(note: str | None, say: Callable[[str], None]) -> None:
    if note is not None:
        say(note)
