"""A catalogue of modules: parametric legs by name, each with how it is meshed and reduced.

A catalogue is a TOML file of tables ``[modules.NAME]``; what ``[defaults]`` says holds for all that
do not say otherwise. `pneumorph/data/catalogue.toml` ships.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.checked import Checked
from pneumorph.base.layers import layered
from pneumorph.base.settings import (
    laid_over,
    read_settings_file,
    settings_from_dict,
    settings_known_before,
    settings_to_dict,
)
from pneumorph.catalogue.leg_kinds import LegName, leg_kind, physics_of
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.reduction.part_file import FORMAT_VERSION as PART_VERSION
from pneumorph.study.made_mesh import MEASURED_LEG, MeshSettings
from pneumorph.study.reduction_options import PRESETS, ReduceOptions

VERSION = 1
"""Of what a key is made of: a higher one lets every module be built again."""

_NAME = re.compile(r"[A-Za-z0-9][\w-]*")
_SAID_ELSEWHERE = ("leg", "mesh")


@dataclass(frozen=True)
class ParametricModule(Checked):
    """A leg of a catalogue: its shape and mesh, its physics, and how it is reduced."""

    mesh: MeshSettings = field(default_factory=lambda: MeshSettings(**MEASURED_LEG))
    """Its shape (`leg`) and how finely it is meshed, as `pneumorph mesh leg` takes them; in a
    catalogue's file as the leg that ships where nothing is said."""
    leg: LegName = "measured"
    """The leg that it is like: its materials, masses, and the physics that robots walk in."""
    reduced_as: str = "measured"
    """Preset of `pneumorph reduce`."""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """Settings of `pneumorph reduce` that differ from the preset, as nested tables."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.reduced_as not in PRESETS:
            raise ValueError(
                f"reduced_as is {self.reduced_as!r}, expected a preset of reduce: "
                f"{', '.join(PRESETS)}"
            )
        own, preset = physics_of(self.leg), physics_of(PRESETS[self.reduced_as]().leg)
        if own != preset:
            raise ValueError(
                f"reduced_as is {self.reduced_as!r}, a preset of the {preset} physics, expected "
                f"one of the {own} physics as leg is {self.leg!r}, such as "
                + ("measured or quick" if own == "measured" else "paper or paper_quick")
            )
        if self.mesh.file is not None:
            raise ValueError(
                f"mesh.file is {self.mesh.file}, expected none: modules of a catalogue are "
                "parametric legs; reduce a mesh of your own with pneumorph reduce --mesh"
            )
        for name in self.mesh.unused("leg"):
            raise ValueError(
                f"mesh.{name} is {getattr(self.mesh, name)!r}, expected none: it is of a mesh file "
                "or of the disk, and would change nothing of a parametric leg"
            )
        self.mesh.leg.check_connector()
        for name in _SAID_ELSEWHERE:
            if name in self.changes:
                raise ValueError(
                    f"changes.{name} is {self.changes[name]!r}, expected {name} as a field of the "
                    "module itself"
                )
        if "walked" in self.changes:
            raise ValueError(
                "changes.walked is given, expected none: a module is kept by what its catalogue "
                "says, not by what files of gaits hold; reduce such a leg with pneumorph reduce"
            )

    def options(self, mesh: Path | None = None) -> ReduceOptions:
        """How it is reduced: as the preset has it, in the materials of its own leg, for any hub.

        Args:
            mesh: File of its mesh; without it a leg of the published kind has not its own mass.

        Raises:
            ValueError: A change is of no setting, or out of range.
        """
        kind = leg_kind(self.leg)
        own = {
            "hub": "rigid",
            "materials": settings_to_dict(kind.materials),
            "masses": {"model": kind.mass_model},
            # As of every mesh of one's own; the key is asked for before there is a mesh.
            "snapshots": {"static": {"rotation": "polar"}},
            "reduction": {"rotation": "polar"},
        }
        meshed = {} if mesh is None else {"mesh": str(mesh)}
        preset = replace(PRESETS[self.reduced_as](), leg=self.leg)
        return layered(preset, [own, meshed, self.changes])

    def made_of(self) -> dict[str, Any]:
        """All that its files depend on, JSON-serialisable."""
        kind = leg_kind(self.leg)
        reduced = settings_known_before(self.options(), ("silicone", "largest_pressure_kPa"))
        del reduced["snapshots"]["executor"]
        if not reduced["reduction"]["contact_flexibility"]:
            del reduced["reduction"]["contact_flexibility"]  # as before there was a choice
        mesh = settings_to_dict(self.mesh)
        return {
            "version": VERSION,
            "part_version": PART_VERSION,
            "mesh": {name: mesh[name] for name in ("leg", "leg_mesher", "quadratic", "face_tied")},
            "reduce": reduced,
            "physics": kind.physics.described(),
            "full_order": kind.full_order.by_name(),
        }

    @cached_property
    def key(self) -> str:
        """Digest of all that its files depend on, in hexadecimal."""
        return _digest(self.made_of())

    @cached_property
    def snapshot_key(self) -> str:
        """The same of its snapshots: of all but how they are reduced; its rotation is also that of
        the robots that walk."""
        made_of = self.made_of()
        made_of["reduce"]["reduction"] = made_of["reduce"]["reduction"]["rotation"]
        return _digest(made_of)


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


def shipped_catalogue() -> Path:
    """The catalogue that ships: legs of the measured physics."""
    return data_file("catalogue.toml")


def read_catalogue(path: Path | str) -> dict[str, ParametricModule]:
    """Read the modules of a catalogue by their names.

    Raises:
        FileNotFoundError: No such file.
        ArtefactError: It is no catalogue; names the file, the module and the cause.
    """
    content = read_settings_file(path)
    defaults, tables = content.pop("defaults", {}), content.pop("modules", None)
    if content or not isinstance(tables, Mapping) or not isinstance(defaults, Mapping):
        found = f"also {', '.join(content)}" if content else "none of these"
        raise ArtefactError(
            f"catalogue {path} must hold tables [modules.NAME] and perhaps [defaults], got {found}"
        )
    modules = {}
    for name, table in tables.items():
        where = f"catalogue {path}: module {name}"
        if not _NAME.fullmatch(name):
            raise ArtefactError(f"{where}: expected a name of letters, digits, _ and -")
        if not isinstance(table, Mapping):
            raise ArtefactError(f"{where} is {table!r}, expected a table [modules.{name}]")
        try:
            said = laid_over(dict(defaults), table)
            measured = said.get("leg", ParametricModule.leg) == "measured"
            usual = MeshSettings(**MEASURED_LEG) if measured else MeshSettings()
            said = laid_over({"mesh": settings_to_dict(usual)}, said)
            modules[name] = settings_from_dict(ParametricModule, said)
            _ = modules[name].key
        except ValueError as error:
            raise ArtefactError(f"{where}: {error}") from error
    if not modules:
        raise ArtefactError(f"catalogue {path} has no modules, expected at least one")
    return modules
