"""A robot as its description has it: hub, modules, sites, physics and designs, from a TOML file.

docs/own_robot.md has the file field by field; `examples/plate.toml` is one, and the paper's robot
is another (`pneumorph/data/paper_robot.toml`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pneumorph.base.artefact import ArtefactError, read_text
from pneumorph.base.checked import Checked, Positive
from pneumorph.base.notebook import ShownInNotebooks
from pneumorph.base.plain_values import plain
from pneumorph.base.settings import (
    SettingsError,
    settings_from_dict,
    settings_to_dict,
    table_of_text,
)
from pneumorph.catalogue.acting_description import ActingDescription
from pneumorph.catalogue.built_module import CATALOGUE_FOLDER
from pneumorph.catalogue.described_spec import described_spec
from pneumorph.catalogue.design_rules import DesignRules
from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.catalogue.leg_kinds import leg_kind, load_default_leg
from pneumorph.catalogue.mean_growth import mean_growth
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.module_description import ModuleDescription, with_whole_materials
from pneumorph.catalogue.module_letters import module_letters
from pneumorph.catalogue.mounting_check import USUAL_TOLERANCE_MM
from pneumorph.catalogue.part_physics import PhysicsName
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.site_description import (
    SiteDescription,
    refuse_doubled_sites,
    refuse_repeated_modules,
)
from pneumorph.catalogue.written_description import write_description
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.pose import Pose
from pneumorph.physics.physics import Physics
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.usual_design import usual_design
from pneumorph.simulation.randomisation import Randomisation


@dataclass(frozen=True)
class RobotDescription(Checked, ShownInNotebooks):
    """A robot: what is in its file."""

    name: str
    """What it is called."""
    hub: HubDescription
    """What carries the modules."""
    modules: dict[str, ModuleDescription] = field(default_factory=dict)
    """The kinds of modules by name; sites have those that they allow in this order, and a design's
    letters count them there."""
    sites: tuple[SiteDescription, ...] = ()
    """Places for modules, one for each entry of a design."""
    ring: RadialMounting | None = None
    """In place of sites: places around a disk for every module, as the paper's robot has them."""
    physics: ActingDescription = field(default_factory=ActingDescription)
    """What acts on it."""
    randomisation: Mapping[str, Any] = field(default_factory=dict)
    """What worlds are drawn from, where it is not what the physics has: fields of `Randomisation`,
    for trainings, searches and certificates."""
    designs: DesignRules = field(default_factory=DesignRules)
    """Which designs may be built, and which walks where none is named."""
    mounting_tolerance_mm: Positive = USUAL_TOLERANCE_MM
    """Widest gap between hub and attachment face, and deepest overlap of hub and module, and of
    modules at two sites [mm]."""
    catalogue_folder: Path | None = None
    """Where modules of a catalogue were built; by default runs/catalogue, from where the program
    runs, as `pneumorph catalogue build` has it."""
    folder: Path = Path()
    """Where the paths of files start."""
    file: Path | None = None
    """The file that it was read from, which messages name."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.modules:
            raise ValueError("modules is empty, expected at least one table such as [modules.leg]")
        if (self.ring is None) == (not self.sites):
            both = "both" if self.sites else "neither"
            raise ValueError(f"expected either sites or a ring of them, got {both}")
        for number, site in enumerate(self.sites):
            if site.modules is not None and not site.modules:
                raise ValueError(
                    f"sites[{number}].modules is empty, expected one of modules at least: "
                    f"{', '.join(self.modules)}; leave it out for all of them, or leave out the "
                    "site if nothing may be mounted there"
                )
            for each in site.modules or ():
                if each not in self.modules:
                    raise ValueError(
                        f"sites[{number}].modules names {each!r}, expected one of modules: "
                        f"{', '.join(self.modules)}"
                    )
        refuse_doubled_sites(self.sites, self.designs.exclusions)
        mounted = {name for names in self.allowed_modules for name in names}
        for name in self.modules:
            if name not in mounted:
                raise ValueError(f"modules.{name} is at no site, expected one that allows it")

    def __repr__(self) -> str:
        count = self.ring.location_count if self.ring is not None else len(self.sites)
        return (
            f"RobotDescription({self.name}: {count} sites, {self.acting.regulator_count} "
            f"regulators, modules {', '.join(self.modules)})"
        )

    @classmethod
    def read(cls, path: Path | str) -> RobotDescription:
        """Read a description from a TOML (or JSON) file.

        Raises:
            FileNotFoundError: No such file.
            ValueError: It is no description; names the file, the field and the cause.
        """
        return cls.chosen(path)

    @classmethod
    def chosen(cls, path: Path | str, usual_physics: PhysicsName = "measured") -> RobotDescription:
        """The description in a file as it is now; more is refused than of one that a run kept.

        Args:
            path: The file.
            usual_physics: What it is based on where it does not say.

        Raises:
            FileNotFoundError: No such file.
            ValueError: As of `of_text`, no design uses a site or a regulator, or a part was made of
                other materials.
        """
        found = cls.of_text(read_text(path, "robot"), path, usual_physics)
        try:
            found._refuse_unused()
        except ValueError as error:
            raise ArtefactError(f"robot file {path}: {error}") from error
        return found

    @classmethod
    def of_text(
        cls, text: str, path: Path | str, usual_physics: PhysicsName = "measured"
    ) -> RobotDescription:
        """The description that a file had, whatever it has now.

        Args:
            text: What was in it.
            path: The file; paths in it start from its folder.
            usual_physics: What it is based on where it does not say.

        Raises:
            ValueError: It is no description; names the file, the field and the cause.
        """
        path, content = Path(path), table_of_text(text, path, "robot")
        if not isinstance(content.get("physics", {}), Mapping):
            raise ArtefactError(f"robot file {path}: physics is no table, expected [physics]")
        acting = dict(content.get("physics", {}))
        based_on = acting.pop("based_on", usual_physics)
        content["physics"] = {"based_on": based_on, "changes": acting}
        modules = content.get("modules")
        if isinstance(modules, Mapping):
            content["modules"] = {
                name: with_whole_materials(each, path.parent, based_on)
                for name, each in modules.items()
            }
        try:
            place = {"folder": str(path.parent), "file": str(path)}
            found = settings_from_dict(cls, {**content, **place})
            _ = found.space, found.worlds
            if not found.acting.ground.is_plane:
                _ = found.acting.ground.grid()
        except FileNotFoundError as error:
            raise FileNotFoundError(f"robot file {path}: {error}") from error
        except SettingsError as error:
            raise ArtefactError(f"robot file {path}: {error.reasons}") from error
        except ValueError as error:
            raise ArtefactError(f"robot file {path}: {error}") from error
        return found

    def write(self, path: Path | str) -> Path:
        """Write the description to a TOML file, which `read` reads back as the same robot.

        What is as by default is left out. Files that it names are named from the new file's folder,
        unless they are named from the root.

        Args:
            path: The file, which ends in ``.toml``; one that is there is replaced.

        Raises:
            OSError: The disk is full or refuses; a file that was there stays.
            ValueError: The file is none of TOML by its name, the physics or the worlds are none,
                or no file can hold a value; names its field.
        """
        return write_description(self, Path(path))

    @cached_property
    def polar_modules(self) -> tuple[str, ...]:
        """Names of modules that were made with polar rotations, where the file does not say how
        they are damped: they then walk with the damping that goes with them."""
        if "damping" in self.physics.changes or self.physics.physics.damping == "objective":
            return ()
        return tuple(name for name, part in self.own_parts.items() if part.is_polar)

    @cached_property
    def own_parts(self) -> dict[str, ReducedPart]:
        """Reduced parts of one's own, or of a catalogue, by their modules' names."""
        found = {}
        for name, each in self.modules.items():
            try:
                part = each.own_part(self.folder, self.built_folder)
            except ArtefactError as error:
                raise ArtefactError(f"modules.{name}: {error}") from error
            if part is not None:
                found[name] = part
        return found

    @property
    def _own_growth(self) -> tuple[float, ...] | None:
        """How the chambers of parts of one's own grow with pressure, where the file does not say
        it: the mean by volume of all modules, one of each. None where no part says it, and of the
        published physics, whose pressures are no real ones."""
        said = self.physics.said.get("air", {})
        if self.physics.based_on == "published" or "chamber_growth" in said:
            return None
        own, usual = self.own_parts, leg_kind("measured").physics.air.chamber_growth
        if not any(part.chamber_growth for part in own.values()):
            return None
        volumes, growths = [], []
        for name, each in self.modules.items():
            part = own.get(name) or load_default_leg(each.leg or self.physics.based_on)
            volumes.append(each.size_factor**3 * float(part.cavity_volume.sum()))
            growths.append(part.chamber_growth or usual)
        return mean_growth(volumes, growths)

    @property
    def built_folder(self) -> Path:
        """Where modules of a catalogue were built."""
        if self.catalogue_folder is None:
            return CATALOGUE_FOLDER.absolute()
        return self.folder / self.catalogue_folder

    @cached_property
    def acting(self) -> Physics:
        """What acts on the robot; the file of a ground starts from the folder."""
        physics = self.physics.physics
        if self.polar_modules:
            physics = replace(physics, damping="objective")
        growth = self._own_growth
        if growth is not None:
            physics = replace(physics, air=replace(physics.air, chamber_growth=growth))
        ground = physics.ground
        if ground.map.path is None:
            return physics
        placed = replace(ground.map, path=self.folder / ground.map.path)
        return replace(physics, ground=replace(ground, map=placed))

    @cached_property
    def space(self) -> DesignSpace:
        """The designs that may be built.

        Raises:
            ValueError: A rule names a site, module or regulator that there is not, a symmetry maps
                a site to none, or no design is left.
        """
        return self.designs.space(
            self._poses(),
            self.allowed_modules,
            self.acting.regulator_count,
        )

    @property
    def letters(self) -> str:
        """What the letters of its designs stand for; empty where no site has a choice."""
        return module_letters(self.allowed_modules)

    @cached_property
    def usual_design(self) -> str:
        """The design that walks where none is named."""
        return self.designs.usual or str(usual_design(self.space))

    @cached_property
    def worlds(self) -> Randomisation:
        """What worlds are drawn from: those of its physics, but for what the file says.

        Raises:
            ValueError: It has no such number, or a distribution is none.
        """
        measured = self.physics.based_on == "measured"
        usual = measured_worlds() if measured else Randomisation()
        said = plain(self.randomisation, "randomisation")
        return settings_from_dict(Randomisation, said, usual)

    def expert_settings(self) -> dict[str, Any]:
        """Settings of the expert's gait for its regulators."""
        return {"regulator_count": self.acting.regulator_count}

    def baseline_settings(self) -> dict[str, Any]:
        """Settings of a phase sweep for its usual design."""
        return {"design": self.usual_design, "gait": self.expert_settings()}

    def worlds_settings(self) -> dict[str, Any]:
        """Settings of what worlds are drawn from, where the file says it."""
        return {"randomisation": settings_to_dict(self.worlds)} if self.randomisation else {}

    def training_settings(self) -> dict[str, Any]:
        """Settings of a learner for its designs and regulators."""
        space = self.space
        return {
            "space": settings_to_dict(space),
            "task": {"regulator_count": space.regulator_count},
        }

    def spec(self, physics: Physics | None = None, **rest: Any) -> RobotSpec:
        """The robot.

        Args:
            physics: What acts on it; None for its own.
            **rest: Other fields of `RobotSpec`, such as ``thread_count``.

        Raises:
            FileNotFoundError: A file that it names is missing.
            ValueError: A module is not where its site is, weighs what it cannot, or is inflated
                otherwise than the real one; names the file, the site, the module and the cause.
        """
        try:
            if self.file is None:  # of Python; a file's was refused when it was chosen
                self._refuse_unused()
            return described_spec(self, physics or self.acting, rest)
        except (FileNotFoundError, ValueError) as error:
            if self.file is None or str(self.file) in str(error):
                raise
            missing = isinstance(error, FileNotFoundError)
            named = FileNotFoundError if missing else ArtefactError
            raise named(f"robot file {self.file}: {error}") from error

    def _refuse_unused(self) -> None:
        """Refuse what no design uses, what a list names twice, a hub that its designs' symmetries
        move elsewhere, and materials that a module's part was not made of.

        Raises:
            ValueError: There is one.
        """
        refuse_repeated_modules(self.sites)
        self.designs.refuse_repeated()
        self.designs.refuse_unused(self.space, self.ring is not None)
        self.space.check_images()
        for name, each in self.modules.items():
            each.refuse_other_materials(name, self.own_parts.get(name))
        self.hub.refuse_misplaced(self.designs.mirror, self.designs.same)

    @property
    def allowed_modules(self) -> list[tuple[str, ...]]:
        """Names of the modules at each site, in the order of the modules."""
        every = tuple(self.modules)
        if self.ring is not None:
            return [every] * self.ring.location_count
        return [
            tuple(name for name in every if site.modules is None or name in site.modules)
            for site in self.sites
        ]

    def _poses(self) -> list[Pose]:
        """Each site's frame in the robot's."""
        ring = self.ring
        if ring is not None:
            return [ring.pose(location) for location in range(ring.location_count)]
        return [site.pose for site in self.sites]
