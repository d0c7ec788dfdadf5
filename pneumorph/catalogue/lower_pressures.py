"""Pressures of gaits for legs of one's own whose snapshots end below those of the usual gaits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_options import chosen_part
from pneumorph.catalogue.unseen_pressure import ends_below_usual


def lower_gait(content: Mapping[str, Any], described: RobotDescription | None) -> dict[str, float]:
    """Settings of the expert's gait for the legs that settings choose; empty where the usual ones
    will do.

    Args:
        content: Settings as nested dictionaries, with a group ``robot``.
        described: The robot that they describe by a file, if they do.
    """
    highest_kPa = _lower_kPa(content, described)
    return {} if highest_kPa is None else {"amplitude_kPa": 0.5 * highest_kPa}


def lower_task(content: Mapping[str, Any], described: RobotDescription | None) -> dict[str, float]:
    """Settings of a task for them; arguments as of `lower_gait`."""
    highest_kPa = _lower_kPa(content, described)
    return {} if highest_kPa is None else {"maximum_pressure_kPa": highest_kPa}


def _lower_kPa(content: Mapping[str, Any], described: RobotDescription | None) -> float | None:
    """Where the first of these legs' snapshots ends [kPa]; None where that is not below the usual
    pressures. Legs that do not relax are of the published physics, whose pressures are no real
    ones."""
    if described is None:
        part = chosen_part(content)
        parts = [] if part is None else [part]
    else:
        parts = described.own_parts
    ends = [each.seen_pressure_kPa for each in parts if each.relaxation is not None]
    return min((end for end in ends if ends_below_usual(end)), default=None)
