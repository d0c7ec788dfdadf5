"""A robot of two small boxes on a rigid hub, whose finite elements walk in a second."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from helpers.box_mesh import box_mesh
from helpers.small_robot import small_leg
from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.site import Site
from pneumorph.fem.material import Material
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.physics import Physics


def box_robot() -> RobotSpec:
    """It has no reduced parts."""
    mesh = box_mesh((16.0, 16.0, 9.0), (2, 2, 1))
    mesh = replace(mesh, nodes=mesh.nodes + np.array([-8.0, -8.0, 1.0]))
    bottom = mesh.nodes[mesh.nodes[:, 2] < 1.0 + 1e-9]
    hub = HubSpec(mesh, Material(500.0, 0.3), 0.03, np.array([0.0, 0.0, 10.0]), bottom)

    def full(modulus_factor: float, mass_factor: float):
        assert mass_factor == 0.9 or mass_factor == 1.0
        return small_leg(300.0 * modulus_factor)

    leg = Module("a box", lambda: None, full)
    poses = [
        Pose(rotation_about("z", angle)).compose(Pose(np.eye(3), np.array([8.0, -6.0, 1.0])))
        for angle in (0.0, 100.0)
    ]
    physics = Physics(floor_height_mm=0.0, regulator_count=2)
    return RobotSpec(hub, tuple(Site(pose, leg) for pose in poses), physics, hub_model="rigid")
