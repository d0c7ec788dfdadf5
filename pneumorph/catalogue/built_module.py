"""A module of a catalogue, as `pneumorph catalogue build` leaves it for robots.

A folder of built modules holds the reduced part and the mesh of each in a folder of their own, and
``modules/NAME.json`` that says which files a name stands for. That file is written last: what it
names is complete. One such folder ships with the package.
"""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import ClassVar

from pneumorph.base.artefact import ArtefactError, read_json, reading, write_json
from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.catalogue.leg_kinds import LegName, leg_kind
from pneumorph.catalogue.shipped_data import data_folder
from pneumorph.fem.material import LegMaterials
from pneumorph.geometry.pneunet import PneuNetShape

CATALOGUE_FOLDER = Path("runs/catalogue")
"""Where built modules are unless another folder is named."""
SHIPPED_MODULES = data_folder("catalogue")
"""Those that ship; a module of the same name that was built goes before them."""


@dataclass(frozen=True)
class BuiltModule:
    """Which files a name of a catalogue stands for, and what they are of."""

    VERSION: ClassVar[int] = 1

    part: Path
    """The reduced part."""
    mesh: Path
    """The mesh that it was made from."""
    leg: LegName
    """The leg that it is like: its physics."""
    materials: LegMaterials
    """What it is made of, with its own mass."""
    shape: PneuNetShape | None = None
    """Its sizes; None where the file is of a version that did not keep them."""

    def save(self, name: str, folder: Path) -> Path:
        """Let a name stand for it in a folder of built modules, which its files are in."""
        content = {
            "format_version": self.VERSION,
            "part": self.part.relative_to(folder).as_posix(),
            "mesh": self.mesh.relative_to(folder).as_posix(),
            "leg": self.leg,
            "materials": settings_to_dict(self.materials),
            "shape": None if self.shape is None else settings_to_dict(self.shape),
        }
        return write_json(_file(folder, name), content)

    @classmethod
    def find(cls, name: str, folder: Path) -> BuiltModule:
        """What a name stands for.

        Args:
            name: That of a module in its catalogue.
            folder: The folder of built modules; what it has not may be one that ships.

        Raises:
            FileNotFoundError: No module of that name was built there; says what builds it.
            ArtefactError: What is there is damaged or of another version.
        """
        path = _file(folder, name)
        if not path.exists() and _file(SHIPPED_MODULES, name).exists():
            folder = SHIPPED_MODULES
            path = _file(folder, name)
        if not path.exists():
            ship = {each.stem for each in (SHIPPED_MODULES / "modules").glob("*.json")}
            built = sorted({each.stem for each in path.parent.glob("*.json")} | ship)
            there = f"there are {', '.join(built)}" if built else "there are none"
            meant = get_close_matches(name, built, 1)
            there += f"; did you mean {meant[0]}?" if meant else ""
            raise FileNotFoundError(
                f"module {name} of the catalogue is not built in {folder}, expected {path} ({there}"
                f"); build it with: pneumorph catalogue build [FILE] --only {name} --out {folder}, "
                "where FILE is a catalogue that does not ship"
            )
        content = read_json(path, "built module")
        if content.get("format_version") != cls.VERSION:
            raise ArtefactError(
                f"built module {path} has format version {content.get('format_version')}, expected "
                f"{cls.VERSION}; build it again with pneumorph catalogue build --only {name}"
            )
        with reading(path, "built module"):
            leg_kind(content["leg"])  # refuses what is none
            shape = content.get("shape")
            return cls(
                folder / content["part"],
                folder / content["mesh"],
                content["leg"],
                settings_from_dict(LegMaterials, content["materials"]),
                None if shape is None else settings_from_dict(PneuNetShape, shape),
            )


def _file(folder: Path, name: str) -> Path:
    return folder / "modules" / f"{name}.json"
