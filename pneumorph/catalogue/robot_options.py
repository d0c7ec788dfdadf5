"""Which robot, in which physics: what a verb asks for, and the specification it stands for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import tyro

from pneumorph.base.artefact import read_text
from pneumorph.base.checked import Bounds, Checked
from pneumorph.base.executor import ExecutorSettings
from pneumorph.base.settings import laid_over, settings_from_dict, settings_to_dict
from pneumorph.base.shapes import table
from pneumorph.catalogue.full_options import FullOptions, full_of
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.mounting_check import (
    USUAL_TOLERANCE_MM,
    check_apart,
    check_cast_mass,
    check_mounted,
)
from pneumorph.catalogue.older_names import OLDER_GROUP
from pneumorph.catalogue.paper_leg import (
    LegName,
    leg_kind,
    masses_of,
    paper_leg,
    physics_of,
    pressure_map,
    with_current_leg,
)
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.part_physics import (
    PhysicsName,
    may_be_measured,
    physics_of_part,
    refuse_other_physics,
)
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.geometry.leg_mesh import load_leg_mesh
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.stepper_settings import StepperSettings


def _all_of(name: PhysicsName) -> dict[str, Any]:
    """The settings that a physics is, but for numerics that all share."""
    kind = leg_kind(name)
    physics = settings_to_dict(kind.physics)
    del physics["regulator_count"]  # which is the robot's
    return {
        "based_on": name,
        "leg": name,
        "physics": physics,
        "full": full_of(kind),
        "masses": {"model": kind.mass_model},
    }


def _is_complete(content: Mapping[str, Any]) -> bool:
    """Whether settings are all that there are, as a run keeps them, and not flags or a file's: by
    the numerics, whole as every version kept them, which nobody asks for one by one."""
    numerics = content.get("stepper") or content.get(OLDER_GROUP) or {}
    whole = {"contact_margin_mm", "contact_sweeps", "speed_limit_mm_per_s", "element_precision"}
    return {"part", "threads"} <= set(content) and whole <= set(numerics)


USUAL: PhysicsName = "measured"
"""The physics where none is asked for."""


def described_robot(content: Mapping[str, Any]) -> RobotDescription | None:
    """The robot that settings with a group ``robot`` describe by a file; None without one.

    Args:
        content: Settings as nested dictionaries.
    """
    robot = content.get("robot", {})
    path, text = robot.get("described"), robot.get("file_text")
    if path is None:
        return None
    usual = robot.get("based_on", USUAL)
    if text is None:
        return RobotDescription.chosen(path, usual)
    return RobotDescription.of_text(text, path, usual)


def chosen_robot(content: Mapping[str, Any]) -> RobotDescription | None:
    """The same where the settings choose it, so that its designs and regulators come with it; None
    where they are those of an earlier run, whose gaits have theirs.

    Args:
        content: Settings as nested dictionaries.
    """
    return None if _is_complete(content.get("robot", {})) else described_robot(content)


def asked_regulators(content: Mapping[str, Any], below: Mapping[str, Any]) -> int | None:
    """Regulators that settings ask the paper's robot for, so that gaits, designs and tasks have as
    many; None where they do not, and for a robot of a file, which says it.

    Args:
        content: Settings as nested dictionaries, with a group ``robot``.
        below: All settings below them.
    """
    robot = content.get("robot", {})
    described = robot.get("described") or below.get("robot", {}).get("described")
    if described is not None or _is_complete(robot):
        return None
    count: int | None = robot.get("physics", {}).get("regulator_count")
    return count


def chosen_part(content: Mapping[str, Any]) -> ReducedPart | None:
    """The reduced leg of a file that the settings choose; None as of `chosen_robot`.

    Args:
        content: Settings as nested dictionaries.

    Raises:
        FileNotFoundError: No such part.
        ArtefactError: It is no reduced part.
    """
    robot = content.get("robot", {})
    path = None if _is_complete(robot) else robot.get("part")
    return None if path is None else ReducedPart.load(path)


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
    Results are the same to the last bit for any number of workers with the same kind of processor.
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
        return replace(settings_from_dict(cls, _all_of(name)), **changes)

    @classmethod
    def upgraded(cls, content: Mapping[str, Any]) -> dict[str, Any]:
        """Settings of an earlier version as they are called now.

        One group `simulation` held what is physics and stepper now, and steps were linearised at
        the start; a run of the hyperelastic leg kept the published pressure map in its settings and
        used the leg's own. The published leg was called ``paper``. Every robot had the published
        masses, and was of the published physics where nothing is said of it; what a robot's file
        says stood there as if nothing was. A map of heights was an option of finite elements.
        """
        now = with_current_leg(content)
        if isinstance(now.get("full"), Mapping) and "height_map" in now["full"]:
            full = dict(now["full"])
            ground = {"ground": {"map": full.pop("height_map")}}
            physics = table(now.get("physics", {}), "physics")
            now |= {"full": full, "physics": laid_over(ground, physics)}
        if _is_complete(now):
            usual: dict[str, Any] = {"based_on": "published", "leg": "published", "full": {}}
            now = {**usual, "masses": {"model": "published"}, **now}
            robot = now.get("described")
            if isinstance(robot, str) and now.get("file_text") is None and Path(robot).is_file():
                now["file_text"] = read_text(robot, "robot")
                described = RobotDescription.of_text(now["file_text"], robot, "published")
                said = _all_of(described.physics.based_on)
                nothing = {**usual, "masses": settings_to_dict(Masses("published"))}
                now |= {
                    name: said[name]
                    for name in ("based_on", "leg", "masses")
                    if now[name] in (nothing[name], {"model": "published"})
                }
        elif OLDER_GROUP in now and "leg" not in now:
            now = {"based_on": "published", **now}
        older = now.pop(OLDER_GROUP, {})
        if not older:
            return now
        older = {"linearised": "start", **table(older, OLDER_GROUP)}
        numerics = {each.name for each in fields(StepperSettings)}
        if older.get("pressure_map") == settings_to_dict(PressureMap()):
            own = pressure_map(now.get("leg", "published"))
            older = {**older, "pressure_map": settings_to_dict(own)}
        for group, chosen in (
            ("physics", {k: v for k, v in older.items() if k not in numerics}),
            ("stepper", {k: v for k, v in older.items() if k in numerics}),
        ):
            if chosen:
                now[group] = {**chosen, **now.get(group, {})}
        return now

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """Settings that a choice of physics, leg or part brings with it where they are not set.

        Raises:
            FileNotFoundError: No such part.
            ArtefactError: It is no reduced part.
        """
        path, text = content.get("described"), content.get("file_text")
        if path is None and content.get("based_on") is not None:
            # The physics of a file that was named before, which may leave that open.
            path, text = below.get("described"), below.get("file_text")
        if path is not None:
            usual_physics = content.get("based_on", USUAL)
            if text is None:
                robot = RobotDescription.chosen(path, usual_physics)
                text = read_text(path, "robot")
            else:
                robot = RobotDescription.of_text(text, path, usual_physics)
            brought = {**_all_of(robot.physics.based_on), "file_text": text}
            brought["physics"] = settings_to_dict(robot.acting)
            brought["full"]["hub"] = robot.hub.model
            return brought
        brought = {}
        leg: LegName | None = content.get("leg")
        name: PhysicsName | None = content.get("based_on")
        path = content.get("part")
        part = ReducedPart.load(path) if path is not None and leg is None else None
        if name is None:
            own = None if leg is None else physics_of(leg)
            own = own if part is None else physics_of_part(part)
            name = None if own == below.get("based_on") else own
        if name is not None:
            brought = _all_of(name)
        if leg is not None:
            own_of_leg = {
                "physics": {"pressure_map": settings_to_dict(pressure_map(leg))},
                "masses": {"model": masses_of(leg).model},
            }
            brought = laid_over(brought, own_of_leg)
        if part is not None and part.is_polar:
            brought = laid_over(brought, {"physics": {"damping": "objective"}})
        if path is None and brought:  # all of a physics, under a leg that was chosen before
            path = below.get("part")
        if path is not None and leg in (None, "measured"):
            grown = part or ReducedPart.load(path)
            if may_be_measured(grown) and name != "published":
                usual = leg_kind("measured").physics.air.chamber_growth
                air = {"chamber_growth": list(grown.chamber_growth or usual)}
                brought = laid_over(brought, {"physics": {"air": air}})
        return brought

    def spec(self) -> RobotSpec:
        """The robot asked for, calibrated if a calibration was given.

        Raises:
            FileNotFoundError: The calibration file is missing.
            ArtefactError: It cannot be read, or the reduced leg is of another mesh than the one
                that is given.
            ValueError: It is given together with a pressure map, the physics have the published
                leg's pressure map for another leg, the leg or its reduction is of another physics,
                or the reduced leg weighs what none does or is not apart from disk and neighbours.
        """
        full = self.full
        numerics: dict[str, Any] = {
            "stepper": self.stepper,
            "full_order": FullOrderSettings(
                integrator=full.integrator,
                newton_matrix=full.newton_matrix,
                displacement_tolerance_mm=full.displacement_tolerance_mm,
                thread_count=full.thread_count,
                friction_solver=full.friction_solver,
                contact_sweeps=full.contact_sweeps,
            ),
            "hub_model": full.hub,
            "thread_count": self.threads,
            "executor": self.executor,
        }
        robot = self.description
        if robot is None:
            label = None if self.part is None else str(self.part)
            self._refuse_other_leg()
            part = self._part_of_this_physics()
            leg = paper_leg(self.leg, part, full.mesh, masses=self.masses, label=label)
            spec = paper_robot(leg, self.physics, self.masses, **numerics)
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

    def notes(self, design: str | None) -> tuple[str, ...]:
        """What to say before one robot walks in one world; see `RobotDescription.notes`."""
        robot = self.description
        return () if robot is None else robot.notes(design, self.physics)

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
        leg = paper_leg(self.leg, self.part, self.full.mesh, masses=self.masses)
        spec = paper_robot(leg, self.physics, self.masses)
        if self.full.mesh is not None:
            leg.reduced.check_mesh(load_leg_mesh(self.full.mesh))
        if self.masses.leg_mass_g is None:
            what = f"the reduced leg {self.part}"
            check_cast_mass(leg.reduced, what, "masses.leg_mass_g")
        remedy = "describe a robot for it in a file (--robot)"
        if leg.face is not None:  # without its mesh it is put where its origin is
            check_mounted(spec.hub, spec.sites[:1], USUAL_TOLERANCE_MM, remedy)  # all are alike
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
