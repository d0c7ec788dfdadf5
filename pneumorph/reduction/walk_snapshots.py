"""Snapshots of legs that carry a robot: a walk over the corners of the pressure hypercube.

The paper's protocol (sections IV-B and IV-C): 256 designs, one for each subset of the eight places,
every leg on a regulator of its own; pressures visit the corners of the hypercube
{0, amplitude}^legs one after another; legs are recorded at fixed intervals and brought into a
common frame. What the paper leaves open is decided here:

- Corners follow the reflected Gray code, so that one leg changes at a time, from the settled robot
  with all legs slack through every corner and back to the first; legs in the order of their places.
- A corner is held for 1 s: 16 corners of four legs then last the 16 s of the prescribed animations.
- The empty subset has no leg to record, so 255 robots walk; 2^n - 1 of a hub of n places.
- The common frame is the leg's own, carried by the hub; the published one stays where it was at the
  start, and holds for small turns only (`reproduce/frame`).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone, NotNegative, Positive
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.hub_body import HubBody
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.pose import Pose
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.compressed_snapshots import CompressedSnapshots
from pneumorph.reduction.leg_recorder import LegRecorder
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.reduction.tolerance import ToleranceOrNone

_MOST_PLACES = 10
"""Of a hub whose every subset walks: with each further place a tour of all corners takes more than
three times as long, days on one processor with the paper's eight."""


@dataclass(frozen=True)
class WalkSnapshotSettings(Checked):
    """Which robots walk for snapshots, and how far."""

    robots: Literal["drawn", "all"] = "drawn"
    """`drawn`: robots with as many legs as --snapshots.walk.leg-counts says, at drawn places.
    `all`: one robot for each subset of the hub's places, except the empty one."""
    leg_counts: tuple[Count, ...] = (2, 3, 4, 4, 5, 6)
    """Number of legs of each drawn robot."""
    corner_limit: Count | None = 8
    """Corners of the pressures that each robot visits, along a Gray code with its legs in drawn
    order. None: all of them, in a closed tour."""
    hold_s: Positive = 0.8
    """How long each corner's pressures are held [s]."""
    amplitude_kPa: NotNegative = 350.0
    """Simulated pressure of an inflated leg [kPa]."""
    pressure_rate_kPa_per_s: Positive = 612.0
    """How fast the simulated pressure changes [kPa/s]. The default is 4.08 times the regulators'
    150 kPa/s."""
    settling_steps: CountOrNone = 15
    """Time steps at zero pressure before the walk."""
    record_every: Count = 2
    """Time steps between snapshots."""
    compression: ToleranceOrNone = 0.0
    """Relative error, in the norm of the rest stiffness, at which a robot's snapshots are stored as
    combinations of few fields; 0 stores each in single precision."""
    seed: CountOrNone = 0
    """Seed of places and orders."""

    def robot_count(self, place_count: int) -> int:
        """Number of robots that walk.

        Args:
            place_count: Places for legs on their hub.

        Raises:
            ValueError: Every subset is to walk, of more places than can be waited for.
        """
        if self.robots == "drawn":
            return len(self.leg_counts)
        if place_count > _MOST_PLACES:
            raise ValueError(
                f"robots 'all' are the {2**place_count - 1} subsets of {place_count} places, "
                f"expected at most {_MOST_PLACES} places: they would walk for days; let robots "
                "with legs at drawn places walk instead (snapshots.walk.robots drawn)"
            )
        return 2**place_count - 1


@dataclass(frozen=True)
class WalkPhysics:
    """What acts on walking robots, and how their steps are computed; as published by default."""

    physics: Physics = field(default_factory=Physics)
    """Regulators and pressure map are the protocol's."""
    numerics: FullOrderSettings = field(default_factory=FullOrderSettings)

    def described(self) -> dict[str, Any]:
        """Settings by name; none of the published ones, of which earlier snapshots were."""
        if self == WalkPhysics():
            return {}
        return {"physics": self.physics.described(), "numerics": self.numerics.by_name()}


@dataclass(frozen=True, eq=False)
class WalkPlan:
    """Where the legs of one robot are and which corners they visit."""

    places: np.ndarray
    """(leg,)"""
    corners: np.ndarray
    """0 slack, 1 inflated, (corner, leg)."""

    def step_count(
        self, settings: WalkSnapshotSettings, time_step_s: float = Physics.time_step_s
    ) -> int:
        """Steps of the walk, settling included, each of a length [s].

        Raises:
            ValueError: Pressures are held for no step.
        """
        return settings.settling_steps + len(self.corners) * _hold_steps(settings, time_step_s)

    def commands_kPa(
        self, settings: WalkSnapshotSettings, time_step_s: float = Physics.time_step_s
    ) -> np.ndarray:
        """Simulated pressure of every step, of a length [s], after settling [kPa], (step, leg).

        Raises:
            ValueError: Pressures are held for no step.
        """
        held = _hold_steps(settings, time_step_s)
        return settings.amplitude_kPa * np.repeat(self.corners, held, axis=0)


def walk_plan(settings: WalkSnapshotSettings, number: int, place_count: int) -> WalkPlan:
    """The plan of one of the settings' robots.

    Raises:
        ValueError: More legs than places.
    """
    if settings.robots == "all":
        places = np.flatnonzero(((number + 1) >> np.arange(place_count)) & 1)
        order = np.arange(len(places))
    else:
        leg_count = settings.leg_counts[number]
        if leg_count > place_count:
            raise ValueError(
                f"leg_counts must not exceed the {place_count} places of the robot, got {leg_count}"
            )
        rng = np.random.default_rng([settings.seed, number])
        places = np.sort(rng.choice(place_count, leg_count, replace=False))
        order = rng.permutation(leg_count)
    corners = gray_corners(len(places))
    if settings.corner_limit is None:
        return WalkPlan(places, np.roll(corners, -1, axis=0)[:, order])
    return WalkPlan(places, corners[1 : settings.corner_limit + 1, order])


def walk_snapshots(
    part: PartModel,
    hub: HubBody,
    poses: Sequence[Pose],
    settings: WalkSnapshotSettings,
    number: int,
    acting: WalkPhysics | None = None,
) -> Snapshots | CompressedSnapshots:
    """Let one full-order robot walk and record its legs in their own frames.

    On a rigid hub a leg's attachment rests in its frame whatever the robot does; on a soft one it
    moves with the hub's deformation. A robot that fails while it settles does not walk; what it did
    is told as of one that fails later.

    Args:
        part: The leg.
        hub: What carries the legs.
        poses: Places for legs in the robot's frame.
        settings: Robots and pressures.
        number: Which of the settings' robots.
        acting: What acts on it; None for the published physics.

    Raises:
        ValueError: More legs than places, or pressures that are held for no step.
    """
    plan = walk_plan(settings, number, len(poses))
    if len(part.cavities) > 1:
        # One robot after the other with all cavities of each leg inflated, then each alone.
        every = np.ones(len(part.cavities))
        directions = np.vstack([every, np.diag(every)])
        part = part.inflated_in(directions[number % len(directions)])
    robot = walking_robot(part, hub, poses, settings, plan, acting)
    commands = plan.commands_kPa(settings, robot.physics.time_step_s)
    recorder = LegRecorder(robot, settings.record_every, settings.compression)
    # A robot falls and lands at first: where friction takes hold then decides how it stands.
    rest = np.zeros((settings.settling_steps, len(plan.places)))
    start, trajectory = robot.rollout(
        robot.initial_state(), rest, len(rest) or 1, record_nodes=False, observe=recorder
    )
    if trajectory.status == "completed":
        _, trajectory = robot.rollout(
            start, commands, record_every=len(commands), record_nodes=False, observe=recorder
        )
    return recorder.snapshots(f"walk {'.'.join(map(str, plan.places))}", trajectory)


def leg_step_seconds(
    part: PartModel,
    hub: HubBody,
    poses: Sequence[Pose],
    settings: WalkSnapshotSettings,
    acting: WalkPhysics | None = None,
    step_count: int = 3,
) -> float:
    """Measure the processor time of a step, divided by its legs [s].

    The middle robot of the settings lands and inflates.
    """
    numbers = range(settings.robot_count(len(poses)))
    plans = [walk_plan(settings, number, len(poses)) for number in numbers]
    plan = sorted(plans, key=lambda each: len(each.places))[len(plans) // 2]
    robot = walking_robot(part, hub, poses, settings, plan, acting)
    state = robot.initial_state()
    start = time.process_time()
    for _ in range(step_count):
        state = robot.step(state, settings.amplitude_kPa * plan.corners[0])
    return (time.process_time() - start) / (step_count * len(plan.places))


def walking_robot(
    part: PartModel,
    hub: HubBody,
    poses: Sequence[Pose],
    settings: WalkSnapshotSettings,
    plan: WalkPlan,
    acting: WalkPhysics | None = None,
) -> FullRobot:
    """The robot of a plan, each leg on a regulator of its own that works in simulated kPa."""
    acting = acting or WalkPhysics()
    physics = replace(
        acting.physics,
        regulator_count=len(plan.places),
        pressure_map=PressureMap(1.0, 0.0),
        pressure_rate_kPa_per_s=settings.pressure_rate_kPa_per_s,
    )
    mounts = [(part, poses[place], leg) for leg, place in enumerate(plan.places)]
    return FullRobot(hub, mounts, physics, numerics=acting.numerics)


def _hold_steps(settings: WalkSnapshotSettings, time_step_s: float) -> int:
    held = round(settings.hold_s / time_step_s)
    if held < 1:
        raise ValueError(
            f"snapshots.walk.hold_s is {settings.hold_s:g} s, expected more than half a time step "
            f"of {time_step_s:g} s: rounded to whole steps no corner's pressures would be held"
        )
    return held


def gray_corners(dimension: int) -> np.ndarray:
    """Corners of the unit hypercube in Gray order, (2^dimension, dimension)."""
    number = np.arange(2**dimension)
    gray = number ^ (number >> 1)
    corners: np.ndarray = (gray[:, None] >> np.arange(dimension)) & 1
    return corners
