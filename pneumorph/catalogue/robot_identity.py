"""What tells robots apart, for what is kept of their walks and for what is resumed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterable
from functools import cache
from typing import Any, Literal, get_args

import numpy as np

from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.leg_kinds import LegName, load_default_leg, masses_of, pressure_map
from pneumorph.catalogue.paper_robot import paper_hub
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.shipped_data import data_folder
from pneumorph.fem.part_ingredients import ingredients
from pneumorph.geometry.pose import Pose
from pneumorph.physics.surfaces import HUB_SURFACE
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.mounting_angle import tilted
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.simulation.randomised_simulator import part_of_file


def reduction_digest(spec: RobotSpec) -> str:
    """Hash of all that tells reduced robots of this kind from others of the same physics: of
    one module at the sites of the paper's robot it is that of its reduced part."""
    if len(spec.modules) == 1 and spec.name is None:
        return spec.module.reduced.digest()
    content = hashlib.sha256()
    for module in spec.modules:
        content.update(module.reduced.digest().encode())
    for number in spec.hub.mass_numbers():
        content.update(repr(number).encode())
    _add_hub_points(content, spec.hub)
    for site in spec.sites:
        for module in site.modules:
            _add_pose(content, site.pose_of(module))
            content.update(str(spec.modules.index(module)).encode())
    return content.hexdigest()


def full_identity(spec: RobotSpec) -> dict[str, str]:
    """What tells full-order robots of a described kind from others; nothing of the paper's, whose
    leg and hub are told apart otherwise."""
    if spec.name is None:
        return {}
    hub, content = spec.hub, hashlib.sha256()
    content.update(f"{hub.mesh.digest()}{hub.mass_numbers()}{hub.material!r}".encode())
    _add_hub_points(content, hub)
    for site in spec.sites:
        for module in site.modules:
            part = module.full
            content.update(f"{part.mesh.digest()}{ingredients(part)}".encode())
            _add_pose(content, site.pose_of(module))
    return {"robot": content.hexdigest()}


def resume_identity(spec: RobotSpec, drawn: Randomisation | None = None) -> dict[str, str]:
    """The hub's mass, the heights of a map, legs that go outwards by their own x axes, a lift above
    uneven ground and what legs touch the floor with, which `reduction_digest` and
    `RobotSpec.settings` do not say of the paper's robot.

    Nothing of the mass that the legs' robot usually has, and of ground without a map: what earlier
    versions kept of those does not say them. A described robot's hub is in its digest.

    Args:
        spec: The robot.
        drawn: What worlds are drawn from where it is trained or searched; None for its own alone.

    Raises:
        FileNotFoundError: No such map.
        ValueError: It is no grid of heights.
    """
    rough = drawn is not None and drawn.distributions["ground_roughness_mm"].highest > 0.0
    ground = spec.physics.ground.file_identity() | _outwards_identity(spec)
    ground |= lifted_identity(spec, rough)
    drawn_deg = 0.0 if drawn is None else drawn.distributions["mounting_angle_deg"].highest
    ground |= _drooping_identity(spec, max(drawn_deg, 0.0), "reduced")
    ground |= touching_identity(spec, drawn)
    if spec.name is not None or len(spec.modules) > 1:
        return ground
    numbers = spec.hub.mass_numbers()
    if numbers == _usual_numbers(spec):
        return ground
    content = hashlib.sha256(repr(numbers).encode()).hexdigest()[:12]
    return {"hub_mass": f"{1e3 * spec.hub.mass_kg:.6g} g ({content})", **ground}


def mounting_identity(
    spec: RobotSpec, worlds: Iterable[World], model: Literal["reduced", "full"] = "reduced"
) -> dict[str, str]:
    """What is said of modules that earlier versions mounted otherwise, of robots that they started
    at another height and, of reduced ones, of what legs touch the floor with; nothing of others.

    Args:
        spec: The robot.
        worlds: Where it walks.
        model: As what.
    """
    worlds = list(worlds)
    told = {"rolled": "down"} if tilts_rolled_legs(spec, worlds) else {}
    rough = any(world.ground_roughness_mm > 0.0 for world in worlds)
    drawn_deg = max([0.0, *(world.mounting_angle_deg for world in worlds)])
    drooping = _drooping_identity(spec, drawn_deg, model)
    if model == "reduced":  # a whole model's mesh says it
        named = {name for world in worlds for name, _ in world.friction_by_surface}
        files = {world.reduction for world in worlds if world.reduction}
        told |= _touching_identity(spec, named, files)
    return told | drooping | _outwards_identity(spec) | lifted_identity(spec, rough)


def tilts_rolled_legs(spec: RobotSpec, worlds: Iterable[World]) -> bool:
    """Whether a robot has rolled modules that a mounting angle turns, its own or that of a world,
    which earlier versions turned about their own axes."""
    rolled = any(
        site.pose_of(module).roll_deg != 0.0 for site in spec.sites for module in site.modules
    )
    angles = [spec.mounting_angle_deg, *(world.mounting_angle_deg for world in worlds)]
    return rolled and any(angles)


def touching_identity(spec: RobotSpec, drawn: Randomisation | None = None) -> dict[str, str]:
    """What is said of reduced legs whose contact points matter by their surfaces, which a friction
    names, or by their areas, on which it depends. A part's digest says neither.

    Nothing of points that lie as those of a leg that ships do, and of surfaces that no friction
    names: what earlier versions kept of those does not say them.

    Args:
        spec: The robot.
        drawn: What worlds are drawn from; None for the robot's own alone.

    Raises:
        FileNotFoundError: No file of a reduction that worlds may have.
    """
    if drawn is None:
        return _touching_identity(spec, (), ())
    named = (name for name, _ in drawn.friction_by_surface)
    return _touching_identity(spec, named, map(str, drawn.reductions))


def _touching_identity(
    spec: RobotSpec, drawn: Iterable[str], files: Iterable[str]
) -> dict[str, str]:
    """As `touching_identity` has it, of surfaces whose friction is drawn and of files of the
    reductions that worlds may have."""
    named = {*drawn, *(name for name, _ in spec.physics.friction_by_surface)}
    pressed = spec.physics.friction_pressure.exponent != 0.0
    if not named and not pressed:
        return {}
    own = [module.reduced for module in spec.modules]
    legs = [*own, *(part_of_file(file) for file in sorted(set(files)))]
    told = [_touching(leg, named, pressed) for leg in legs]
    if all(each in _shipped(leg, named, pressed) for each, leg in zip(told, legs, strict=True)):
        return {}
    return {"contact_points": hashlib.sha256(json.dumps(told).encode()).hexdigest()[:12]}


def _touching(leg: ReducedPart, named: Collection[str], pressed: bool) -> list[Any]:
    """Surface of each contact point, empty where no friction names it, and areas [mm^2] where
    friction depends on pressure; empty of a leg that has nothing of both."""
    surfaces = leg.contact_surfaces
    names = [each if each in named else "" for each in surfaces.names.tolist()]
    areas = surfaces.area_mm2.tolist() if pressed else []
    return [names if any(names) else [], areas]


def _shipped(leg: ReducedPart, named: Collection[str], pressed: bool) -> list[list[Any]]:
    """What is usual of a leg: as of those that ship with as many points, or else nothing."""
    for legs in (_paper_legs, _catalogue_legs):
        alike = [each for each in legs() if len(each.contact_points) == len(leg.contact_points)]
        if alike:
            return [_touching(each, named, pressed) for each in alike]
    return [[[], []]]


def _paper_legs() -> list[ReducedPart]:
    return [load_default_leg(name) for name in get_args(LegName)]


@cache
def _catalogue_legs() -> list[ReducedPart]:
    return [ReducedPart.load(file) for file in sorted(data_folder("catalogue").glob("*/leg.npz"))]


def _drooping_identity(
    spec: RobotSpec, drawn_deg: float, model: Literal["reduced", "full"]
) -> dict[str, str]:
    """What is said of robots whose legs droop by so much besides, so deep that they are put on the
    floor, inside which earlier versions started them."""
    angle_deg, physics = spec.mounting_angle_deg + drawn_deg, spec.physics
    if angle_deg <= 0.0 or not physics.ground.is_plane or not physics.start.is_upright:
        return {}
    lowest = np.inf
    for site in spec.sites:
        for module in site.modules:
            mesh = module.full.mesh if model == "full" else None
            nodes = module.reduced.rest_nodes if mesh is None else mesh.nodes
            points = module.reduced.contact_points if mesh is None else mesh.contact_points
            pose = tilted(site.pose_of(module), nodes, angle_deg)
            lowest = min(lowest, float(np.min(pose.apply(points)[:, 2], initial=np.inf)))
    raised = physics.start.raised_mm(lowest, physics.floor_height_mm)
    return {"drooping": "on the floor"} if raised > 0.0 else {}


def _outwards_identity(spec: RobotSpec) -> dict[str, str]:
    """What is said of modules that go outwards by their own x axes, whatever face is attached."""
    turned = any(site.turns(module) for site in spec.sites for module in site.modules)
    return {"turned": "outwards"} if turned else {}


def lifted_identity(spec: RobotSpec, rough: bool = False) -> dict[str, str]:
    """What is said of robots that start above uneven ground: earlier versions lowered that by less
    where they were lifted.

    Args:
        spec: The robot.
        rough: Whether worlds have a ground of their own.
    """
    uneven = rough or not spec.physics.ground.is_plane
    return {"lifted": "above the ground"} if uneven and spec.physics.start.lift_mm > 0.0 else {}


def _add_hub_points(content: Any, hub: HubSpec) -> None:
    """Its tracked point, what may touch the floor and on which surface that is; the usual surface,
    which what earlier versions kept does not say, says nothing."""
    for array in (hub.tracked_point, hub.contact_points):
        content.update(np.ascontiguousarray(array, dtype=float).tobytes())
    if hub.surface != HUB_SURFACE:
        content.update(f"surface {hub.surface!r}".encode())


def _add_pose(content: Any, pose: Pose) -> None:
    content.update(pose.rotation.tobytes() + pose.translation.tobytes())


def _usual_numbers(spec: RobotSpec) -> list[float]:
    """Of the hub that goes with the legs, as `paper_robot` has it."""
    own = spec.module.pressure_map
    names = [each for each in get_args(LegName) if pressure_map(each) == own]
    return paper_hub(masses_of(names[0] if names else "published")).mass_numbers()
