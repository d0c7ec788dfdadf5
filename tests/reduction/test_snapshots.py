"""Snapshot files and their collection."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.synthetic_part import synthetic_mesh, synthetic_part
from helpers.two_chambers import two_chamber_leg

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.executor import ExecutorSettings
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_ingredients import ingredients
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.fem.time_integration import StepError
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.physics import Physics
from pneumorph.reduction import walk_snapshots as walk_snapshots_file
from pneumorph.reduction.blocked_snapshots import BlockedSnapshotSettings, blocked_snapshots
from pneumorph.reduction.collect import SnapshotSettings, collect_snapshots, sound_files
from pneumorph.reduction.snapshot_files import SnapshotFiles
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings, load_snapshots
from pneumorph.reduction.walk_snapshots import (
    WalkPhysics,
    WalkSnapshotSettings,
    gray_corners,
    leg_step_seconds,
    walk_plan,
    walk_snapshots,
)

SETTINGS = SnapshotSettings(
    static=StaticSnapshotSettings(
        bend_pressure_kPa=40.0, bend_count=2, load_count=2, load_limit_mN=50.0
    ),
    walk=WalkSnapshotSettings(
        leg_counts=(2,), corner_limit=2, hold_s=0.04, amplitude_kPa=50.0, settling_steps=2
    ),
    executor=ExecutorSettings(process_count=1),
)


WITHOUT_WALKS = dataclasses.replace(SETTINGS, walk=WalkSnapshotSettings(leg_counts=()))


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


def test_files_of_other_materials_are_made_again_and_unknown_settings_are_defaults(tmp_path):
    hub, poses = robot_around_a_box()
    part = synthetic_part((4, 4, 4))
    said = []
    collect_snapshots(part, hub, poses, WITHOUT_WALKS, tmp_path, say=said.append)
    assert said == []  # walks are what takes long
    before = (tmp_path / "load_0.npz").stat().st_mtime_ns
    # A file of an older version knows neither the part nor every setting.
    old = Snapshots.load(tmp_path / "load_0.npz")
    del old.metadata["part"], old.metadata["settings"]["seed"], old.metadata["seconds"]
    old.save(tmp_path / "load_0.npz")
    written = (tmp_path / "load_0.npz").stat().st_mtime_ns
    assert written != before
    files = collect_snapshots(part, hub, poses, WITHOUT_WALKS, tmp_path)
    assert (tmp_path / "load_0.npz").stat().st_mtime_ns == written
    assert files.metadata["seconds"]["files_without"] == 1
    heavier = PartModel(part.mesh, part.material, 0.2, part.membranes, cavity="cavity")
    bend = (tmp_path / "bend.npz").stat().st_mtime_ns
    collect_snapshots(heavier, hub, poses, WITHOUT_WALKS, tmp_path)
    assert (tmp_path / "bend.npz").stat().st_mtime_ns != bend


def test_files_of_some_of_the_cavities_are_not_taken_for_those_of_all(tmp_path):
    """Nor the other way round; one of all says nothing of it, like those of earlier versions."""
    both, (hub, _) = two_chamber_leg(), robot_around_a_box()
    left = PartModel(both.mesh, both.material, both.mass_kg, both.membranes, ("cavity_left",))
    static = StaticSnapshotSettings(bend_pressure_kPa=2.0, bend_count=1, load_count=0)
    settings = dataclasses.replace(WITHOUT_WALKS, static=static)
    assert "cavities" not in ingredients(both)

    def bends(part):
        files = collect_snapshots(part, hub, [], settings, tmp_path)
        return files.sources, files.states(np.arange(1))[0]

    sources, alone = bends(left)
    assert sources == ["bend"]
    every, together = bends(both)
    assert every == ["bend", "bend of cavity_left", "bend of cavity_right"]
    assert np.abs(together - alone).max() > 0.1 * np.abs(alone).max()
    again, as_before = bends(left)
    assert again == sources
    np.testing.assert_array_equal(as_before, alone)


def test_the_time_of_missing_walks_is_told_before_they_begin(tmp_path):
    hub, poses = robot_around_a_box()
    said = []
    collect_snapshots(synthetic_part((4, 4, 4)), hub, poses, SETTINGS, tmp_path, say=said.append)
    # Two loads of 50 leg steps each, and (2 + 8) steps of 2 legs; the bend is there already.
    assert len(said) == 1
    assert "2 tasks with 120 steps of a leg" in said[0]


def test_the_time_is_measured_with_as_many_legs_as_the_middle_robot_has(monkeypatch):
    class Measured(Exception):
        pass

    def noted(_part, _hub, _poses, _settings, plan, _acting):
        raise Measured(len(plan.places))

    monkeypatch.setattr(walk_snapshots_file, "walking_robot", noted)
    hub, poses = robot_around_a_box()
    settings = WalkSnapshotSettings(robots="drawn", leg_counts=(3, 1, 1, 2, 3))
    with pytest.raises(Measured, match="2"):
        leg_step_seconds(synthetic_part((4, 4, 4)), hub, poses, settings)


def test_collection_resumes_and_does_not_depend_on_when_it_stopped(tmp_path):
    part = synthetic_part((4, 4, 4))
    hub, poses = robot_around_a_box()
    first = collect_snapshots(part, hub, poses, SETTINGS, tmp_path)
    # 2 bends, 2 loads, and every second of the 2 settling steps and 8 others of 2 legs.
    assert [len(first.of(kind)) for kind in ("bend", "load", "walk")] == [2, 2, 10]
    displacement = first.states(np.arange(len(first)))
    assert np.all(displacement[:, part.mesh.node_set("attachment")] == 0.0)
    written = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    (tmp_path / "load_0.npz").unlink()
    (tmp_path / "walk_0.npz").write_bytes(b"half a file")
    again = collect_snapshots(part, hub, poses, SETTINGS, tmp_path)
    assert np.array_equal(displacement, again.states(np.arange(len(again))))
    assert (tmp_path / "bend.npz").stat().st_mtime_ns == written["bend.npz"]
    assert (tmp_path / "load_0.npz").stat().st_mtime_ns != written["load_0.npz"]


def test_what_a_part_that_relaxes_is_made_of_reads_back_from_its_files(tmp_path):
    plain = synthetic_part((4, 4, 4))
    series = PronySeries((0.1, 0.2), (0.5, 0.05))
    part = PartModel(plain.mesh, plain.material, 0.1, plain.membranes, "cavity", relaxation=series)
    hub, poses = robot_around_a_box()
    collect_snapshots(part, hub, poses, WITHOUT_WALKS, tmp_path)
    written = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    collect_snapshots(part, hub, poses, WITHOUT_WALKS, tmp_path)
    assert written == {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}


def test_blocked_tips_are_a_kind_and_other_files_stay_where_they_are_asked_for_later(tmp_path):
    part, (hub, poses) = synthetic_part((4, 4, 4)), robot_around_a_box()
    collect_snapshots(part, hub, poses, WITHOUT_WALKS, tmp_path)
    written = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    blocked = BlockedSnapshotSettings(count=2, pressure_kPa=30.0)
    asked = dataclasses.replace(WITHOUT_WALKS, blocked=blocked)
    files = collect_snapshots(part, hub, poses, asked, tmp_path)
    assert written == {name: (tmp_path / name).stat().st_mtime_ns for name in written}
    numbers = files.of("blocked")
    np.testing.assert_array_equal(files.pressure_kPa[numbers], [15.0, 30.0])
    assert not set(numbers) & set(files.of("load"))
    tip = part.mesh.node_set("outer_end_face")
    bent = files.states(files.of("bend"))[-1][tip, 2]
    # Their mean by area is 0, so some are above and some below; free, all go one way.
    assert np.ptp(np.sign(bent)) == 0.0
    for held in files.states(numbers)[:, tip, 2]:
        assert held.min() < 0.0 < held.max()


def test_walks_in_other_physics_are_made_again_and_equilibria_are_not(tmp_path):
    part, (hub, poses) = synthetic_part((4, 4, 4)), robot_around_a_box()
    published = collect_snapshots(part, hub, poses, SETTINGS, tmp_path)
    walked = published.states(np.arange(len(published)))[published.of("walk")]
    written = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    undamped = Physics(damping="objective", stiffness_damping_s=0.0, mass_damping_per_s=0.0)
    acting = WalkPhysics(undamped, FullOrderSettings(integrator="implicit_euler"))
    other = collect_snapshots(part, hub, poses, SETTINGS, tmp_path, acting=acting)
    changed = [
        path.name for path in tmp_path.iterdir() if path.stat().st_mtime_ns != written[path.name]
    ]
    assert changed == ["walk_0.npz"]
    there = other.states(np.arange(len(other)))[other.of("walk")]
    assert np.abs(there - walked).max() > 0.01 * np.abs(walked).max()


def test_walks_on_another_hub_or_at_other_places_are_made_again(tmp_path):
    """Equilibria of a single leg are not; nor is a walk of an earlier version, which does not say
    what carried it."""
    part, (hub, poses) = synthetic_part((4, 4, 4)), robot_around_a_box()
    further = [Pose(pose.rotation, 1.1 * pose.translation) for pose in poses]
    soft = SoftHub(PartModel(hub.mesh, Material(500.0, 0.3), 0.05))

    def made_again(hub, poses):
        before = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
        collect_snapshots(part, hub, poses, SETTINGS, tmp_path)
        return [p.name for p in tmp_path.iterdir() if p.stat().st_mtime_ns != before[p.name]]

    collect_snapshots(part, hub, poses, SETTINGS, tmp_path)
    assert made_again(hub, poses) == []
    for other, places in ((RigidHub(hub.mesh, 0.5), poses), (soft, poses), (hub, further)):
        assert made_again(other, places) == ["walk_0.npz"]
        assert made_again(other, places) == []
    old = Snapshots.load(tmp_path / "walk_0.npz")
    del old.metadata["carried"]
    old.save(tmp_path / "walk_0.npz")
    assert made_again(soft, poses) == []


def test_walks_that_failed_are_left_out_and_loads_without_equilibrium_are_told(tmp_path):
    """A walk of the first versions, which does not say how it ended, counts as one that did."""
    details = {
        "load_0": {"failed": [1, 5]},
        "load_1": {"failed": []},
        "walk_0": {"status": "completed"},
        "walk_1": {"status": "diverged"},
        "walk_2": None,
    }
    for name, known in details.items():
        each = some_snapshots("load" if "load" in name else f"walk {name[-1]}.4")
        each.metadata["details"] = known
        each.save(tmp_path / f"{name}.npz")
    files = SnapshotFiles([tmp_path / f"{name}.npz" for name in details])
    sound, told = sound_files(files)
    assert [path.stem for path in sound] == ["load_0", "load_1", "walk_0", "walk_2"]
    walks, loads = told
    assert walks.startswith("1 of the robots that walked for snapshots did not come to the end")
    assert walks.endswith("walk 1.4 (diverged)")
    assert loads == "2 of 10 loads had no equilibrium and are missing among the snapshots"
    assert sound_files(SnapshotFiles(sound[1:3])) == (sound[1:3], [])


def test_blocked_tips_have_the_rotation_of_the_other_equilibria(tmp_path):
    part, (hub, poses) = synthetic_part((4, 4, 4)), robot_around_a_box()
    blocked = BlockedSnapshotSettings(count=1, pressure_kPa=90.0)
    states = {}
    for rotation in ("edge", "polar"):
        static = dataclasses.replace(WITHOUT_WALKS.static, rotation=rotation)
        asked = dataclasses.replace(WITHOUT_WALKS, static=static, blocked=blocked)
        files = collect_snapshots(part, hub, poses, asked, tmp_path)
        states[rotation] = files.states(files.of("blocked"))[0]
        exact = blocked_snapshots(part, blocked, rotation).displacement[0]
        np.testing.assert_array_equal(states[rotation], exact)
    assert np.abs(states["polar"] - states["edge"]).max() > 1e-4


def test_a_corner_is_held_as_long_whatever_the_time_step(tmp_path):
    part, (hub, poses) = synthetic_part((4, 4, 4)), robot_around_a_box()
    plan = walk_plan(SETTINGS.walk, 0, 3)
    steps = {0.01: 2 + 8, 0.005: 2 + 16}
    for step_s, expected in steps.items():
        acting = WalkPhysics(Physics(time_step_s=step_s))
        walked = walk_snapshots(part, hub, poses, SETTINGS.walk, 0, acting)
        assert walked.metadata["details"]["steps"] == expected
        assert plan.step_count(SETTINGS.walk, step_s) == expected


PUBLISHED = WalkSnapshotSettings(robots="all", corner_limit=None, hold_s=1.0)


def test_published_protocol_is_every_subset_on_a_closed_tour_of_every_corner():
    plans = [walk_plan(PUBLISHED, number, 8) for number in range(PUBLISHED.robot_count(8))]
    assert len({tuple(plan.places) for plan in plans}) == 255
    assert {len(plan.places) for plan in plans} == set(range(1, 9))
    for plan in plans:
        assert len({tuple(corner) for corner in plan.corners}) == 2 ** len(plan.places)
        # From the settled robot, all slack, one leg at a time and back to it.
        tour = np.vstack([np.zeros(len(plan.places)), plan.corners])
        assert np.all(np.abs(np.diff(tour, axis=0)).sum(axis=1) == 1)
        assert not plan.corners[-1].any()
    # sum over k legs of C(8, k) (15 + 100 * 2^k), 2^k summed by the binomial theorem.
    assert sum(plan.step_count(PUBLISHED) for plan in plans) == 255 * 15 + 100 * (3**8 - 1)


def test_every_subset_walks_of_a_hub_of_another_number_of_places(tmp_path):
    """It once had to have eight."""
    hub, poses = robot_around_a_box()
    walk = dataclasses.replace(
        SETTINGS.walk, robots="all", corner_limit=1, hold_s=0.02, settling_steps=0, record_every=1
    )
    settings = dataclasses.replace(
        SETTINGS, walk=walk, static=dataclasses.replace(SETTINGS.static, load_count=0)
    )
    part = synthetic_part((4, 4, 4))
    collected = collect_snapshots(part, hub, poses, settings, tmp_path)
    walks = [name for name in collected.sources if name.startswith("walk")]
    subsets = ["0", "1", "0.1", "2", "0.2", "1.2", "0.1.2"]
    assert walks == [f"walk {subset}" for subset in subsets]


def test_every_subset_of_many_places_is_refused_before_anything_walks(tmp_path):
    assert PUBLISHED.robot_count(10) == 1023
    assert WalkSnapshotSettings().robot_count(24) == 6
    hub, poses = robot_around_a_box()
    settings = dataclasses.replace(SETTINGS, walk=PUBLISHED)
    with pytest.raises(ValueError, match="the 4095 subsets of 12 places, expected at most 10"):
        collect_snapshots(synthetic_part((4, 4, 4)), hub, 4 * poses, settings, tmp_path)
    assert not any(tmp_path.iterdir())


def test_a_robot_of_the_published_protocol_on_a_small_part(tmp_path):
    part = synthetic_part((4, 4, 4))
    hub, _ = robot_around_a_box()
    turns = [rotation_about("z", yaw) for yaw in np.arange(8) * 45.0]
    poses = [Pose(turn, turn @ np.array([90.0, 0.0, 0.0])) for turn in turns]
    plain = dataclasses.replace(PUBLISHED, hold_s=0.06, amplitude_kPa=40.0, settling_steps=3)
    number = 0b10010001 - 1  # places 0, 4 and 7
    whole = walk_snapshots(part, hub, poses, plain, number)
    assert whole.sources == ["walk 0.4.7"]
    # Every second of 3 settling steps and 8 corners x 6 steps, of 3 legs.
    assert len(whole) == 3 * ((3 + 8 * 6) // 2)
    # Each leg is driven alone: at the first corner the first leg, pressures in order of the legs.
    pressures = whole.pressure_kPa.reshape(-1, 3)
    assert np.all(pressures[:1] == 0.0)  # settling
    assert np.all(pressures[1:3, 0] > 0.0)
    assert np.all(pressures[:3, 1:] == 0.0)
    compressed = walk_snapshots(
        part, hub, poses, dataclasses.replace(plain, compression=1e-3), number
    )
    assert len(compressed.fields) < 0.7 * len(whole)
    left = (compressed.states(np.arange(len(whole))) - whole.displacement).reshape(len(whole), -1)
    flat = whole.displacement.reshape(len(whole), -1).astype(float)
    stiffness = part.stiffness(part.rest_nodes)
    squares = [np.einsum("sj,js->", each, stiffness @ each.T) for each in (left, flat)]
    assert squares[0] <= (1e-3) ** 2 * squares[1] * 1.01  # single precision


def test_a_walk_that_fails_while_it_settles_is_told_as_diverged(tmp_path, monkeypatch):
    """And does not walk on from where it failed."""
    made, step = [], FullRobot.step

    def failing(robot, state, command):
        made.append(command)
        if len(made) == 2:
            raise StepError("no balance")
        return step(robot, state, command)

    monkeypatch.setattr(FullRobot, "step", failing)
    part, (hub, poses) = synthetic_part((4, 4, 4)), robot_around_a_box()
    walk = dataclasses.replace(SETTINGS.walk, record_every=1)
    walked = walk_snapshots(part, hub, poses, walk, 0)
    assert walked.metadata["details"]["status"] == "diverged"
    assert walked.metadata["details"]["steps"] == 1
    assert len(walked) == 2  # legs after the one step
    assert len(made) == 2
    kept = SnapshotFiles([walked.save(tmp_path / "walk_0.npz")])
    sound, told = sound_files(kept)
    assert sound == []
    assert "(diverged)" in told[0]


def test_walks_that_could_not_be_kept_or_held_are_refused_before_any_work(tmp_path):
    part, (hub, poses) = synthetic_part((4, 4, 4)), robot_around_a_box()
    with pytest.raises(ValueError, match=r"compression must be at least 0 and below 1, got 1\.5"):
        dataclasses.replace(SETTINGS.walk, compression=1.5)
    short = dataclasses.replace(SETTINGS.walk, hold_s=0.004)
    asked = dataclasses.replace(SETTINGS, walk=short)
    with pytest.raises(ValueError, match=r"walk\.hold_s is 0\.004 s, .* time step of 0\.01 s"):
        collect_snapshots(part, hub, poses, asked, tmp_path)
    assert not any(tmp_path.iterdir())
    # Of finer steps there is one that it is held for.
    assert walk_plan(short, 0, 3).commands_kPa(short, 0.004).shape == (2, 2)


def test_more_legs_than_places_are_refused():
    hub, poses = robot_around_a_box()
    part, settings = synthetic_part((4, 4, 4)), WalkSnapshotSettings(leg_counts=(4,))
    with pytest.raises(ValueError, match="must not exceed the 3 places"):
        walk_snapshots(part, hub, poses, settings, 0)


def test_loads_too_strong_to_be_applied_at_once_are_found_all_the_same():
    """Of an empty leg, whose pressure has no steps to halve: forces of 1.3 to 2.5 N that bend it
    by a third of its length."""
    sheet = Membrane("sheet", Material(2e4, 0.3, "st_venant_kirchhoff"), 0.2)
    part = PartModel(
        synthetic_mesh((8, 4, 4)),
        Material(100.0, 0.4, "stable_neo_hookean"),
        0.03,
        (sheet,),
        cavity="cavity",
        mass_lumping="volume",
    )
    settings = StaticSnapshotSettings(load_count=40, load_limit_mN=2500.0, rotation="polar")
    found = load_snapshots(part, settings, [4, 12, 20])
    assert found.metadata["details"] == {"failed": []}
    assert np.all(found.pressure_kPa == 0.0)
    assert np.all(np.abs(found.displacement).max(axis=(1, 2)) > 10.0)
