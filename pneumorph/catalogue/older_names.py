"""Flags, legs and settings by the names of earlier versions, as they are called now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from itertools import pairwise
from typing import Any

from pneumorph.simulation.stepper_settings import StepperSettings

OLDER_GROUP = "simulation"
"""What `physics` and `stepper` were called when they were one group of settings."""
_OLDER_LEGS = {"paper": "published"}


def current_arguments(arguments: Sequence[str]) -> list[str]:
    """The command line with flags and legs of an earlier version as they are called now."""
    now = [_current_flag(argument) for argument in arguments]
    for place, (flag, value) in enumerate(pairwise(now), 1):
        if flag == "--leg":
            now[place] = current_leg(value)
    return now


def _current_flag(argument: str) -> str:
    flag, equals, value = argument.partition("=")
    if flag == "--leg":
        return f"{flag}{equals}{current_leg(value)}"
    if flag.startswith(("--full.height-map.", "--full.height_map.")):
        setting = flag.partition(".")[2].partition(".")[2]
        return f"--physics.ground.map.{setting}{equals}{value}"
    if flag.startswith("--materials.paper"):
        return argument.replace("paper", "sheet", 1)
    if not argument.startswith(f"--{OLDER_GROUP}."):
        return argument
    now = current_setting(flag.removeprefix("--").replace("-", "_")).split(".")[0]
    return argument.replace(OLDER_GROUP, now, 1)


def current_setting(name: str) -> str:
    """What a setting of the group ``simulation`` is called now, such as ``physics.friction``; the
    name itself of another."""
    group, _, field_name = name.partition(".")
    if group != OLDER_GROUP:
        return name
    numerics = {each.name for each in fields(StepperSettings)}
    return f"{'stepper' if field_name in numerics else 'physics'}.{field_name}"


def current_leg(name: Any) -> Any:
    """What a leg is called now that an earlier version called ``paper``."""
    return _OLDER_LEGS.get(name, name) if isinstance(name, str) else name


def with_current_leg(content: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of an earlier version with their leg as it is called now."""
    return {**content, "leg": current_leg(content["leg"])} if "leg" in content else dict(content)
