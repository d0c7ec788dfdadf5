"""What robots bring to the gaits that drive them: a design, regulators, phases to try, and lower
pressures for legs whose snapshots end below those of the usual gaits."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_settings import (
    asked_regulators,
    chosen_part,
    chosen_robot,
    described_robot,
)
from pneumorph.catalogue.unseen_pressure import lowest_seen_kPa
from pneumorph.environment.goal import FORWARD
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.study.gait_source import names_no_design

_WHOLE_CIRCLE = {"last_phase_deg": 359.0}
"""The paper's phases end at half of it: its robot goes further there than anywhere beyond."""


def highest_pressure_kPa(
    content: Mapping[str, Any], below: Mapping[str, Any], described: RobotDescription | None
) -> float | None:
    """Highest pressure of gaits that legs chosen by a layer of settings bring with them [kPa].

    Args:
        content: What the layer sets, as nested dictionaries with a group ``robot``.
        below: All settings below it.
        described: The robot that the layer describes by a file, if it does.

    Returns:
        Where the first of the legs' snapshots ends, if that is below the usual pressures; the usual
        one for legs in the place of such; None where nothing is to change.
    """
    part = chosen_part(content) if described is None else None
    if described is None and part is None:
        return None
    lowest = lowest_seen_kPa([part] if part is not None else _parts(described))
    before = below.get("robot", {}).get("part")
    if lowest is None and before is not None and Path(before).is_file():
        replaced = lowest_seen_kPa([ReducedPart.load(before)])
        return None if replaced is None else HIGHEST_COMMAND_KPA
    return lowest


def brought_expert(
    content: Mapping[str, Any], below: Mapping[str, Any], described: RobotDescription | None
) -> dict[str, Any]:
    """Settings of the expert's gait that a layer of settings brings. Arguments as of
    `highest_pressure_kPa`."""
    expert = _expert(described, highest_pressure_kPa(content, below, described))
    count = asked_regulators(content, below)
    return expert if count is None else {**expert, "regulator_count": count}


def brought_gait(
    content: Mapping[str, Any],
    below: Mapping[str, Any],
    named: Any,
    named_below: Any,
    expert_below: Mapping[str, Any],
) -> dict[str, Any]:
    """Settings ``design`` and ``expert`` of a walk that a layer of settings brings.

    Args:
        content: What the layer sets, as nested dictionaries with a group ``robot``.
        below: All settings below it.
        named: The gait that the layer names, instead of the expert's; None for none.
        named_below: The same of the settings below.
        expert_below: The expert's gait of the settings below.
    """
    robot = chosen_robot(content)
    gait = named_below if named is None else named
    brought: dict[str, Any] = {}
    if robot is not None and (gait is None or names_no_design(gait)):
        brought["design"] = robot.usual_design
    if gait is None:
        brought["expert"] = brought_expert(content, below, robot)
    elif named is not None:  # what a robot brought to the expert's gait was not asked for
        brought["expert"] = _usual_again(below.get("robot", {}), expert_below)
    return brought


def brought_phases(
    content: Mapping[str, Any], described: RobotDescription | None
) -> dict[str, Any]:
    """Which phases of the expert's gait a layer of settings brings: all of them for robots of a
    file and for goals other than the paper's. Arguments as of `highest_pressure_kPa`."""
    reward: Any = content
    for group in ("coopt", "task", "reward"):
        reward = reward.get(group) or {}
    usual = described is None and reward.get("goal", FORWARD.name) == FORWARD.name
    return {} if usual else dict(_WHOLE_CIRCLE)


def _expert(robot: RobotDescription | None, highest_kPa: float | None) -> dict[str, Any]:
    expert = {} if robot is None else robot.expert_settings()
    return expert if highest_kPa is None else {**expert, "amplitude_kPa": 0.5 * highest_kPa}


def _usual_again(robot: Mapping[str, Any], expert: Mapping[str, Any]) -> dict[str, Any]:
    """The usual values of what a robot brought to the expert's gait."""
    described, path = described_robot({"robot": robot}), robot.get("part")
    parts = [ReducedPart.load(path)] if described is None and path else _parts(described)
    brought, usual = _expert(described, lowest_seen_kPa(parts)), settings_to_dict(ExpertGait())
    if described is None and "physics" in robot:
        brought = {"regulator_count": robot["physics"]["regulator_count"], **brought}
    return {name: usual[name] for name, value in brought.items() if expert.get(name) == value}


def _parts(described: RobotDescription | None) -> list[ReducedPart]:
    return [] if described is None else list(described.own_parts.values())
