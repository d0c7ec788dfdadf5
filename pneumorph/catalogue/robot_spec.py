"""A robot's specification: everything that decides how any of its designs moves.

One specification answers for both models: `RobotSpec.reduced` and `RobotSpec.full` return robots
that `pneumorph.simulation.rollout.rollout` runs alike, and `RobotSpec.simulator` many side by side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.hub_spec import HubModel, HubSpec
from pneumorph.catalogue.module import Module
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.height_map import HeightMap
from pneumorph.geometry.pose import Pose
from pneumorph.physics.calibration import Calibration, describe_calibration
from pneumorph.physics.physics import Physics
from pneumorph.physics.regulators import Regulators
from pneumorph.robot.design import Design
from pneumorph.robot.mounting_angle import tilted
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.robot_air import chambers_of, regulators_of
from pneumorph.simulation.stepper_settings import StepperSettings
from pneumorph.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Site:
    """A place for a module: where it sits in the robot's frame, and what is mounted there."""

    pose: Pose
    module: Module


@dataclass(frozen=True, eq=False)
class RobotSpec:
    """A hub with sites, and the physics it lives in; a `Design` says which sites carry a module.

    Attributes:
        hub: What carries the modules.
        sites: A site for each entry of a design.
        physics: What acts on the robot, the same in both models.
        stepper: How reduced robots are computed.
        full_order: How full-order robots are computed.
        hub_model: The hub of full-order robots: of finite elements, or rigid.
        height_map: Floor of full-order robots that is no plane.
        thread_count: Threads of a simulator; 0 takes every processor.
        calibration: What was measured of the robot and is part of physics and modules already; see
            `calibrated`.
        mounting_angle_deg: How much further down modules point than their sites have it [degrees].
    """

    hub: HubSpec
    sites: tuple[Site, ...]
    physics: Physics = field(default_factory=Physics)
    stepper: StepperSettings = field(default_factory=StepperSettings)
    full_order: FullOrderSettings = field(default_factory=FullOrderSettings)
    hub_model: HubModel = "soft"
    height_map: HeightMap = field(default_factory=HeightMap)
    thread_count: int = 0
    calibration: Calibration | None = None
    mounting_angle_deg: float = 0.0

    def __post_init__(self) -> None:
        if not self.sites:
            raise ValueError("sites is empty, expected one site for each entry of a design")
        if self.thread_count < 0:
            raise ValueError(
                f"thread_count is {self.thread_count}, expected 0 for every processor, or more"
            )

    def assembly(self, design: Design | str) -> Robot:
        """The rigid hub of a design with its reduced modules.

        Raises:
            ValueError: The design has another number of locations than the robot has sites.
        """
        design = self._known(design)
        mounts = []
        for location, regulator in design.legs:
            site = self.sites[location]
            part = site.module.reduced
            pose = tilted(site.pose, part.rest_nodes, self.mounting_angle_deg)
            mounts.append(Mount(part, pose, (regulator - 1,) * part.cavity_count))
        return Robot(self.hub.rigid, tuple(mounts), design)

    def reduced(
        self, design: Design | str, watch: Callable[[Trajectory], None] | None = None
    ) -> ReducedRobot:
        """The reduced robot of a design.

        Args:
            design: The design, or its text such as ``1.0.0.2.2.0.0.1``.
            watch: Told every recorded frame as it is simulated.

        Raises:
            ValueError: The floor is a height map, which only full robots walk on.
        """
        self.check_plane()
        return ReducedRobot(self.assembly(design), self.physics, self.stepper, watch)

    def full(self, design: Design | str) -> FullRobot:
        """The finite elements that the reduced robot of a design stands for."""
        design = self._known(design)
        mounts = []
        for location, regulator in design.legs:
            site = self.sites[location]
            part = site.module.full
            pose = tilted(site.pose, part.rest_nodes, self.mounting_angle_deg)
            mounts.append((part, pose, regulator - 1))
        return FullRobot(
            self.hub.full(self.hub_model),
            mounts,
            self.physics,
            self.hub.tracked_point,
            self.height_map.floor(self.physics.floor_height_mm),
            self.full_order,
        )

    def simulator(self, robots: Sequence[Robot | Design | str]) -> BatchedSimulator:
        """Reduced robots side by side, given as designs or as what `assembly` made of them; raises
        as `reduced`."""
        self.check_plane()
        assembled = [each if isinstance(each, Robot) else self.assembly(each) for each in robots]
        return BatchedSimulator(assembled, self.physics, self.stepper, self.thread_count)

    def check_plane(self) -> None:
        """Refuse a floor that reduced robots cannot walk on.

        Raises:
            ValueError: The floor is a height map.
        """
        if self.height_map.path is not None:
            raise ValueError(
                f"height_map is {self.height_map.path}, expected none for reduced robots: they "
                "walk on a plane, and only full ones on a floor of heights"
            )

    def scaled(
        self,
        modulus_factor: float = 1.0,
        mass_factor: float = 1.0,
        damping_factor: float = 1.0,
    ) -> RobotSpec:
        """The same robot of stiffer or heavier modules, or of some that relax more; the hub's mass
        is scaled with theirs."""
        if modulus_factor == mass_factor == damping_factor == 1.0:
            return self
        modules = {
            module: module.scaled(modulus_factor, mass_factor, damping_factor)
            for module in {site.module for site in self.sites}
        }
        sites = tuple(Site(site.pose, modules[site.module]) for site in self.sites)
        return replace(self, hub=self.hub.scaled(mass_factor), sites=sites)

    def calibrated(self, calibration: Calibration) -> RobotSpec:
        """The robot as measured: its physics and the stiffness of its modules."""
        return replace(
            self.scaled(calibration.modulus_factor or 1.0),
            physics=calibration.applied_to(self.physics),
            calibration=calibration,
        )

    def in_world(self, world: World) -> RobotSpec:
        """The robot in a drawn world, as finite elements or reduced; the regulators' lag is the
        command's, and a reduction that the world names is seen to by `simulator_in_worlds`."""
        scaled = self.scaled(world.modulus_factor, world.mass_factor, world.damping_factor)
        return replace(
            scaled,
            physics=world.applied_to(self.physics),
            mounting_angle_deg=self.mounting_angle_deg + world.mounting_angle_deg,
        )

    @cached_property
    def module(self) -> Module:
        """The module of all sites.

        Raises:
            ValueError: The sites have different ones.
        """
        kinds = {site.module for site in self.sites}
        if len(kinds) > 1:
            names = ", ".join(sorted(module.name for module in kinds))
            raise ValueError(f"the robot has modules {names}, expected one kind for this")
        return next(iter(kinds))

    def regulators(self, design: Design | str) -> Regulators:
        """The regulators of a design, with the chambers of its legs."""
        return regulators_of(self.assembly(design), self.physics)

    def chambers_mm3(self, design: Design | str) -> tuple[float, ...]:
        """Volume of all chambers of each regulator of a design without pressure [mm^3]."""
        return tuple(
            float(each) for each in chambers_of(self.assembly(design), self.physics.regulator_count)
        )

    def weight_mN(self, design: Design | str) -> float:
        """Weight of the reduced robot of a design [mN]."""
        robot = self.assembly(design)
        mass = robot.hub.mass + sum(mount.part.mass for mount in robot.mounts)
        return float(mass * self.physics.gravity_mm_per_s2)

    @property
    def settings(self) -> dict[str, Any]:
        """Physics and numerics of reduced robots by name, for what is saved of a run."""
        return {**self.physics.described(), **settings_to_dict(self.stepper)}

    def describe(self, reduced: bool = True) -> dict[str, Any]:
        """Physics, calibration and, of reduced robots, the module, for a summary."""
        used = {"leg": self.module.describe()} if reduced else {}
        return {
            "physics": self.physics,
            "damping": self.physics.damping,
            "calibration": describe_calibration(self.calibration, self.physics.pressure_map),
            **used,
        }

    def _known(self, design: Design | str) -> Design:
        design = Design.parse(design) if isinstance(design, str) else design
        if design.location_count != len(self.sites):
            raise ValueError(
                f"design {design} has {design.location_count} locations, expected "
                f"{len(self.sites)}: one for each site of the robot"
            )
        return design
