"""A robot's specification: everything that decides how any of its designs moves.

One specification answers for both models: `RobotSpec.reduced` and `RobotSpec.full` return robots
that `pneumorph.simulation.rollout.rollout` runs alike, and `RobotSpec.simulator` many side by side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.executor import ExecutorSettings
from pneumorph.base.machine import processor_count
from pneumorph.base.notebook import ShownInNotebooks
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.calibration_check import calibration_note, check_calibration
from pneumorph.catalogue.floor_check import (
    check_above_floor,
    check_near_floor,
    check_payload_above_floor,
)
from pneumorph.catalogue.hub_spec import HubModel, HubSpec
from pneumorph.catalogue.kin_surfaces import surfaces_of, without_idle_surfaces
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_mass import RobotMass, robot_mass
from pneumorph.catalogue.site import Site
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.full_robot import FullRobot
from pneumorph.geometry.pose import Pose
from pneumorph.physics.calibration import Calibration, describe_calibration
from pneumorph.physics.open_loop_gait import OpenLoopGait, commands_of
from pneumorph.physics.physics import Physics
from pneumorph.physics.regulators import Regulators
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.robot.design import Design, module_letter
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.mounting_angle import tilted
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import Randomisation, World
from pneumorph.simulation.randomised_simulator import LaggingSimulator, simulator_in_worlds
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.robot_air import chambers_of, regulators_of
from pneumorph.simulation.shared_simulator import SharedSimulator
from pneumorph.simulation.stepper_settings import StepperSettings
from pneumorph.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class RobotSpec(ShownInNotebooks):
    """A hub with sites, and the physics it lives in; a `Design` says which sites carry a module.

    Attributes:
        hub: What carries the modules.
        sites: A site for each entry of a design.
        physics: What acts on the robot, the same in both models.
        stepper: How reduced robots are computed.
        full_order: How full-order robots are computed.
        hub_model: The hub of full-order robots: of finite elements, or rigid.
        thread_count: Threads of a simulator; 0 takes every processor.
        executor: Where robots that walk side by side, and finite elements, are computed.
        calibration: What was measured of the robot and is part of physics and modules already; see
            `calibrated`.
        mounting_angle_deg: How much further down modules point than their sites have it, however
            they are rolled [degrees]; see `pneumorph.robot.mounting_angle`.
        name: What it is called; None for the paper's robot.
        allowed_designs: Those that its description allows; None where none says it. Others can be
            made all the same.
    """

    hub: HubSpec
    sites: tuple[Site, ...]
    physics: Physics = field(default_factory=Physics)
    stepper: StepperSettings = field(default_factory=StepperSettings)
    full_order: FullOrderSettings = field(default_factory=FullOrderSettings)
    hub_model: HubModel = "soft"
    thread_count: int = 0
    executor: ExecutorSettings = field(default_factory=ExecutorSettings)
    calibration: Calibration | None = None
    mounting_angle_deg: float = 0.0
    name: str | None = None
    allowed_designs: DesignSpace | None = None

    def __post_init__(self) -> None:
        if not self.sites:
            raise ValueError("sites is empty, expected one site for each entry of a design")
        if self.thread_count < 0:
            raise ValueError(
                f"thread_count is {self.thread_count}, expected 0 for every processor, or more"
            )
        if self.hub.payload is not None:
            check_payload_above_floor(self.hub.payload.place_mm, self.physics)

    def __repr__(self) -> str:
        name = self.name or "the paper's"
        modules = ", ".join(module.name for module in self.modules)
        return (
            f"RobotSpec({name}: {len(self.sites)} sites, "
            f"{self.physics.regulator_count} regulators, modules {modules})"
        )

    def assembly(self, design: Design | str) -> Robot:
        """The rigid hub of a design with its reduced modules.

        Raises:
            ValueError: The design has another number of locations than the robot has sites, or
                another number of regulators for a module than it has cavities, or the robot
                begins inside the floor.
        """
        design = self._known(design)
        mounts: list[Mount] = []
        for fitting, mounted in zip(design.fittings, self._mounted(design), strict=True):
            module, pose, regulators = mounted
            site = self.sites[fitting.location].name or fitting.location
            driven = module.driven_by(regulators, f"design {design}", site)
            pose = tilted(pose, module.reduced.rest_nodes, self.mounting_angle_deg)
            mounts.append(Mount(module.reduced, pose, driven))
        robot = Robot(self.hub.rigid, tuple(mounts), design, self._kin_surfaces)
        self._check_above_floor(robot.standing_points, design)
        return robot

    def reduced(
        self, design: Design | str, watch: Callable[[Trajectory], None] | None = None
    ) -> ReducedRobot:
        """The reduced robot of a design.

        Args:
            design: The design, or its text such as ``1.0.0.2.2.0.0.1``.
            watch: Told every recorded frame as it is simulated.

        Raises:
            FileNotFoundError: No file of the ground.
            ValueError: It is no grid of heights.
        """
        return ReducedRobot(self.assembly(design), self.physics, self.stepper, watch)

    def full(self, design: Design | str) -> FullRobot:
        """The finite elements that the reduced robot of a design stands for.

        Raises:
            ValueError: As `assembly`.
        """
        design, mounts = self._known(design), []
        for module, pose, regulators in self._mounted(design):
            pose = tilted(pose, module.full.rest_nodes, self.mounting_angle_deg)
            mounts.append((module.full, pose, regulators))
        robot = FullRobot(
            self.hub.full(self.hub_model),
            mounts,
            without_idle_surfaces(self.physics, self.hub, mounts, self.modules),
            self.hub.tracked_point,
            None,
            self.full_order,
            [each.location for each in design.fittings],
        )
        self._check_above_floor(robot.standing_points, design)
        return robot

    def walking_alone(self) -> RobotSpec:
        """The robot whose finite elements share out their legs over every processor, where nobody
        said over how many threads: no other walks beside it. What it does depends on none of it."""
        if self.full_order.thread_count > 0:
            return self
        shared = replace(self.full_order, thread_count=processor_count())
        return replace(self, full_order=shared)

    def check_near_floor(self) -> None:
        """Refuse a floor so far below that designs would fall before they walk.

        Raises:
            ValueError: It is; see `pneumorph.catalogue.floor_check.check_near_floor`.
        """

        def legs() -> list[np.ndarray]:
            return [
                site.pose_of(module).apply(module.reduced.contact_points)
                for site in self.sites
                for module in site.modules
            ]

        check_near_floor(self.hub.mesh.nodes, legs, self.physics)

    def _check_above_floor(self, points: np.ndarray, design: Design) -> None:
        """Refuse a design that begins inside the floor, or carries its payload below it."""
        if self.hub.payload is not None:
            check_payload_above_floor(self.hub.payload.place_mm, self.physics, points)
        if self.mounting_angle_deg == 0.0:  # drawn ones may press a leg's tip on the floor
            check_above_floor(points, design, self.physics)

    def simulator(self, robots: Sequence[Robot | Design | str]) -> BatchedSimulator:
        """Reduced robots side by side, given as designs or as what `assembly` made of them; raises
        as `reduced`, and of robots of other sites."""
        assembled = [self._own(each) for each in robots]
        return BatchedSimulator(assembled, self.physics, self.stepper, self.thread_count)

    def simulator_in_worlds(
        self, robots: Sequence[Robot], worlds: Sequence[World] | None
    ) -> LaggingSimulator | SharedSimulator | BatchedSimulator:
        """Reduced robots side by side where the executor has them.

        Args:
            robots: As `assembly` made them.
            worlds: The world of each; None for the one as it stands.

        Raises:
            ModuleNotFoundError: The executor is Ray, which is not installed.
            ValueError: As of `BatchedSimulator`, or a world names a reduction of other cavities.
        """
        if self.executor.backend == "ray":
            return SharedSimulator(robots, worlds, self.physics, self.stepper, self.executor)
        if worlds is None:
            return self.simulator(robots)
        return simulator_in_worlds(robots, worlds, self.physics, self.stepper, self.thread_count)

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
        scaled = self._with_modules(
            lambda module: module.scaled(modulus_factor, mass_factor, damping_factor)
        )
        return replace(scaled, hub=self.hub.scaled(mass_factor))

    def with_fewer_modes(self, count: int) -> RobotSpec:
        """The same robot whose reduced modules have fewer modes, see
        `pneumorph.reduction.fewer_modes`; itself where none would change.

        Args:
            count: Most modes of a module for each of its cavities; 0 for all that it has.
        """
        if count == 0:
            return self
        fewer = self._with_modules(
            lambda module: module.with_fewer_modes(count * module.reduced.cavity_count)
        )
        pairs = zip(self.modules, fewer.modules, strict=True)
        same = all(ours.reduced.mode_count == theirs.reduced.mode_count for ours, theirs in pairs)
        return self if same else fewer

    def with_fewer_points(self, states: Mapping[Module, np.ndarray], tolerance: float) -> RobotSpec:
        """The same robot whose reduced modules have fewer sampled points, see
        `pneumorph.reduction.fewer_points`.

        Args:
            states: What a module goes through, modal coordinates (state, mode); others keep their
                points.
            tolerance: Relative residual of a module's forces there.
        """
        return self._with_modules(
            lambda module: (
                module.with_fewer_points(states[module], tolerance) if module in states else module
            )
        )

    def _with_modules(self, change: Callable[[Module], Module]) -> RobotSpec:
        """The robot with each module changed, once however many sites have it."""
        modules = {module: change(module) for module in self.modules}
        sites = tuple(site.with_modules(modules.__getitem__) for site in self.sites)
        return replace(self, sites=sites)

    def calibrated(self, calibration: Calibration) -> RobotSpec:
        """The robot as measured: its physics and the stiffness of its modules.

        Raises:
            ValueError: The calibration is of another leg.
        """
        check_calibration(calibration, self.modules)
        return replace(
            self.scaled(calibration.modulus_factor or 1.0),
            physics=calibration.applied_to(self.physics),
            calibration=calibration,
        )

    @property
    def calibration_notes(self) -> tuple[str, ...]:
        """What to say of modules that the robot's calibration was not measured on."""
        if self.calibration is None:
            return ()
        note = calibration_note(self.calibration, self.modules)
        return () if note is None else (note,)

    def agreeing_worlds(self, drawn: Randomisation) -> Randomisation:
        """The worlds that agree with what tests found of the robot; what was measured besides, and
        what is no distribution, stays.

        Args:
            drawn: The worlds as nobody has measured the robot.

        Raises:
            ValueError: A test was of a number that these worlds have not, or found what none has.
        """
        if self.calibration is None:
            return drawn
        known = {name for name, _, _ in drawn.measured}
        known |= {name for name, law in drawn.distributions.items() if law.is_constant}
        found = self.calibration.measured.items()
        narrower = tuple((name, *pair) for name, pair in found if name not in known)
        return replace(drawn, measured=(*drawn.measured, *narrower))

    def reduced_again(self, part: Path) -> RobotSpec:
        """The robot with another reduction of the module of all its sites, by its file; raises as
        `module`."""
        again = self.module.reduced_again(part)
        return replace(self, sites=tuple(site.with_modules(lambda _: again) for site in self.sites))

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
    def modules(self) -> tuple[Module, ...]:
        """All kinds of modules, in the order in which the sites first name them."""
        return tuple(dict.fromkeys(module for site in self.sites for module in site.modules))

    @cached_property
    def _kin_surfaces(self) -> frozenset[str]:
        return surfaces_of(self.modules)

    @cached_property
    def module(self) -> Module:
        """The module of all sites.

        Raises:
            ValueError: The sites have different ones.
        """
        if len(self.modules) > 1:
            names = ", ".join(sorted(module.name for module in self.modules))
            raise ValueError(
                f"the robot has modules {names}, expected one kind: what is asked for is of a "
                "single leg; describe a robot with that leg at all of its sites"
            )
        return self.modules[0]

    def check_reduction(self) -> None:
        """Refuse reduced parts that do not stand for the finite elements.

        Raises:
            ArtefactError: One was made from another mesh or material.
            ValueError: The finite elements of one have other cavities than its mesh names so.
        """
        for module in self.modules:
            module.check_reduction()

    def check_supply(self, gaits: Iterable[OpenLoopGait]) -> None:
        """Refuse gaits that ask for more than the supply has.

        Raises:
            ValueError: One does.
        """
        for gait in gaits:
            self.physics.air.check_supply(
                commands_of(gait, self.physics.time_step_s, gait.regulator_count)
            )

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

    def mass_of(self, design: Design | str | None = None, reduced: bool = True) -> RobotMass:
        """What the hub weighs and carries, and of a design the whole robot, at rest.

        Args:
            design: The design; None for the hub alone.
            reduced: Whether its modules are the reduced parts, or finite elements.
        """
        if design is None:
            return robot_mass(self.hub)
        mounted = [
            (module.reduced if reduced else module.full, pose)
            for module, pose, _ in self._mounted(self._known(design))
        ]
        angle = self.mounting_angle_deg
        return robot_mass(
            self.hub, [(part, tilted(pose, part.rest_nodes, angle)) for part, pose in mounted]
        )

    def describe(self, reduced: bool = True, design: Design | str | None = None) -> dict[str, Any]:
        """Physics, calibration, masses and, of reduced robots, the module, for a summary.

        Args:
            reduced: Whether the robots are reduced.
            design: The only one that they have; None of several, of which the hub's mass is told.
        """
        used = {"leg": self._described_modules()} if reduced else {}
        return {
            "physics": self.physics,
            "damping": self.physics.damping,
            "calibration": describe_calibration(self.calibration, self.physics.pressure_map),
            "mass": self.mass_of(design, reduced),
            **used,
        }

    def _described_modules(self) -> PartsSummary:
        """Of the first module, with the others by name beside it."""
        first, *others = (module.describe() for module in self.modules)
        return PartsSummary(**vars(first), others={each.part: each for each in others})

    def _mounted(self, design: Design) -> list[tuple[Module, Pose, tuple[int, ...]]]:
        """Module, pose and regulators, from 0, of each leg of a design."""
        mounted = []
        for location, kind, regulators in design.fittings:
            site = self.sites[location]
            if kind >= len(site.modules):
                allowed = " or ".join(
                    f"{module_letter(place)} ({each.name})"
                    for place, each in enumerate(site.modules)
                )
                raise ValueError(
                    f"design {design} has a module {module_letter(kind)} at site "
                    f"{site.name or location}, expected {allowed}"
                )
            module = site.modules[kind]
            mounted.append((module, site.pose_of(module), tuple(r - 1 for r in regulators)))
        return mounted

    def _own(self, robot: Robot | Design | str) -> Robot:
        """A robot of these sites.

        Raises:
            ValueError: It is of a design of other sites.
        """
        if not isinstance(robot, Robot):
            return self.assembly(robot)
        if robot.design is not None:
            self._known(robot.design)
        return robot

    def _known(self, design: Design | str) -> Design:
        design = Design.parse(design)
        if design.location_count != len(self.sites):
            robot = self.name or "the paper's robot"
            raise ValueError(
                f"design {design} has {design.location_count} locations, expected "
                f"{len(self.sites)}: one for each site of {robot}"
            )
        return design
