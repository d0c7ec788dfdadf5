"""A kind of module as a robot's file has it, `[modules.NAME]`; docs/own_robot.md has its fields."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.checked import Bounds, Checked, Positive
from pneumorph.base.settings import laid_over, settings_from_dict, settings_to_dict, upgraded
from pneumorph.catalogue.built_module import BuiltModule
from pneumorph.catalogue.leg_kinds import LegName, leg_kind, load_default_leg, masses_of
from pneumorph.catalogue.leg_module import module_of_leg, recorded_materials
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.module import Module
from pneumorph.fem.material import LegMaterials
from pneumorph.fem.prony import PronySeries
from pneumorph.geometry.leg_mesh import load_leg_mesh
from pneumorph.reduction.reduced_part import SAME_MASS, SAME_THICKNESS, ReducedPart
from pneumorph.robot.scaled_part import as_made_first

_ROUNDED = {"sheet_thickness_mm": SAME_THICKNESS, "mass_kg": SAME_MASS}
"""Fields of materials that a part has rounded, and by how much."""


@dataclass(frozen=True)
class ModuleDescription(Checked):
    """A kind of module: a leg that ships, one of a catalogue, or a part of your own."""

    catalogue: str | None = None
    """Name of a module that `pneumorph catalogue build` has made; it says itself what it is."""

    leg: LegName | None = None
    """A leg that ships, by default that of the robot's physics; of a part of your own the one that
    it bends as: its pressures, and its material where the part does not say what it is made of."""
    part: Path | None = None
    """Reduced part, as `pneumorph reduce` writes it."""
    mesh: Path | None = None
    """Its mesh, as `pneumorph mesh` writes it; for finite elements, and where the part does not say
    what of it is attached."""
    materials: LegMaterials | None = None
    """What it is made of, for finite elements; by default what its reduction says, or the leg, of
    which a file's table need not repeat anything. Other than the part's, it is refused."""
    size_factor: Annotated[float, Bounds(least=0.01, most=100.0)] = 1.0
    """All its lengths, the sheet's thickness among them, over those it was made with."""
    mass_g: Positive | None = None
    """Its mass [g]; by default what its reduction says, or what is cast of the leg that ships."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.catalogue is None:
            return
        for said in ("leg", "part", "mesh", "materials"):
            if getattr(self, said) is not None:
                raise ValueError(
                    f"{said} is given beside catalogue = {self.catalogue!r}, expected one of them: "
                    "the catalogue says what its module is"
                )

    def own_part(self, folder: Path, catalogue_folder: Path) -> ReducedPart | None:
        """The part of one's own, or of a catalogue, that it is; None of a leg that ships, and where
        a file is missing, which tells nothing yet. Arguments as of `module`."""
        if self.catalogue is not None:
            try:
                return ReducedPart.load(BuiltModule.find(self.catalogue, catalogue_folder).part)
            except FileNotFoundError:
                return None
        if self.part is None or not (folder / self.part).is_file():
            return None
        return as_made_first(ReducedPart.load(folder / self.part))

    def refuse_other_materials(self, name: str, part: ReducedPart | None) -> None:
        """Refuse materials that the part was not made of: its reduction would be of one leg and its
        finite elements of another.

        Args:
            name: What the module is called.
            part: Its part, see `own_part`.

        Raises:
            ValueError: There are such.
        """
        if self.materials is None or part is None:
            return
        own = {
            "silicone": part.tetrahedron_material,
            "sheet": part.membrane_material,
            "sheet_thickness_mm": part.sheet_thickness_mm,
            "mass_kg": part.mass,
            "relaxation": part.relaxation or PronySeries(),
        }
        weighed = ("mass_kg",) if self.mass_g is not None else ()
        recorded = part.metadata.get("materials")
        made_of = None if recorded is None else settings_from_dict(LegMaterials, recorded)
        for field, given in vars(self.materials).items():
            either = [getattr(made_of, field, None), own.get(field)]
            known = [each for each in either if each is not None]
            if known and field not in weighed and not any(_same(field, given, k) for k in known):
                raise ValueError(
                    f"modules.{name}.materials.{field} is {given}, expected {known[0]}, which its "
                    "part was made of: its finite elements would be another leg; leave it out, or "
                    "reduce the leg again with it"
                )

    def module(self, name: str, folder: Path, catalogue_folder: Path, usual_leg: LegName) -> Module:
        """The module.

        Args:
            name: What summaries call it.
            folder: Where the paths of files start.
            catalogue_folder: Where modules of a catalogue were built.
            usual_leg: The leg where none is named.

        Raises:
            FileNotFoundError: The catalogue's module is not built there.
            ArtefactError: The part was made from another mesh.
        """
        if self.catalogue is not None:
            built = BuiltModule.find(self.catalogue, catalogue_folder)
            return module_of_leg(
                built.leg,
                built.part,
                built.mesh,
                built.materials,
                Masses(leg_mass_g=self.mass_g),
                size_factor=self.size_factor,
                label=name,
                shape=built.shape,
            )
        part, mesh = (None if path is None else folder / path for path in (self.part, self.mesh))
        if part is not None and mesh is not None:
            shape = load_leg_mesh(mesh)
            as_made_first(ReducedPart.load(part), shape).check_mesh(shape)
        leg = self.leg or usual_leg
        if mesh is not None and part is None:
            _refuse_without_part(name, leg, mesh)
        masses = replace(masses_of(leg) if part is None else Masses(), leg_mass_g=self.mass_g)
        module = module_of_leg(
            leg, part, mesh, self.materials, masses, size_factor=self.size_factor, label=name
        )
        # Nobody has said how a part of one's own bends; the physics says what inflates it.
        own = part is not None and self.leg is None
        return replace(module, pressure_map=None) if own else module


def with_whole_materials(content: Any, folder: Path, usual_leg: LegName) -> Any:
    """A module's table of a file with all of its materials: those that it does not say are what its
    part, or else its leg, is made of. What is no such table, or has none, stays as it is.

    Args:
        content: The table.
        folder: Where the paths of files start.
        usual_leg: The leg where none is named.
    """
    said = content.get("materials") if isinstance(content, Mapping) else None
    if not isinstance(said, Mapping) or "catalogue" in content:  # which says it itself
        return content
    rest = {name: value for name, value in content.items() if name != "materials"}
    try:
        module = settings_from_dict(ModuleDescription, rest)
        leg = module.leg or usual_leg
        part = module.own_part(folder, folder)
        usual = leg_kind(leg).materials if part is None else recorded_materials(part, leg)
    except (TypeError, ValueError):
        return content  # which is refused where it is read, by its place there
    said, whole = upgraded(LegMaterials, said), settings_to_dict(usual)
    for name in ("silicone", "sheet"):
        law = said[name].get("law") if isinstance(said.get(name), Mapping) else None
        if law not in (None, whole[name]["law"]):  # whose constants are its own
            whole[name] = {
                each: whole[name][each] for each in ("young_modulus_kPa", "poisson_ratio")
            }
    return {**rest, "materials": laid_over(whole, said)}


def _same(field: str, given: Any, known: Any) -> bool:
    """Whether two values of a field of materials are one, perhaps rounded."""
    if field in _ROUNDED:
        return math.isclose(given, known, rel_tol=_ROUNDED[field])
    return bool(given == known)


def _refuse_without_part(name: str, leg: LegName, mesh: Path) -> None:
    """Refuse a mesh whose reduced leg would be that of another.

    Raises:
        ArtefactError: The leg that ships was not made from it.
    """
    try:
        load_default_leg(leg).check_mesh(load_leg_mesh(mesh))
    except ArtefactError as error:
        raise ArtefactError(
            f"modules.{name} has the mesh {mesh} and no part, expected both: the {leg} leg that "
            "ships, which would walk, was made from another mesh; reduce yours (`pneumorph reduce "
            f"--mesh {mesh}`) and give the leg.npz that comes out as part"
        ) from error
