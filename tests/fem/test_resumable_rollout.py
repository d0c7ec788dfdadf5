"""A rollout that was interrupted ends as if it had not been."""

import itertools
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.small_robot import small_robot
from helpers.two_chambers import two_chamber_leg

import pneumorph.fem.resumable_rollout as resumable
from pneumorph.base.artefact import ArtefactError, load_artefact, save_artefact
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.resumable_rollout import (
    _identity,
    _unusual_hub_friction,
    resumable_rollout,
)
from pneumorph.fem.rigid_hub import RigidHub, RigidHubState
from pneumorph.fem.state_file import state_from_arrays, state_to_arrays
from pneumorph.physics.floor import HeightField
from pneumorph.physics.physics import Physics

COMMANDS = np.tile([30.0, 10.0], (9, 1))


class Interrupted(Exception):
    """Stands for Ctrl-C."""


@pytest.mark.parametrize("soft", [False, True])
def test_an_interrupted_rollout_goes_on_to_the_same_bits(tmp_path, soft):

    def rolled(checkpoint, stop_at=None, commands=COMMANDS):
        made = []

        def progress(done, total, _):
            made.append(done)
            if done == stop_at:
                raise Interrupted

        way = resumable_rollout(
            small_robot(soft=soft),
            commands,
            checkpoint,
            settling_steps=2,
            record_every=2,
            checkpoint_every_s=0.0,
            progress=progress,
        )
        return way, made

    whole, _ = rolled(tmp_path / "whole.npz")
    checkpoint = tmp_path / "cut.npz"
    with pytest.raises(Interrupted):
        rolled(checkpoint, stop_at=6)
    assert checkpoint.exists()
    resumed, made = rolled(checkpoint)
    assert made[0] == 6  # four steps, two frames, were saved; the sixth step was not
    assert not checkpoint.exists()
    for name, value in whole.arrays().items():
        np.testing.assert_array_equal(resumed.arrays()[name], value, err_msg=name)
    assert resumed.metadata == whole.metadata
    with pytest.raises(Interrupted):
        rolled(checkpoint, stop_at=6)
    _, made = rolled(checkpoint, commands=COMMANDS + 1.0)
    assert made[0] == 2  # other commands start anew


def test_a_kept_checkpoint_is_left_until_the_way_is_saved(tmp_path):
    """A process that ends before it has saved the way goes on from there, to the same bits."""
    checkpoint, made = tmp_path / "kept.npz", []

    def rolled(**keep):
        made.clear()
        return resumable_rollout(
            small_robot(),
            COMMANDS,
            checkpoint,
            settling_steps=2,
            record_every=2,
            checkpoint_every_s=0.0,
            progress=lambda done, *_: made.append(done),
            **keep,
        )

    whole = rolled(keep_checkpoint=True)
    assert made == [2, 4, 6, 8, 9]
    again = rolled(keep_checkpoint=True)
    assert made == [9]
    assert checkpoint.exists()
    for name, value in whole.arrays().items():
        np.testing.assert_array_equal(again.arrays()[name], value, err_msg=name)
    rolled()
    assert not checkpoint.exists()


def test_the_time_of_all_that_was_stopped_is_told(tmp_path, monkeypatch):
    """Where each look at the clock takes a second: as many as there were in both."""
    seconds, earlier_s = itertools.count(), []
    monkeypatch.setattr(resumable, "time", SimpleNamespace(monotonic=lambda: float(next(seconds))))

    def stop(done, total, _):
        if done == 4 + 2 * len(earlier_s):
            raise Interrupted

    def rolled():
        with pytest.raises(Interrupted):
            resumable_rollout(
                small_robot(),
                COMMANDS,
                tmp_path / "cut.npz",
                settling_steps=2,
                record_every=2,
                checkpoint_every_s=0.0,
                progress=stop,
                resumed=earlier_s.append,
            )
        return float(next(seconds))

    first = rolled()
    assert not earlier_s
    second = rolled() - first
    rolled()
    # What a process looks at after its last checkpoint is lost.
    assert 0.0 < earlier_s[0] < first
    assert earlier_s[0] < earlier_s[1] < earlier_s[0] + second
    with_clock = load_artefact(tmp_path / "cut.npz", "FullRollout", 1)[1]["spent_s"]
    assert with_clock > earlier_s[1]


def without(place, content):
    """JSON values without the one at a place."""
    name, *below = place
    if not below:
        return {key: value for key, value in content.items() if key != name}
    return content | {name: without(below, content[name])}


def changed(place, value, content):
    name, *below = place
    return content | {name: changed(below, value, content[name]) if below else value}


@pytest.mark.parametrize(
    ("place", "value", "what"),
    [
        *((place, None, rf"required field missing @ \$\.{place[-1]}") for place in (
            ("identity",), ("done",), ("way",), ("way", "contact"), ("way", "steps"))),
        (("way", "steps", "count"), None, r"required field missing @ \$\.steps\.count"),
        (("way", "contact", "unconverged_share"), None, r"\$\.contact\.unconverged_share"),
        (("done",), 4.0, r"expected int @ \$\.done"),
        (("done",), -4, "done is -4, expected one of the 9 steps"),
        (("done",), 9, "done is 9, expected one of the 9 steps"),
        (("identity",), 3, r"expected str @ \$\.identity"),
        (("way", "steps", "mean_iterations"), "two", r"expected float @ \$\.steps\.mean_it"),
    ],
)  # fmt: skip
def test_a_checkpoint_with_damaged_metadata_is_refused_with_file_and_field(
    tmp_path, place, value, what
):
    def rolled(checkpoint, progress=None):
        settings = {"settling_steps": 2, "record_every": 2, "checkpoint_every_s": 0.0}
        return resumable_rollout(small_robot(), COMMANDS, checkpoint, progress=progress, **settings)

    def stop(done, total, _):
        if done == 4:
            raise Interrupted

    checkpoint = tmp_path / "cut.npz"
    with pytest.raises(Interrupted):
        rolled(checkpoint, stop)
    arrays, header = load_artefact(checkpoint, "FullRollout", 1)
    header = without(place, header) if value is None else changed(place, value, header)
    save_artefact(checkpoint, "FullRollout", 1, arrays, header)
    with pytest.raises(ArtefactError, match=rf"cut\.npz cannot be read \(.*{what}"):
        rolled(checkpoint)


def test_who_watches_is_told_the_whole_way_also_of_a_resumed_rollout(tmp_path):
    told = []

    def rolled(watch):
        return resumable_rollout(
            small_robot(),
            COMMANDS,
            tmp_path / "checkpoint.npz",
            settling_steps=2,
            record_every=2,
            description={"design": "a"},
            checkpoint_every_s=0.0,
            watch=watch,
        )

    def stop_at_the_third(piece):
        told.append(piece)
        if len(told) == 3:
            raise Interrupted

    with pytest.raises(Interrupted):
        rolled(stop_at_the_third)
    resumed = []
    whole = rolled(resumed.append)
    # Three pieces of two steps are four frames; the last piece has a single step.
    for pieces, count in ((told, 4), (resumed, len(whole.time_s))):
        # A piece begins with the last frame of the one before it.
        starts = [0 if number == 0 else 1 for number in range(len(pieces))]
        times = np.concatenate([p.time_s[s:] for p, s in zip(pieces, starts, strict=True)])
        points = [p.tracked_point_mm[s:] for p, s in zip(pieces, starts, strict=True)]
        np.testing.assert_allclose(times, whole.time_s[:count], rtol=1e-12)
        np.testing.assert_array_equal(np.concatenate(points), whole.tracked_point_mm[:count])
        assert all(piece.metadata["design"] == "a" for piece in pieces)


@dataclass(frozen=True, eq=False)
class CountedState(RigidHubState):
    """A state that the package does not know."""

    steps: np.ndarray


class CountedHub(RigidHub):
    """A hub of one's own, which counts its steps."""

    def initial_state(self, start=None):
        return CountedState(**vars(super().initial_state(start)), steps=np.zeros(1))

    def advance(self, state, velocity, step):
        moved = super().advance(state, velocity, step)
        return CountedState(**vars(moved), steps=state.steps + 1.0)


def test_the_state_of_a_hub_of_ones_own_is_restored():
    robot = small_robot()
    vars(robot)["hub"] = CountedHub(box_mesh((16.0, 16.0, 9.0), (2, 2, 1)), 0.03)
    state = robot.step(robot.initial_state(), COMMANDS[0])
    restored = state_from_arrays(robot, state_to_arrays(state))
    assert type(restored.hub) is CountedState
    assert restored.hub.steps == 1.0
    after = [robot.step(each, COMMANDS[1]) for each in (state, restored)]
    for name, value in state_to_arrays(after[0]).items():
        np.testing.assert_array_equal(state_to_arrays(after[1])[name], value, err_msg=name)


def test_a_state_of_another_robot_is_refused():
    arrays = state_to_arrays(small_robot(soft=True).initial_state())
    with pytest.raises(ArtefactError, match="hub_centre of the saved state must have shape"):
        state_from_arrays(small_robot(soft=False), arrays)


def test_another_robot_does_not_go_on_from_the_checkpoint(tmp_path):
    """What settings and meshes do not show decides as well: masses, the hub, the floor."""
    usual = small_robot()
    lumped = small_robot()
    lumped.legs[0].part.node_mass[0] *= 2.0
    heavy = small_robot()
    heavy.hub.mass_kg *= 2.0
    wavy, flat = (small_robot() for _ in range(2))
    wavy.floor = HeightField(lambda x, y: np.sin(0.1 * x) + 0.0 * y)
    flat.floor = HeightField(lambda x, y: 0.0 * x)
    tracked = small_robot()
    tracked.tracked_point = tracked.tracked_point + 1.0
    soft = small_robot(soft=True)
    robots = (usual, lumped, heavy, wavy, flat, tracked, soft)
    assert len({_identity(robot, COMMANDS, 2, 2) for robot in robots}) == len(robots)
    assert _identity(small_robot(), COMMANDS, 2, 2) == _identity(usual, COMMANDS, 2, 2)


def test_a_robot_with_one_of_its_chambers_does_not_go_on_from_the_checkpoint():
    """The mesh has them all, whatever is inflated."""
    both = two_chamber_leg()
    legs = [
        PartModel(both.mesh, both.material, both.mass_kg, both.membranes, (name,))
        for name in ("cavity_left", "cavity_right")
    ]
    identities = {_identity(small_robot(leg=leg), COMMANDS, 2, 2) for leg in legs}
    assert len(identities) == 2


def on_surface(name, bottom):
    """The small robot whose hub's points lie on a surface of this name, with its friction on its
    legs' bottoms."""
    usual = small_robot()
    hub = RigidHub(usual.hub.mesh, 0.03, usual.hub.contact_points, name)
    mounts = [(leg.part, leg.pose, leg.regulators) for leg in usual.legs]
    given = (("bottom", bottom),)
    physics = Physics(floor_height_mm=0.0, regulator_count=2, friction_by_surface=given)
    return FullRobot(hub, mounts, physics, usual.tracked_point)


def test_a_hub_of_other_friction_does_not_go_on_from_the_checkpoint():
    """Settings name coefficients, not which of them the hub has. A hub of the surface ``hub`` has
    the identity of checkpoints that do not tell, and so has one whose surface makes no difference.
    """
    identities = {
        (name, bottom): _identity(on_surface(name, bottom), COMMANDS, 2, 2)
        for name in ("hub", "bottom")
        for bottom in (0.4, Physics().friction)
    }
    assert identities["hub", 0.4] != identities["bottom", 0.4]
    usual = Physics().friction
    assert identities["hub", usual] == identities["bottom", usual]
    for robot in (on_surface("hub", 0.4), small_robot(), small_robot(soft=True)):
        assert _unusual_hub_friction(robot) is None


def test_without_commands_there_is_the_settled_frame(tmp_path):
    """As of reduced robots: one frame, which is told like any piece."""
    robot, told = small_robot(), []
    way = resumable_rollout(
        robot, COMMANDS[:0], tmp_path / "checkpoint.npz", settling_steps=2, watch=told.append
    )
    assert way.status == "completed"
    np.testing.assert_array_equal(way.time_s, [0.0])
    settled = robot.tracked_point_mm(robot.settled_state(2))
    np.testing.assert_array_equal(way.tracked_point_mm, settled[None])
    assert len(told) == 1
    assert not (tmp_path / "checkpoint.npz").exists()
