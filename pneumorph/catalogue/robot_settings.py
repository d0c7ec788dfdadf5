"""What the settings of a robot choose, bring with them, and were called in earlier versions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from pneumorph.base.artefact import read_text
from pneumorph.base.settings import laid_over, settings_to_dict
from pneumorph.base.shapes import table
from pneumorph.catalogue.full_options import full_of
from pneumorph.catalogue.leg_kinds import LegName, leg_kind, masses_of, physics_of, pressure_map
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.older_names import OLDER_GROUP, with_current_leg
from pneumorph.catalogue.part_physics import (
    PhysicsName,
    may_be_measured,
    physics_of_part,
)
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.simulation.stepper_settings import StepperSettings


def all_of_physics(name: PhysicsName) -> dict[str, Any]:
    """The settings that a physics is, but for numerics that all share."""
    kind = leg_kind(name)
    physics = settings_to_dict(kind.physics)
    del physics["regulator_count"]  # which is the robot's
    return {
        "based_on": name,
        "leg": name,
        "physics": physics,
        "full": full_of(kind),
        "masses": {"model": kind.mass_model},
    }


def _is_complete(content: Mapping[str, Any]) -> bool:
    """Whether settings are all that there are, as a run keeps them, and not flags or a file's: by
    the numerics, whole as every version kept them, which nobody asks for one by one."""
    numerics = content.get("stepper") or content.get(OLDER_GROUP) or {}
    whole = {"contact_margin_mm", "contact_sweeps", "speed_limit_mm_per_s", "element_precision"}
    return {"part", "threads"} <= set(content) and whole <= set(numerics)


USUAL: PhysicsName = "measured"
"""The physics where none is asked for."""


def described_robot(content: Mapping[str, Any]) -> RobotDescription | None:
    """The robot that settings with a group ``robot`` describe by a file; None without one.

    Args:
        content: Settings as nested dictionaries.
    """
    robot = content.get("robot", {})
    path, text = robot.get("described"), robot.get("file_text")
    if path is None:
        return None
    usual = robot.get("based_on", USUAL)
    if text is None:
        return RobotDescription.chosen(path, usual)
    return RobotDescription.of_text(text, path, usual)


def chosen_robot(content: Mapping[str, Any]) -> RobotDescription | None:
    """The same where the settings choose it, so that its designs and regulators come with it; None
    where they are those of an earlier run, whose gaits have theirs.

    Args:
        content: Settings as nested dictionaries.
    """
    return None if _is_complete(content.get("robot", {})) else described_robot(content)


def asked_regulators(content: Mapping[str, Any], below: Mapping[str, Any]) -> int | None:
    """Regulators that settings ask the paper's robot for, so that gaits, designs and tasks have as
    many; None where they do not, and for a robot of a file, which says it.

    Args:
        content: Settings as nested dictionaries, with a group ``robot``.
        below: All settings below them.
    """
    robot = content.get("robot", {})
    described = robot.get("described") or below.get("robot", {}).get("described")
    if described is not None or _is_complete(robot):
        return None
    count: int | None = robot.get("physics", {}).get("regulator_count")
    return count


def chosen_part(content: Mapping[str, Any]) -> ReducedPart | None:
    """The reduced leg of a file that the settings choose; None as of `chosen_robot`.

    Args:
        content: Settings as nested dictionaries.

    Raises:
        FileNotFoundError: No such part.
        ArtefactError: It is no reduced part.
    """
    robot = content.get("robot", {})
    path = None if _is_complete(robot) else robot.get("part")
    return None if path is None else ReducedPart.load(path)


def upgraded_robot(content: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of an earlier version as they are called now.

    One group `simulation` held what is physics and stepper now, and steps were linearised at the
    start; a run of the hyperelastic leg kept the published pressure map in its settings and used
    the leg's own. The published leg was called ``paper``. Every robot had the published masses, and
    was of the published physics where nothing is said of it and its leg is not of the measured one;
    what a robot's file says stood there as if nothing was. A map of heights was an option of finite
    elements.
    """
    now = with_current_leg(content)
    if isinstance(now.get("full"), Mapping) and "height_map" in now["full"]:
        full = dict(now["full"])
        ground = {"ground": {"map": full.pop("height_map")}}
        physics = table(now.get("physics", {}), "physics")
        now |= {"full": full, "physics": laid_over(ground, physics)}
    if _is_complete(now):
        of_leg = "measured" if now.get("leg") == "measured" else "published"
        usual: dict[str, Any] = {"based_on": of_leg, "leg": "published", "full": {}}
        now = {**usual, "masses": {"model": "published"}, **now}
        robot = now.get("described")
        if isinstance(robot, str) and now.get("file_text") is None and Path(robot).is_file():
            now["file_text"] = read_text(robot, "robot")
            described = RobotDescription.of_text(now["file_text"], robot, "published")
            said = all_of_physics(described.physics.based_on)
            nothing = {**usual, "masses": settings_to_dict(Masses("published"))}
            now |= {
                name: said[name]
                for name in ("based_on", "leg", "masses")
                if now[name] in (nothing[name], {"model": "published"})
            }
    elif OLDER_GROUP in now and "leg" not in now:
        now = {"based_on": "published", **now}
    older = now.pop(OLDER_GROUP, {})
    if not older:
        return now
    older = {"linearised": "start", **table(older, OLDER_GROUP)}
    numerics = {each.name for each in fields(StepperSettings)}
    if older.get("pressure_map") == settings_to_dict(PressureMap()):
        own = pressure_map(now.get("leg", "published"))
        older = {**older, "pressure_map": settings_to_dict(own)}
    for group, chosen in (
        ("physics", {k: v for k, v in older.items() if k not in numerics}),
        ("stepper", {k: v for k, v in older.items() if k in numerics}),
    ):
        if chosen:
            now[group] = {**chosen, **now.get(group, {})}
    return now


def implied_by_robot(content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
    """Settings that a choice of physics, leg or part brings with it where they are not set.

    Raises:
        FileNotFoundError: No such part.
        ArtefactError: It is no reduced part.
    """
    path, text = content.get("described"), content.get("file_text")
    if path is None and content.get("based_on") is not None:
        # The physics of a file that was named before, which may leave that open.
        path, text = below.get("described"), below.get("file_text")
    if path is not None:
        usual_physics = content.get("based_on", USUAL)
        if text is None:
            robot = RobotDescription.chosen(path, usual_physics)
            text = read_text(path, "robot")
        else:
            robot = RobotDescription.of_text(text, path, usual_physics)
        brought = {**all_of_physics(robot.physics.based_on), "file_text": text}
        brought["physics"] = settings_to_dict(robot.acting)
        brought["full"]["hub"] = robot.hub.model
        return brought
    brought = {}
    leg: LegName | None = content.get("leg")
    name: PhysicsName | None = content.get("based_on")
    path = content.get("part")
    part = ReducedPart.load(path) if path is not None and leg is None else None
    if name is None:
        own = None if leg is None else physics_of(leg)
        own = own if part is None else physics_of_part(part)
        name = None if own == below.get("based_on") else own
    if name is not None:
        brought = all_of_physics(name)
    if leg is not None:
        own_of_leg = {
            "physics": {"pressure_map": settings_to_dict(pressure_map(leg))},
            "masses": {"model": masses_of(leg).model},
        }
        brought = laid_over(brought, own_of_leg)
    if part is not None and part.is_polar:
        brought = laid_over(brought, {"physics": {"damping": "objective"}})
    if path is None and brought:  # all of a physics, under a leg that was chosen before
        path = below.get("part")
    if path is not None and leg in (None, "measured"):
        grown = part or ReducedPart.load(path)
        if may_be_measured(grown) and name != "published":
            usual = leg_kind("measured").physics.air.chamber_growth
            air = {"chamber_growth": list(grown.chamber_growth or usual)}
            brought = laid_over(brought, {"physics": {"air": air}})
    return brought
