"""What walks as finite elements depend on: what is kept of them is found by digests of these.

There is one recipe for each kind of walk that is kept. None may say anything else of a robot that
could walk before, not even in another way: walks of hours would no longer be found.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.hub_spec import HubModel, HubSpec
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.paper_robot import DISK_MASS_KG, paper_hub, ring_of_sites
from pneumorph.catalogue.robot_identity import full_identity, lifted_identity, mounting_identity
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.site import Site
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.part_ingredients import ingredients, lumping, materials_text
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.physics.ground import Ground
from pneumorph.reduction.collect import carried_identity
from pneumorph.robot.design import Design
from pneumorph.robot.mounting_angle import tilted
from pneumorph.simulation.randomisation import World


def animation_identity(spec: RobotSpec, design: Design, record_every: int) -> dict[str, Any]:
    """All that decides the way of a full robot that is compared with the reduced one, but for the
    commands.

    Args:
        spec: The robot.
        design: Its design.
        record_every: Time steps between frames.
    """
    leg = spec.modules[0].full
    return {
        "design": str(design),
        "physics": spec.physics.described(),
        "full": {
            "hub": spec.hub_model,
            "integrator": spec.full_order.integrator,
            "friction_solver": spec.full_order.friction_solver,
            "contact_sweeps": spec.full_order.contact_sweeps,
            "height_map": settings_to_dict(spec.physics.ground.map),
            "mesh": None,
        },
        "mesh": leg.mesh.digest(),
        "leg": [*materials_text(leg), float(leg.node_mass.sum())],
        "record_every": record_every,
        **hub_mass_identity(spec),
        **lumping(leg),  # ways that ship are of even masses, and do not say so
        **spec.physics.ground.file_identity(),
        **full_identity(spec),
        **lifted_identity(spec),
    }


def gait_walk_identity(
    spec: RobotSpec,
    robot: FullRobot,
    design: Design,
    commands_kPa: np.ndarray,
    *,
    record_every: int,
    compression: float,
    carried: Mapping[str, str],
) -> dict[str, Any]:
    """What the snapshots of a given gait depend on; as a file gives it back.

    Args:
        spec: The robot's hub, legs and physics.
        robot: The robot that walks.
        design: Its design.
        commands_kPa: Real pressures of every step [kPa], (step, regulator).
        record_every: Time steps between snapshots.
        compression: Relative error at which they are stored.
        carried: `carried_otherwise` of the robot.
    """
    leg = spec.module.full
    depends_on = {
        "mesh_digest": leg.mesh.digest(),
        "part": ingredients(leg),
        "hub": spec.hub_model,
        "physics": robot.settings,
        "record_every": record_every,
        "compression": compression,
        "design": str(design),
        "commands_kPa": commands_kPa.tolist(),
        **hub_mass_identity(spec),
        **carried,
        **lifted_identity(spec),
    }
    identity: dict[str, Any] = json.loads(json.dumps(depends_on, default=str))
    return identity


def certified_walk_identity(
    spec: RobotSpec, design: Design, settling_steps: int, world: World | None
) -> dict[str, Any]:
    """What a walk of a learned pair depends on but for its commands. Reductions are none of it, and
    threads change no bit.

    Args:
        spec: The robot in the world as it stands.
        design: Its design.
        settling_steps: Time steps in which it comes to rest first.
        world: A drawn world; None for the one as it stands.
    """
    full_order, physics = spec.full_order.by_name(), settings_to_dict(spec.physics)
    del full_order["thread_count"]
    if spec.physics.ground == Ground():  # as walks were kept before there were others
        del physics["ground"]
    if spec.physics.start.is_usual:  # likewise
        del physics["start"]
    return {
        "design": str(design),
        "physics": physics,
        "full_order": full_order,
        "modules": [
            [ingredients(module.full), module.full.mesh.digest()] for module in spec.modules
        ],
        **full_identity(spec),
        "hub": [spec.hub_model, *spec.hub.mass_numbers()],
        "height_map": settings_to_dict(spec.physics.ground.map),
        **spec.physics.ground.file_identity(),
        "mounting_angle_deg": spec.mounting_angle_deg,
        "settling_steps": settling_steps,
        "world": None if world is None else world.of_full_order(),
        **mounting_identity(spec, [world] if world else [], "full"),
    }


def hub_mass_identity(spec: RobotSpec) -> dict[str, list[float]]:
    """The hub's mass; nothing of the published hub's, which earlier walks do not say."""
    hub = spec.hub.mass_numbers()
    return {} if hub == [DISK_MASS_KG] else {"hub_mass": hub}


def carried_otherwise(spec: RobotSpec) -> dict[str, str]:
    """What carries the legs and where, and the hub's surface; nothing of the paper's robot,
    whatever its hub weighs, whose walks of earlier versions do not say it."""
    usual = replace(paper_hub(), mass=spec.hub.mass)
    ring = ring_of_sites(RadialMounting(), (spec.module,))
    papers = _carried(usual, ring, spec.hub_model, spec.module, 0.0)
    own = _carried(spec.hub, spec.sites, spec.hub_model, spec.module, spec.mounting_angle_deg)
    surface = {} if spec.hub.surface == usual.surface else {"hub_surface": spec.hub.surface}
    return ({} if own == papers else {"carried": own}) | surface


def _carried(
    hub: HubSpec, sites: Sequence[Site], model: HubModel, module: Module, mounting_angle_deg: float
) -> str:
    """Hash of a hub and of where its sites have a module, in hexadecimal."""
    rest = module.full.rest_nodes
    poses = [tilted(site.pose_of(module), rest, mounting_angle_deg) for site in sites]
    return carried_identity(hub.full(model), poses)
