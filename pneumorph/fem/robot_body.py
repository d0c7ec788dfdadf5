"""The body of a full-order robot: legs of finite elements tied to a hub, above a floor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np

from pneumorph.base.stage_clock import StageClock
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.hub_body import Body, HubBody, HubState
from pneumorph.fem.mounted_leg import MountedLeg
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.trial_step import TrialStep
from pneumorph.geometry.contact_surfaces import ContactSurfaces
from pneumorph.geometry.pose import Pose
from pneumorph.geometry.robot_shape import PlacedPart, RobotShape
from pneumorph.physics.floor import Floor
from pneumorph.physics.leg_contacts import LegContacts
from pneumorph.physics.physics import Physics

_Result = TypeVar("_Result")


class RobotBody(Generic[HubState]):
    """Legs of finite elements tied to a hub, above a floor: all that stays while the robot moves.

    Args:
        hub: What carries the legs.
        mounts: Part, pose in the robot's frame and regulator (counted from 0) of each leg.
        physics: What acts on it.
        numerics: How its steps are computed.
        tracked_point: Point of the hub's frame whose travel is rewarded [mm], (3,); the frame's
            origin by default.
        floor: What it stands on; by default the ground of the physics.
        sites: Number of the site of each leg; None for their own numbers.

    Raises:
        ValueError: No legs, a regulator that does not exist, or friction for a surface that there
            is not.
    """

    def __init__(
        self,
        hub: HubBody[HubState],
        mounts: Sequence[tuple[PartModel, Pose, int | Sequence[int]]],
        physics: Physics | None = None,
        tracked_point: np.ndarray | None = None,
        floor: Floor | None = None,
        numerics: FullOrderSettings | None = None,
        sites: Sequence[int] | None = None,
    ) -> None:
        self.hub = hub
        self.physics = physics or Physics()
        self.numerics = numerics or FullOrderSettings()
        if not mounts:
            raise ValueError("mounts is empty: a robot needs at least one leg")
        self.legs = tuple(MountedLeg(*mount) for mount in mounts)
        self.sites = tuple(range(len(mounts)) if sites is None else sites)
        standing = [leg.contact_weights @ leg.initial_positions() for leg in self.legs]
        standing.append(hub.point_positions(hub.initial_state(), hub.contact_points))
        self.standing_points: np.ndarray = np.concatenate(standing)
        """All contact points at rest in the robot's frame [mm], the hub's last, (point, 3)."""
        self.floor = floor or self.physics.floor(self.standing_points)
        self._start = self.physics.start_pose(self.standing_points)
        for leg in self.legs:
            for regulator in leg.regulators:
                if not 0 <= regulator < self.physics.regulator_count:
                    raise ValueError(
                        f"regulator must be 0 .. {self.physics.regulator_count - 1}, got "
                        f"{regulator}; regulators are counted from 0"
                    )
        chambers = np.zeros(self.physics.regulator_count)
        for leg in self.legs:
            volumes = leg.part.cavity_volumes(leg.part.rest_nodes)
            fed = leg.regulators if len(leg.regulators) > 1 else leg.regulators * len(volumes)
            np.add.at(chambers, list(fed), volumes)
        self.regulators = self.physics.regulators(chambers)
        self.tracked_point: np.ndarray = np.array(
            (0.0, 0.0, 0.0) if tracked_point is None else tracked_point, dtype=float
        )
        self.clock = StageClock()
        """Time spent in ``assembly``, ``factorisation``, ``elimination``, ``friction`` and ``line
        search``."""
        self._threads: ThreadPoolExecutor | None = None
        counts = [leg.contact_count for leg in self.legs]
        self._contact_starts: np.ndarray = np.concatenate([[0], np.cumsum(counts)])
        # Refuses surfaces and areas that there are not.
        self.physics.contact_friction(self.contact_surfaces, np.zeros(self.contact_point_count))

    @cached_property
    def contact_surfaces(self) -> ContactSurfaces:
        """What all contact points lie on: the legs', then the hub's."""
        physics = self.physics
        if not physics.friction_by_surface and physics.friction_pressure.exponent == 0.0:
            return ContactSurfaces.unnamed(self.contact_point_count)  # nobody asks
        return ContactSurfaces.joined(
            [*(leg.part.mesh.contact_surfaces for leg in self.legs), self.hub.contact_surfaces]
        )

    @property
    def settings(self) -> dict[str, Any]:
        """Physics and numerics by name, for what is saved of a rollout."""
        return {**self.physics.described(), **self.numerics.described()}

    @property
    def contact_point_count(self) -> int:
        """All contact points: the legs', then the hub's."""
        return int(self._contact_starts[-1]) + len(self.hub.contact_points)

    def initial_state(self) -> FullRobotState[HubState]:
        """At rest in the pose that the physics start in, no pressure."""
        placed = tuple(self._start.apply(leg.initial_positions()) for leg in self.legs)
        return FullRobotState(
            hub=self.hub.initial_state(self._start),
            positions=placed,
            velocities=tuple(np.zeros_like(leg.part.rest_nodes) for leg in self.legs),
            regulated_kPa=np.zeros(self.physics.regulator_count),
            impulses=np.zeros((self.contact_point_count, 3)),
            contact_velocities=np.zeros((self.contact_point_count, 3)),
            pressure_work_mJ=np.zeros(len(self.legs)),
            memories=tuple(
                leg.part.relaxed(positions)
                for leg, positions in zip(self.legs, placed, strict=True)
            ),
        )

    def tracked_point_mm(self, state: FullRobotState[HubState]) -> np.ndarray:
        """World position of the point whose travel is rewarded [mm], (3,)."""
        position: np.ndarray = self.hub.point_positions(state.hub, self.tracked_point[None])[0]
        return position

    def leg_nodes_in_hub_frame(self, state: FullRobotState[HubState]) -> tuple[np.ndarray, ...]:
        """Nodes of each leg in its own frame, carried by the hub [mm], each (node, 3).

        At rest they are the part's rest nodes; the attachment nodes stay there on a rigid hub.
        """
        rotation, position = self.hub.frame(state.hub)
        carried = Pose(rotation, position).inverse()
        return tuple(
            leg.pose.inverse().apply(carried.apply(x))
            for leg, x in zip(self.legs, state.positions, strict=True)
        )

    def contact_positions(
        self, state: FullRobotState[HubState] | TrialStep[HubState]
    ) -> tuple[np.ndarray, ...]:
        """Where the contact points of each leg, and last the hub's, are [mm], each (point, 3)."""
        legs = (leg.contact_weights @ x for leg, x in zip(self.legs, state.positions, strict=True))
        return (*legs, self.hub.point_positions(state.hub, self.hub.contact_points))

    def contact_velocities(
        self, state: FullRobotState[HubState] | TrialStep[HubState]
    ) -> tuple[np.ndarray, ...]:
        """Velocities of the contact points of each leg, and last the hub's [mm/s], each
        (point, 3)."""
        legs = (leg.contact_weights @ v for leg, v in zip(self.legs, state.velocities, strict=True))
        hub_map = self.hub.point_map(state.hub, self.hub.contact_points)
        return (*legs, (hub_map @ state.hub.velocity).reshape(-1, 3))

    def leg_contacts(self, state: FullRobotState[HubState]) -> LegContacts:
        """What the floor does to the legs' contact points."""
        positions = self.contact_positions(state)[:-1]
        count = sum(len(each) for each in positions)
        frames = self.floor.frames(np.concatenate(positions))
        velocity = np.einsum("pra,pr->pa", frames, state.contact_velocities[:count])
        by_leg = np.split(velocity, self._contact_starts[1:-1])
        step_s, impulses = self.physics.time_step_s, state.impulses[:count]
        return LegContacts.of(self.floor, positions, by_leg, impulses, step_s)

    @cached_property
    def shape(self) -> tuple[RobotShape, np.ndarray | None]:
        """What it looks like, and the skin triangles of its different parts; None where a part has
        no region ``skin``."""
        skins = [leg.part.mesh.surfaces.get("skin") for leg in self.legs]
        legs = [
            PlacedPart(
                leg.part, np.zeros((0, 3)) if skin is None else skin, leg.pose,
                tuple(regulator + 1 for regulator in leg.regulators), site,
                leg.part.cavity_centres_mm,
            )
            for site, leg, skin in zip(self.sites, self.legs, skins, strict=True)
        ]  # fmt: skip
        shape, triangles = RobotShape.of(self.hub.mesh, legs, self.hub.payload_mm)
        return shape, None if any(skin is None for skin in skins) else triangles

    def bodies(self, state: FullRobotState[HubState]) -> list[Body]:
        """Every body of finite elements, legs first and then those of the hub."""
        legs = zip(self.legs, state.positions, state.velocities, strict=True)
        return [*((leg.part, x, v) for leg, x, v in legs), *self.hub.bodies(state.hub)]

    def each_leg(self, function: Callable[[int], _Result]) -> list[_Result]:
        """What a function makes of the number of each leg, by as many threads as are asked for.

        Legs share nothing, so results do not depend on the number of threads.
        """
        numbers = range(len(self.legs))
        if self.numerics.thread_count <= 1:
            return [function(number) for number in numbers]
        if self._threads is None:
            self._threads = ThreadPoolExecutor(self.numerics.thread_count)
        running = [self._threads.submit(function, number) for number in numbers]
        wait(running)  # all of them, so that none goes on behind one that has failed
        return [each.result() for each in running]

    def contact_numbers(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """Numbers among all contact points of the given ones of each body, (contact,)."""
        return np.concatenate(self.contact_numbers_by_body(points))

    def contact_numbers_by_body(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """The same for each body, each (contact of the body,)."""
        return [start + each for start, each in zip(self._contact_starts, points, strict=True)]

    def points_near(self, state: FullRobotState[HubState], time_step_s: float) -> list[np.ndarray]:
        """Points of each body that could reach the floor within a step of this length [s]."""
        near = []
        for position, velocity in zip(
            self.contact_positions(state), self.contact_velocities(state), strict=True
        ):
            normal = self.floor.frames(position)[:, 0]
            speed = np.einsum("pa,pa->p", normal, velocity)
            coming = self.floor.gap(position) + time_step_s * np.minimum(speed, 0.0)
            near.append(np.flatnonzero(coming < self.numerics.contact_margin_mm))
        return near
