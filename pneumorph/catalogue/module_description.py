"""A kind of module as a robot's file has it, `[modules.NAME]`; docs/own_robot.md has its fields."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.checked import Bounds, Checked, Positive
from pneumorph.catalogue.built_module import BuiltModule
from pneumorph.catalogue.leg_kinds import LegName, load_default_leg, masses_of
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.module import Module
from pneumorph.fem.material import LegMaterials
from pneumorph.geometry.leg_mesh import load_leg_mesh
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import as_made_first


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
    """What it is made of, for finite elements; by default what its reduction says, or the leg."""
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
