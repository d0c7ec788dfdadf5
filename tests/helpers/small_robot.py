"""A robot small enough to solve densely: box legs on a rigid or soft box."""

import dataclasses

import numpy as np

from helpers.box_mesh import box_mesh
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.physics import Physics


def small_leg(young=300.0) -> PartModel:
    """A hollow box 40 x 12 x 9 mm with a membrane below, attached at its inner end."""
    mesh = box_mesh((40.0, 12.0, 9.0), (6, 3, 3), hollow=True)
    left = mesh.nodes[:, 0] < 1e-9
    corner = (np.abs(mesh.nodes[:, 1] - 6.0) > 5.9) & (np.abs(mesh.nodes[:, 2] - 4.5) > 4.4)
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    bottom = np.array([[x, y, 0.0] for x in (low[0], high[0]) for y in (low[1], high[1])])
    mesh = dataclasses.replace(
        mesh,
        node_sets={**mesh.node_sets, "attachment": np.flatnonzero(left & corner)},
        contact_points=bottom,
    )
    sheet = Membrane("bottom", Material(2.0 * young, 0.4), 1.0)
    return PartModel(mesh, Material(young, 0.2), 0.02, (sheet,), "cavity")


def small_robot(
    physics=None,
    soft=False,
    leg=None,
    legs=((0.0, 0), (100.0, 1)),
    height=1.0,
    numerics=None,
) -> FullRobot:
    """Legs at angles [degrees] with their regulators on a box whose bottom is at `height`."""
    hub_mesh = box_mesh((16.0, 16.0, 9.0), (2, 2, 1))
    offset = np.array([-8.0, -8.0, height])
    hub_mesh = dataclasses.replace(
        hub_mesh,
        nodes=hub_mesh.nodes + offset,
        contact_points=hub_mesh.nodes[hub_mesh.nodes[:, 2] < 1e-9] + offset,
    )
    if soft:
        hub = SoftHub(PartModel(hub_mesh, Material(500.0, 0.3), 0.03))
    else:
        hub = RigidHub(hub_mesh, 0.03)
    leg = leg or small_leg()
    place = Pose(np.eye(3), np.array([8.0, -6.0, height]))
    mounts = [
        (leg, Pose(rotation_about("z", angle)).compose(place), regulator)
        for angle, regulator in legs
    ]
    physics = physics or Physics(floor_height_mm=0.0, regulator_count=2)
    tracked = np.array([0.0, 0.0, height + 9.0])
    return FullRobot(hub, mounts, physics, tracked, numerics=numerics)
