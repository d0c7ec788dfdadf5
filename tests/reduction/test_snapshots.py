"""Snapshot files and their collection."""

from __future__ import annotations

import numpy as np
import pytest
from box_mesh import box_mesh
from synthetic_part import synthetic_model

from pneumorph.artefact import ArtefactError
from pneumorph.executor import ExecutorSettings
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.reduction.collect import SnapshotSettings, collect_snapshots
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings, gray_corners, walk_snapshots

SETTINGS = SnapshotSettings(
    static=StaticSnapshotSettings(
        bend_pressure_kPa=40.0, bend_count=2, load_count=2, load_limit_mN=50.0
    ),
    walk=WalkSnapshotSettings(
        leg_counts=(2,), corner_limit=2, hold_s=0.04, amplitude_kPa=50.0, settling_steps=2
    ),
    executor=ExecutorSettings(process_count=1),
)


def some_snapshots(name: str = "load", digest: str = "a") -> Snapshots:
    rng = np.random.default_rng(0)
    return Snapshots(
        rng.normal(size=(4, 5, 3)).astype(np.float32),
        np.arange(4.0),
        np.zeros(4, dtype=np.int32),
        {"mesh_digest": digest, "sources": [name]},
    )


def robot_around_a_box():
    hub = RigidHub(box_mesh((20.0, 20.0, 10.0), (2, 2, 2)), 0.05)
    poses = [
        Pose(rotation_about("z", yaw), rotation_about("z", yaw) @ np.array([70.0, 0.0, 0.0]))
        for yaw in (0.0, 120.0, 240.0)
    ]
    return hub, poses


def test_saved_snapshots_are_the_snapshots(tmp_path):
    snapshots = some_snapshots()
    loaded = Snapshots.load(snapshots.save(tmp_path / "s.npz"))
    assert np.array_equal(loaded.displacement, snapshots.displacement)
    assert np.array_equal(loaded.pressure_kPa, snapshots.pressure_kPa)
    assert loaded.sources == ["load"]


def test_joined_snapshots_remember_where_each_came_from():
    joined = Snapshots.joined([some_snapshots("bend"), some_snapshots("walk 0.3")])
    assert len(joined) == 8
    assert joined.of("bend").tolist() == [0, 1, 2, 3]
    assert joined.of("walk").tolist() == [4, 5, 6, 7]
    with pytest.raises(ArtefactError, match="must be of one mesh"):
        Snapshots.joined([some_snapshots(), some_snapshots(digest="b")])


def test_snapshots_that_diverged_or_do_not_fit_are_refused():
    bad = some_snapshots()
    with pytest.raises(ValueError, match="must be finite"):
        Snapshots(np.full_like(bad.displacement, np.nan), bad.pressure_kPa, bad.source)
    with pytest.raises(ValueError, match="pressure_kPa must have one entry"):
        Snapshots(bad.displacement, bad.pressure_kPa[:2], bad.source)
    with pytest.raises(ValueError, match="must have shape"):
        Snapshots(bad.displacement[0], bad.pressure_kPa, bad.source)


def test_gray_corners_visit_every_corner_changing_one_leg_at_a_time():
    corners = gray_corners(4)
    assert len({tuple(corner) for corner in corners}) == 16
    assert np.all(np.abs(np.diff(corners, axis=0)).sum(axis=1) == 1)


def test_collection_resumes_and_does_not_depend_on_when_it_stopped(tmp_path):
    part = synthetic_model((4, 4, 4))
    hub, poses = robot_around_a_box()
    first = collect_snapshots(part, hub, poses, SETTINGS, tmp_path)
    # 2 bends, 2 loads, and every second of the 8 steps of 2 legs.
    assert [len(first.of(kind)) for kind in ("bend", "load", "walk")] == [2, 2, 8]
    displacement = first.states(np.arange(len(first)))
    assert np.all(displacement[:, part.mesh.node_set("attachment")] == 0.0)
    written = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    (tmp_path / "load_0.npz").unlink()
    (tmp_path / "walk_0.npz").write_bytes(b"half a file")
    again = collect_snapshots(part, hub, poses, SETTINGS, tmp_path)
    assert np.array_equal(displacement, again.states(np.arange(len(again))))
    assert (tmp_path / "bend.npz").stat().st_mtime_ns == written["bend.npz"]
    assert (tmp_path / "load_0.npz").stat().st_mtime_ns != written["load_0.npz"]


def test_more_legs_than_places_are_refused():
    hub, poses = robot_around_a_box()
    part, settings = synthetic_model((4, 4, 4)), WalkSnapshotSettings(leg_counts=(4,))
    with pytest.raises(ValueError, match="must not exceed the 3 places"):
        walk_snapshots(part, hub, poses, settings, 0)
