"""Which robot, in which physics: what a verb asks for, and the specification it stands for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import tyro

from pneumorph.base.checked import Bounds, Checked
from pneumorph.base.executor import ExecutorSettings
from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.catalogue.description_notes import description_notes, forbidden_note
from pneumorph.catalogue.full_options import FullOptions, full_of
from pneumorph.catalogue.leg_kinds import LegName, leg_kind, masses_of, physics_of, pressure_map
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.mounting_check import (
    USUAL_TOLERANCE_MM,
    check_apart,
    check_cast_mass,
    check_mounted,
)
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.part_physics import (
    PhysicsName,
    refuse_other_physics,
)
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_settings import (
    USUAL,
    all_of_physics,
    described_robot,
    implied_by_robot,
    upgraded_robot,
)
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.geometry.leg_mesh import load_leg_mesh
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.stepper_settings import StepperSettings


@dataclass(frozen=True)
class RobotOptions(Checked):
    """The robot, its leg and the physics."""

    described: Annotated[Path | None, tyro.conf.arg(name="robot")] = None
    """TOML file that describes a robot, see docs/own_robot.md; by default the paper's robot. The
    file sets its own physics, designs, legs and masses."""
    file_text: Annotated[str | None, tyro.conf.Fixed, tyro.conf.Suppress] = None
    """What was in that file when the run began, so that later verbs and resumed runs have the same
    robot whatever becomes of the file."""
    based_on: Annotated[PhysicsName, tyro.conf.arg(name="physics")] = USUAL
    """Sets leg, masses, hub and physics together; other flags change single numbers. `measured`:
    material properties as they were measured. `published`: as the article simulated its robots."""
    leg: LegName = USUAL
    """`measured`: silicone from its tension test, with relaxation, under the real leg's pressure.
    `published`: the article's material, linear elements. `hyperelastic`: the silicone's own
    stiffness, quadratic neo-Hookean elements, its own pressure map and, without `--masses.model`,
    masses as cast and printed. Without --physics, the leg also sets the physics: published for the
    last two."""
    part: Path | None = None
    """Reduced leg, as `pneumorph reduce` writes it; by default one that ships. Without --physics
    and --leg it also sets the physics: measured if the leg's material relaxes, otherwise
    published."""
    threads: Annotated[int, Bounds(least=0, why="0 takes every processor")] = 0
    """Threads of the engine; 0 takes every processor."""
    executor: ExecutorSettings = field(default_factory=ExecutorSettings)
    """Where robots are computed: on this machine, or distributed over the workers of a Ray cluster.
    Results are the same to the last bit for any number of workers with the same kind of processor,
    where all legs' reductions have as many modes, rounded up to whole eights.
    Finite-element walks run this many at a time."""
    full: FullOptions = field(default_factory=lambda: FullOptions(**full_of(leg_kind(USUAL))))
    masses: Masses = field(default_factory=lambda: masses_of(USUAL))
    """What legs and hub weigh; by default set by the choice of physics or leg."""
    calibration: Path | None = None
    """Calibration file, as `pneumorph calibrate` writes it; by default the leg's own
    map of real to simulated pressure."""
    physics: Physics = field(default_factory=lambda: leg_kind(USUAL).physics)
    stepper: StepperSettings = field(default_factory=StepperSettings)

    @property
    def physics_name(self) -> PhysicsName:
        """The physics that the robot is of, by its name."""
        return self.based_on if self.description is None else self.description.physics.based_on

    @classmethod
    def of(cls, name: PhysicsName, /, **changes: Any) -> RobotOptions:
        """All of a physics by its name, but for some options.

        Raises:
            TypeError: No such option.
        """
        return replace(settings_from_dict(cls, all_of_physics(name)), **changes)

    @classmethod
    def upgraded(cls, content: Mapping[str, Any]) -> dict[str, Any]:
        """Settings of an earlier version as they are called now; see `upgraded_robot`."""
        return upgraded_robot(content)

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """Settings that a choice of physics, leg or part brings with it; see `implied_by_robot`."""
        return implied_by_robot(content, below)

    def spec(self) -> RobotSpec:
        """The robot asked for, calibrated if a calibration was given.

        Raises:
            FileNotFoundError: The calibration file is missing.
            ArtefactError: It cannot be read, or the reduced leg is of another mesh than the one
                that is given.
            ValueError: It is given together with a pressure map, the physics have the published
                leg's pressure map for another leg, the leg or its reduction is of another physics,
                or the reduced leg weighs what none does or is not apart from disk and neighbours;
                or the floor lies so far below that the robot would fall first.
        """
        full = self.full
        numerics: dict[str, Any] = {
            "stepper": self.stepper,
            "full_order": full.numerics(),
            "hub_model": full.hub,
            "thread_count": self.threads,
            "executor": self.executor,
        }
        robot = self.description
        if robot is None:
            label = None if self.part is None else str(self.part)
            self._refuse_other_leg()
            part = self._part_of_this_physics()
            leg = module_of_leg(self.leg, part, full.mesh, masses=self.masses, label=label)
            spec = paper_robot(leg, self.physics, self.masses, **numerics)
            spec.check_near_floor()
            _ = self.part is None or self._own_leg_fits
            usual = pressure_map(self.leg)
        else:
            self._refuse_beside_a_description(robot)
            spec, usual = robot.spec(self.physics, **numerics), robot.acting.pressure_map
        if self.calibration is None:
            return spec
        if self.physics.pressure_map != usual:
            raise ValueError(
                f"both a calibration file ({self.calibration}) and physics.pressure_map were "
                "given, expected one of them"
            )
        return spec.calibrated(Calibration.load(self.calibration))

    @cached_property
    def description(self) -> RobotDescription | None:
        """The robot's description; None for the paper's robot.

        Raises:
            FileNotFoundError: The file is missing.
            ArtefactError: It is no description.
        """
        return described_robot(
            {
                "robot": {
                    "described": self.described,
                    "file_text": self.file_text,
                    "based_on": self.based_on,
                }
            }
        )

    def notes(self, design: str | None, spec: RobotSpec) -> tuple[str, ...]:
        """What to say before one robot walks in one world.

        Args:
            design: As of `description_notes`.
            spec: What `spec` made of this.
        """
        robot, measured = self.description, spec.calibration_notes
        if robot is None:
            return measured
        return (*description_notes(robot, design, self.physics), *measured)

    def forbidden_notes(self, design: str) -> tuple[str, ...]:
        """What to say of a design that a gait's file names and the robot's rules do not allow."""
        robot = self.description
        note = None if robot is None else forbidden_note(robot, design)
        return () if note is None else (note,)

    def _refuse_other_leg(self) -> None:
        """Refuse a leg by its name of another physics than the one that was asked for.

        Raises:
            ValueError: It is.
        """
        own = physics_of(self.leg)
        if own != self.based_on:
            raise ValueError(
                f"the {self.leg} leg is of the {own} physics, and the {self.based_on} one was asked"
                " for, expected a leg of that: leave out --physics, which the leg then brings "
                f"itself, or --leg; in Python all of it is RobotOptions.of({own!r})"
            )

    def _part_of_this_physics(self) -> ReducedPart | None:
        """The reduced leg, read where what is in it is checked.

        Raises:
            ValueError: It is a leg of the other physics; names it and what was asked for.
        """
        if self.part is None:
            return None
        part = ReducedPart.load(self.part)
        remedy = "leave out --physics and --leg, which the leg then brings itself"
        refuse_other_physics(part, self.based_on, f"the reduced leg {self.part}", remedy)
        return part

    @cached_property
    def _own_leg_fits(self) -> bool:
        """That a reduced leg may be one, looked at once.

        Raises:
            ArtefactError: It is of another mesh than its finite elements.
            ValueError: It weighs what no cast leg does, or reaches into the disk or its neighbour.
        """
        leg = module_of_leg(self.leg, self.part, self.full.mesh, masses=self.masses)
        spec = paper_robot(leg, self.physics, self.masses)
        if self.full.mesh is not None:
            leg.reduced.check_mesh(load_leg_mesh(self.full.mesh))
        if self.masses.leg_mass_g is None:
            what = f"the reduced leg {self.part}"
            check_cast_mass(leg.reduced, what, "masses.leg_mass_g")
        remedy = "describe a robot for it in a file (--robot)"
        if leg.face is not None:  # without its mesh it is put where its origin is
            one = spec.sites[:1]  # all are alike
            check_mounted(spec.hub, one, DesignSpace(), USUAL_TOLERANCE_MM, remedy)
        check_apart(spec.sites, DesignSpace(), USUAL_TOLERANCE_MM, remedy)
        return True

    def _refuse_beside_a_description(self, robot: RobotDescription) -> None:
        """Refuse what would be ignored: the description says it.

        Raises:
            ValueError: A leg, a part, a mesh or masses are given.
        """
        kind = leg_kind(robot.physics.based_on)
        said = {"based_on": robot.physics.based_on, "leg": robot.physics.based_on}
        theirs = {**said, "part": None, "masses": Masses(kind.mass_model)}
        usual = RobotOptions()
        ours = {name: getattr(self, name) for name in theirs}
        for name in theirs:
            if (
                ours != {each: getattr(usual, each) for each in theirs}
                and ours[name] != theirs[name]
            ):
                flag = "physics" if name == "based_on" else name
                raise ValueError(
                    f"--{flag} is given beside --robot {self.described}, expected it in that file "
                    "alone: it says what its modules, masses and physics are"
                )
        count, theirs_count = self.physics.regulator_count, robot.acting.regulator_count
        if count != theirs_count:
            raise ValueError(
                f"--physics.regulator-count is {count} beside --robot {self.described}, expected "
                f"the {theirs_count} of that file: its designs, gaits and tasks are of as many"
            )
        if self.full.mesh is not None:
            raise ValueError(
                f"--full.mesh is given beside --robot {self.described}, expected each module's "
                "mesh in that file"
            )

    @property
    def leg_name(self) -> LegName:
        """Which leg the modules are, or are like: a description's are as its physics."""
        robot = self.description
        return self.leg if robot is None else robot.physics.based_on

    def refuse_full_options(self) -> None:
        """Refuse options of finite elements where reduced robots walk; how many threads share them
        changes nothing, and runs of earlier versions say one.

        Raises:
            ValueError: One of them is not the usual one.
        """
        robot = self.description
        kind = leg_kind(self.based_on if robot is None else robot.physics.based_on)
        asked = settings_to_dict(self.full)
        usual = {**settings_to_dict(FullOptions()), **full_of(kind)}
        del usual["thread_count"]
        if robot is not None:
            usual["hub"] = robot.hub.model
        if self.part is not None:
            asked["mesh"] = None  # what weighs a cast leg whose reduction does not ship
        for name in usual:
            if usual[name] == asked[name]:
                continue
            raise ValueError(
                f"full.{name} is {asked[name]!r}, expected {usual[name]!r} with --model reduced: "
                "it is an option of finite elements"
            )
