"""List the modules of a catalogue, or build them: mesh each and reduce it once.

A catalogue is a TOML file of parametric legs by name (docs/own_leg.md). Without a file it is the
one that ships: legs of the measured physics, short and long, narrow and wide, and one with two
chambers side by side, which are there without being built. `build` makes what is missing (with
--shipped also what ships) and resumes where it was stopped; `list` shows the shape, mass, bend at
the highest pressure, errors, highest pressure and force of loads, and size of what is built.

A module is stored under a key of all that it depends on: shape, mesh, materials, physics and
settings of the reduction. It is remade only if one of these changes; the old variant is kept. A
robot's file names a module by `catalogue = "long_wide"`.

Writes KEY/mesh.npz, KEY/leg.npz and KEY/module.json for each module, and modules/NAME.json, which
maps names to keys, into runs/catalogue or --out.

Example: pneumorph catalogue build my_legs.toml
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.built_module import CATALOGUE_FOLDER
from pneumorph.command.verb import Verb, flat
from pneumorph.study.built_catalogue import (
    BuildSettings,
    Catalogue,
    build_catalogue,
    chosen,
    listed,
)
from pneumorph.study.module_catalogue import read_catalogue, shipped_catalogue


@dataclass(frozen=True)
class CatalogueOptions:
    """What to do with which catalogue."""

    action: tyro.conf.Positional[Literal["list", "build"]] = "list"
    """Show what is built, or build what is missing."""
    file: tyro.conf.Positional[Path | None] = None
    """TOML file of the catalogue; by default the one that ships."""
    build: Annotated[BuildSettings, flat] = field(default_factory=BuildSettings)

    def idle_settings(self) -> dict[str, str]:
        """Those of building, where nothing is built."""
        names = ("build.shipped", "build.executor") if self.action == "list" else ()
        return dict.fromkeys(names, "without `build`")


def run(options: CatalogueOptions, folder: RunFolder) -> Catalogue:
    """List or build it."""
    modules = chosen(read_catalogue(options.file or shipped_catalogue()), options.build.only)
    if options.action == "list":
        return listed(modules, folder)
    return build_catalogue(modules, options.build.executor, folder, options.build.shipped)


VERB = Verb(CatalogueOptions, run, folder=lambda _: CATALOGUE_FOLDER, alone=False)
