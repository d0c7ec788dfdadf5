"""Refuse spaces whose designs are none of a robot's."""

from __future__ import annotations

from pneumorph.catalogue.mirror_check import check_mirror
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.robot.design import module_letter
from pneumorph.robot.design_space import DesignSpace


def check_space(spec: RobotSpec, space: DesignSpace) -> None:
    """Refuse a space whose designs are none of this robot's.

    Raises:
        ValueError: It has other locations than the robot has sites, modules that a site does
            not allow, other regulators for a module than it has cavities, mirror images
            where a module is not its own, or a regulator that no design uses.
    """
    if space.location_count != len(spec.sites):
        raise ValueError(
            f"the design space has {space.location_count} locations and the robot "
            f"{len(spec.sites)} sites, expected the same number: see space.location_count"
        )
    check_fittings(spec, space, "space.options")
    space.refuse_idle_regulators(
        "space.regulator_count",
        "ask for fewer by physics.regulator_count, which changes designs, task and the "
        "expert's gait together, or see maximum_legs and maximum_regulators of space",
    )
    if space.has_mirror:
        for module in spec.modules:
            check_mirror(module, apart=space.cavity_count > 1)


def check_fittings(spec: RobotSpec, space: DesignSpace, setting: str) -> None:
    """Refuse modules that a site does not allow, and other regulators for a module than it has
    cavities.

    Args:
        spec: The robot.
        space: Designs of its sites.
        setting: Names their options, for the error.

    Raises:
        ValueError: There is one.
    """
    for number, (fittings, site) in enumerate(zip(space.fittings, spec.sites, strict=True)):
        last, at = max((each.module for each in fittings), default=0), site.name or number
        if last >= len(site.modules):
            raise ValueError(
                f"{setting}[{number}] names module {module_letter(last)}, and site "
                f"{at} allows {len(site.modules)} kinds of modules"
            )
        for each in fittings:
            module = site.modules[each.module]
            module.driven_by(each.regulators, f"{setting}[{number}]", at)
