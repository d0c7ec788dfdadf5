"""What to say of a described robot before it walks: what its file chose without saying so."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.physics.physics import Physics
from pneumorph.physics.surfaces import HUB_SURFACE
from pneumorph.robot.broken_rules import broken_rules
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace


def description_notes(
    robot: RobotDescription, design: str | None, physics: Physics
) -> tuple[str, ...]:
    """What to say before one robot walks in one world.

    Args:
        robot: What its file says.
        design: The design that is taken, where nothing but this description chose it.
        physics: What acts on it.
    """
    told = [
        damping_note(robot, physics),
        _surface_note(robot, physics),
        robot.hub.payload_note(robot.folder),
        _worlds_note(robot),
    ]
    if design is not None:
        told = [forbidden_note(robot, design), design_note(robot, design), *told]
    return tuple(note for note in told if note is not None)


def damping_note(robot: RobotDescription, physics: Physics) -> str | None:
    """What to say of the damping that modules bring with them; None where they bring none, or
    another was asked for."""
    if not robot.polar_modules or physics.damping != "objective":
        return None
    polar = ", ".join(f"modules.{name}" for name in robot.polar_modules)
    return f"objective damping, which goes with the polar rotations of {polar}"


def design_note(robot: RobotDescription, design: str) -> str | None:
    """What to say of a design that walks as its file names no usual one; None where it does, and of
    another design."""
    if robot.designs.usual is not None or design != robot.usual_design:
        return None
    return f"[designs] names no usual design; {design} walks"


def forbidden_note(robot: RobotDescription, design: str) -> str | None:
    """What to say of a design that the rules do not allow; None of others."""
    names, said = [site.name for site in robot.sites], robot.file or robot.name
    return forbidden_of_space(robot.space, names, said, Design.parse(design))


def forbidden_of_space(
    space: DesignSpace, names: Sequence[str], said: Any, design: Design
) -> str | None:
    """The same of a space alone.

    Args:
        space: Designs that rules allow.
        names: Those of the sites; none of a ring.
        said: Whose rules they are: the robot's name, or its file.
        design: The design.
    """
    if space.holds(design):
        return None
    if (excluding := _excluding(space, names, design)) is not None:
        why = f"its exclusions allow one leg at most at {excluding}"
    else:
        why = broken_rules(space, design)
    try:
        space.check(design)
    except ValueError as error:
        why = "it " + str(error).removeprefix(f"design {design} ")
    return f"design {design} is none that [designs] of {said} allows: {why}"


def excluding_sites(robot: RobotDescription, design: Design) -> str | None:
    """Names of the sites with legs of which exclusions allow one at most, or their numbers where
    they have no names; None where a design keeps to all exclusions."""
    return _excluding(robot.space, [site.name for site in robot.sites], design)


def _excluding(space: DesignSpace, names: Sequence[str], design: Design) -> str | None:
    broken = space.broken_exclusion(design)
    if broken is None:
        return None
    named = dict(enumerate(names))
    return " and ".join(named.get(place) or str(place) for place in broken)


def _surface_note(robot: RobotDescription, physics: Physics) -> str | None:
    """What to say of a hub's surface of which nobody says how it rubs, where others are named; None
    of others."""
    surface, named = robot.hub.surface, dict(physics.friction_by_surface)
    if surface in (HUB_SURFACE, *named) or not named or robot.hub.contact == "none":
        return None
    return (
        f"physics.friction_by_surface names {', '.join(named)} and not {surface!r}, the "
        f"surface of [hub], which has the friction of all others, {physics.friction:g}"
    )


def _worlds_note(robot: RobotDescription) -> str | None:
    """What to say where one robot walks in one world; None where the file has no worlds."""
    if not robot.randomisation:
        return None
    return (
        f"in the world as it stands: [randomisation] of {robot.file or robot.name} is what "
        "coopt, search and certificates draw worlds from"
    )
