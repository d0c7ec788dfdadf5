"""Kept trajectories come back as they went in, to their rounding, and only to who asks for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.part_physics import PhysicsName
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.shipped_data import data_folder
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
    model = paper_robot(module_of_leg("published", part=part)).reduced(animation.design)
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
    model = paper_robot(module_of_leg("published", part=part)).reduced(animation.design)
    bare = rollout(model, np.zeros((2, 3)), record_nodes=False)[1]
    with pytest.raises(ValueError, match="record them"):
        thinned(bare)


@pytest.mark.parametrize("name", ["two_leg", "baseline"])
def test_ways_that_ship_are_of_the_published_masses(name: str) -> None:
    """Found for the published robot, and for none of another hub, leg or spread of mass."""
    (animation,) = animations([name], 10.0)
    shipped = FullOrderStore(shipped_folders())
    by_volume = module_of_leg("published", materials=LegMaterials(mass_lumping="volume"))

    def found(robot: RobotSpec) -> bool:
        pair = ModelPair(animation, robot)
        return pair.kept(shipped, name, 10) is not None

    assert found(paper_robot("published"))
    assert not found(paper_robot("published", masses=Masses(hub_mass_g=30.0)))
    assert not found(paper_robot("published", masses=Masses("cast", leg_mass_g=105.0)))
    assert not found(paper_robot("published", masses=Masses(leg_mass_g=42.0)))
    assert not found(paper_robot(by_volume))
    for changed in (Physics(friction_by_surface=(("hub", 0.3),)), Physics(air=Air("orifice"))):
        assert not found(paper_robot("published", physics=changed))


def test_ways_that_ship_came_to_their_end() -> None:
    ways = [way for folder in shipped_folders() for way in folder.glob("*.npz")]
    assert {way.parent.name for way in ways} == {"measured", "published"}
    for way in ways:
        kept = Trajectory.load(way)
        assert kept.status == "completed"
        assert len(kept.metadata["identity"]) == 64
        assert kept.metadata["nodes"]


@pytest.mark.parametrize("physics", ["measured", "published"])
def test_every_walk_that_ships_is_found(physics: PhysicsName) -> None:
    """By all that decides it, and the usual comparison's ship: others would be walked for hours."""
    chosen = RobotOptions.of(physics).spec()
    store = FullOrderStore((data_folder("full_order") / physics,))
    runs = ComparisonSettings(periodic_count=8).runs()
    found, usual = [], []
    for kind, walks in runs.items():
        for each in walks:
            name = f"floating_{each.name}" if kind == "floating" else each.name
            pair = ModelPair(each, chosen, floating=kind == "floating")
            found += [name] if pair.kept(store, name, 10) else []
            usual += [] if kind == "periodic" else [name]
    assert set(usual) <= set(found)
    assert sorted(found) == sorted(path.stem for path in store.folders[0].glob("*.npz"))
