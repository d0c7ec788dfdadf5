"""Kept trajectories come back as they went in, to their rounding, and only to who asks for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.paper_leg import paper_leg
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.material import LegMaterials
from pneumorph.physics.air import Air
from pneumorph.physics.physics import Physics
from pneumorph.simulation.rollout import rollout
from pneumorph.study.animations import animations
from pneumorph.study.comparison import ComparisonSettings
from pneumorph.study.full_order_store import (
    NODE_COUNT,
    FullOrderStore,
    at_nodes,
    rollout_identity,
    shipped_folders,
    thinned,
)
from pneumorph.study.model_pair import ModelPair
from pneumorph.study.robot_error import robot_error
from pneumorph.trajectory import Trajectory


def test_a_kept_trajectory_is_found_by_its_identity(tmp_path: Path) -> None:
    (animation,) = animations(["two_leg"], 0.2)
    part = synthetic_reduced_part(mode_count=4, cells=(6, 4, 4))
    assert len(part.rest_nodes) > NODE_COUNT
    model = paper_robot(paper_leg("published", part=part)).reduced(animation.design)
    trajectory = rollout(model, np.full((20, 3), 45.0))[1]
    store = FullOrderStore((tmp_path / "own", tmp_path / "shipped"))
    kept = store.save("two_leg", "this", trajectory)
    found = store.find("two_leg", "this")
    assert found is not None
    np.testing.assert_array_equal(found.node_positions_mm, kept.node_positions_mm)
    assert store.find("two_leg", "another") is None
    assert store.find("six_leg", "this") is None
    # Folders are tried one after another.
    both = FullOrderStore((tmp_path / "empty", tmp_path / "own"))
    assert both.find("two_leg", "this") is not None
    error = robot_error(found, at_nodes(trajectory, found.metadata["nodes"]))
    assert 0.0 < error.largest_node_error_mm <= 3**0.5 * 2.0**-10 + 1e-4  # half a unit each way


def test_identity_changes_with_anything(tmp_path: Path) -> None:
    commands = np.zeros((3, 2))
    identity = rollout_identity({"design": "1.0", "mesh": "a"}, commands)
    assert identity == rollout_identity({"mesh": "a", "design": "1.0"}, commands.copy())
    assert identity != rollout_identity({"design": "1.0", "mesh": "b"}, commands)
    assert identity != rollout_identity({"design": "1.0", "mesh": "a"}, commands + 1e-9)


def test_a_trajectory_without_nodes_cannot_be_kept() -> None:
    (animation,) = animations(["two_leg"], 0.1)
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    model = paper_robot(paper_leg("published", part=part)).reduced(animation.design)
    bare = rollout(model, np.zeros((2, 3)), record_nodes=False)[1]
    with pytest.raises(ValueError, match="record them"):
        thinned(bare)


@pytest.mark.parametrize("name", ["two_leg", "baseline"])
def test_ways_that_ship_are_of_the_published_masses(name: str) -> None:
    """Found for the published robot, and for none of another hub, leg or spread of mass."""
    (animation,) = animations([name], 10.0)
    shipped = FullOrderStore(shipped_folders())
    by_volume = paper_leg("published", materials=LegMaterials(mass_lumping="volume"))

    def found(robot: RobotSpec) -> bool:
        pair = ModelPair(animation, robot)
        identity = rollout_identity(pair._described(10), pair.commands_kPa)
        return shipped.find(name, identity) is not None

    assert found(paper_robot("published"))
    assert not found(paper_robot("published", masses=Masses(hub_mass_g=30.0)))
    assert not found(paper_robot("published", masses=Masses("cast", leg_mass_g=105.0)))
    assert not found(paper_robot("published", masses=Masses(leg_mass_g=42.0)))
    assert not found(paper_robot(by_volume))
    for changed in (Physics(friction_by_surface=(("hub", 0.3),)), Physics(air=Air("orifice"))):
        assert not found(paper_robot("published", physics=changed))


def test_every_way_of_the_usual_comparison_ships() -> None:
    """Of either physics, so that comparing takes seconds and not hours."""
    shipped = FullOrderStore(shipped_folders())
    for physics in ("published", "measured"):
        robot = paper_robot(physics)
        for kind, animated in ComparisonSettings().runs().items():
            for animation in animated:
                floating = kind == "floating"
                name = f"floating_{animation.name}" if floating else animation.name
                pair = ModelPair(animation, robot, floating)
                identity = rollout_identity(pair._described(10), pair.commands_kPa)
                assert shipped.find(name, identity) is not None, (physics, name)


def test_ways_that_ship_came_to_their_end() -> None:
    ways = [way for folder in shipped_folders() for way in folder.glob("*.npz")]
    assert {way.parent.name for way in ways} == {"measured", "published"}
    for way in ways:
        kept = Trajectory.load(way)
        assert kept.status == "completed"
        assert len(kept.metadata["identity"]) == 64
        assert kept.metadata["nodes"]
