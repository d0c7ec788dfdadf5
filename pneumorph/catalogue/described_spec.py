"""The specification that a robot's description stands for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.catalogue.hub_images import check_hub_images
from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.module_description import ModuleDescription
from pneumorph.catalogue.mounting_check import (
    check_apart,
    check_cast_mass,
    check_inflation,
    check_mounted,
)
from pneumorph.catalogue.paper_robot import ring_of_sites
from pneumorph.catalogue.part_physics import PhysicsName, refuse_other_physics
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.site import Site
from pneumorph.catalogue.space_check import check_fittings
from pneumorph.geometry.pose import Pose
from pneumorph.physics.physics import Physics
from pneumorph.robot.design_space import DesignSpace


def described_spec(robot: Any, physics: Physics, rest: Mapping[str, Any]) -> RobotSpec:
    """The specification of a `RobotDescription`, which has this as its method `spec`.

    Args:
        robot: The description.
        physics: What acts on the robot.
        rest: Other fields of `RobotSpec`, in place of what the description says of them.

    Raises:
        FileNotFoundError: A file that it names is missing.
        ValueError: As of `RobotDescription.spec`.
    """
    space: DesignSpace = robot.space  # refuses a usual design that its rules do not allow
    described: HubDescription = robot.hub
    modules = _modules(robot)
    hub = described.spec(robot.folder)
    spacing_mm = described.contact_spacing_mm if described.contact == "spread" else 0.0
    check_hub_images(hub, robot.designs.mirror, robot.designs.same, spacing_mm)
    sites = _sites(robot, modules)
    for name, module in modules.items():
        if robot.modules[name].mass_g is None:
            check_cast_mass(module.reduced, f"modules.{name}", f"modules.{name}.mass_g")
        check_inflation(module, name, physics)
    check_mounted(hub, sites, space, robot.mounting_tolerance_mm)
    check_apart(sites, space, robot.mounting_tolerance_mm)
    spec = RobotSpec(
        hub,
        sites,
        physics,
        **{
            "hub_model": described.model,
            "full_order": leg_kind(robot.physics.based_on).full_order,
            "name": robot.name,
            # Without its list of designs, which would go with the robot to every worker.
            "allowed_designs": replace(space),
            **rest,
        },
    )
    check_fittings(spec, space, "designs.options")
    spec.check_near_floor()
    return spec


def _modules(robot: Any) -> dict[str, Module]:
    """Each kind of module by its name, of the robot's physics."""
    based_on: PhysicsName = robot.physics.based_on
    described: Mapping[str, ModuleDescription] = robot.modules
    modules = {}
    for name, each in described.items():
        if each.part is not None and not (robot.folder / each.part).exists():
            file = robot.folder / each.part
            raise FileNotFoundError(f"modules.{name}.part: {file} does not exist")
        try:
            modules[name] = each.module(name, robot.folder, robot.built_folder, based_on)
        except FileNotFoundError as error:
            raise FileNotFoundError(f"modules.{name}: {error}") from error
        if each.part is not None:
            refuse_other_physics(
                robot.own_parts.get(name) or modules[name].reduced,
                based_on,
                f"the part of modules.{name} ({each.part})",
                "say by based_on in [physics] which it is of",
            )
    return modules


def _sites(robot: Any, modules: Mapping[str, Module]) -> tuple[Site, ...]:
    """Each site with the modules that it allows."""
    if robot.ring is not None:
        return ring_of_sites(robot.ring, tuple(modules.values()))
    return tuple(
        Site(site.pose, tuple(modules[name] for name in names), Pose(), site.name)
        for site, names in zip(robot.sites, robot.allowed_modules, strict=True)
    )
