"""What acts on the robots whose walks a leg is reduced from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.result_example import example

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_leg import leg_kind, measured_leg_mesh, paper_leg, paper_leg_mesh
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.fem.material import LegMaterials
from pneumorph.geometry.mesh import MeshError
from pneumorph.physics.air import Air
from pneumorph.reduction.reduction_report import ReductionReport
from pneumorph.reduction.walk_snapshots import WalkPhysics
from pneumorph.study import reduction
from pneumorph.study.reduce_settings import ReduceSettings
from pneumorph.study.reduction import doubts
from pneumorph.study.reduction_options import ReduceOptions, measured, reduce_as_asked


class _Asked(Exception):
    """Carries what snapshots were asked for with."""


def asked_for(monkeypatch, call) -> tuple[Any, ...]:
    """What snapshots were asked for with."""

    def asked(*arguments):
        raise _Asked(arguments)

    monkeypatch.setattr(reduction, "collect_snapshots", asked)
    with pytest.raises(_Asked) as caught:
        call()
    found: tuple[Any, ...] = caught.value.args[0]
    return found


def acting(options: ReduceOptions, folder: Path, monkeypatch) -> WalkPhysics:
    """What would have acted on the walks."""

    given = asked_for(monkeypatch, lambda: reduce_as_asked(options, RunFolder(folder, "reduce")))
    found: WalkPhysics = given[-1]
    return found


def test_a_leg_is_reduced_where_it_is_mounted(tmp_path, monkeypatch):
    """One whose attachment face is elsewhere in its frame than the paper's leg has it."""
    mesh = paper_leg_mesh()
    away = np.array([10.0, 0.0, -4.0])
    moved = replace(mesh, nodes=mesh.nodes + away, contact_points=mesh.contact_points + away)
    robot = paper_robot(paper_leg("published", None, moved, LegMaterials()), hub_model="rigid")
    given = asked_for(monkeypatch, lambda: reduction.reduce(robot, tmp_path))
    full = robot.full("1.1.1.1.1.1.1.1")
    for pose, leg, site in zip(given[2], full.legs, robot.sites, strict=True):
        np.testing.assert_array_equal(pose.translation, leg.pose.translation)
        np.testing.assert_array_equal(pose.rotation, leg.pose.rotation)
        apart = pose.rotation.T @ (pose.translation - site.pose.translation)
        np.testing.assert_allclose(apart, -away, atol=1e-9)


def test_friction_and_regulators_of_walks_are_the_protocols(tmp_path, monkeypatch):
    """So that a leg is the same whatever floor and valves its robots have."""
    found = acting(measured(), tmp_path, monkeypatch).physics
    assert found.friction == measured().snapshots.static.friction
    own = leg_kind("measured").physics
    assert own.friction != found.friction
    assert replace(found, friction=own.friction) == replace(
        own, air=Air(), friction_by_surface=(), pressure_map=found.pressure_map
    )


def test_published_walks_are_those_that_earlier_snapshots_are_of(tmp_path, monkeypatch):
    assert acting(ReduceOptions(), tmp_path, monkeypatch).described() == {}


@pytest.mark.parametrize(
    ("preset", "own_mesh"), [(measured, measured_leg_mesh), (ReduceOptions, paper_leg_mesh)]
)
def test_a_mesh_without_outer_end_is_refused_before_its_snapshots(
    preset, own_mesh, tmp_path, monkeypatch
):
    """They take hours."""

    def never(*_):
        raise AssertionError("snapshots were asked for")

    monkeypatch.setattr(reduction, "collect_snapshots", never)
    mesh = own_mesh()
    sets = {name: each for name, each in mesh.node_sets.items() if name != "outer_end_face"}
    path = replace(mesh, node_sets=sets).save(tmp_path / "mesh.npz")
    with pytest.raises(MeshError, match="outer_end_face"):
        reduce_as_asked(replace(preset(), mesh=path), RunFolder(tmp_path / "run", "reduce"))


def test_a_reduction_that_no_robot_should_walk_on_is_told() -> None:
    sound = replace(
        example(ReductionReport), compliance_error_percent=24.0, heldout_node_error_mm=0.1
    )
    settings = ReduceSettings()
    assert doubts(sound, settings) == []
    (points,) = doubts(replace(sound, sampling_converged=False), settings)
    assert "stop at 0.1, expected 0.008 or less" in points
    assert "element_limit, 220" in points
    (stiff,) = doubts(replace(sound, compliance_error_percent=91.3), settings)
    assert "by 91 % otherwise" in stiff
    (unseen,) = doubts(replace(sound, heldout_node_error_mm=None), settings)
    assert "no snapshot was held out" in unseen
