"""What kept walks of given gaits depend on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pneumorph.catalogue.hub_spec import HubModel
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.gait.held_gait import HeldGait
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.ground import Ground, RoughGround
from pneumorph.physics.start_pose import StartPose
from pneumorph.robot.design import Design
from pneumorph.study.gait_walks import DesignGait, GaitWalks, GaitWalkSettings

GAIT = DesignGait(
    "a gait",
    Design.parse("1.0.0.2.2.0.0.1"),
    HeldGait(np.array([0.0]), np.zeros((1, 3)), 0.1),
)


def said(spec: RobotSpec) -> dict[str, Any]:
    """What of a walk's identity the paper's robot has not."""
    identity = GaitWalks(spec, GaitWalkSettings()).identity(GAIT)
    return {name: identity.pop(name, None) for name in ("carried", "hub_surface")}


@pytest.fixture(scope="module")
def spec() -> RobotSpec:
    return paper_robot("published", hub_model="rigid")


@pytest.mark.parametrize("model", ["soft", "rigid"])
def test_walks_of_the_papers_robot_are_found_that_earlier_versions_kept(model: HubModel) -> None:
    """Whatever its hub weighs, which is said otherwise."""
    for masses in (None, Masses("cast"), Masses("cast", hub_mass_g=60.0)):
        robot = paper_robot("published", masses=masses, hub_model=model)
        assert said(robot) == {"carried": None, "hub_surface": None}


def test_walks_that_begin_above_uneven_ground_are_told_from_earlier_ones(spec: RobotSpec) -> None:
    """Earlier versions lowered those that are lifted by less."""
    ground = Ground(rough=RoughGround(3.0))
    for lift_mm, told in ((0.0, None), (5.0, "above the ground")):
        start = StartPose(lift_mm=lift_mm)
        for there, of in ((ground, told), (Ground(), None)):
            physics = replace(spec.physics, ground=there, start=start)
            lifted = replace(spec, physics=physics)
            identity = GaitWalks(lifted, GaitWalkSettings()).identity(GAIT)
            assert identity.get("lifted") == of


def test_walks_of_robots_of_other_sites_and_hubs_are_told_apart(spec: RobotSpec) -> None:
    """Each from the paper's and from the others, as are legs that are mounted further down."""
    hub = spec.hub
    turn = rotation_about("z", 10.0)
    sites = tuple(
        replace(site, pose=Pose(turn, np.array([0.0, 0.0, 5.0])).compose(site.pose))
        for site in spec.sites
    )
    others = (
        replace(spec, sites=sites),
        replace(spec, hub=replace(hub, contact_points=hub.contact_points[::2])),
        replace(spec, mounting_angle_deg=3.0),
    )
    carried = {said(each)["carried"] for each in others}
    assert len(carried) == 3
    assert None not in carried
    assert said(replace(spec, hub=replace(hub, surface="feet")))["hub_surface"] == "feet"


def test_a_compression_that_keeps_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match=r"compression must be at least 0 and below 1, got 1"):
        GaitWalkSettings(compression=1.0)
