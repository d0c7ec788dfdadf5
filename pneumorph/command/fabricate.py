"""Make the files that a workshop needs to build a design.

STEP and STL files of the mould's two halves (with registration pins, pour and vent holes), of the
core for the cavity and of the hub with its sockets and tube channels; the parts list with the
silicone's volume and mass; the tube plan; and an assembly drawing of this design.

With --robot FILE the hub is the file's box or disk with a socket for each leg of the design, and
every kind of parametric leg gets a mould of its own, also with two chambers. A hub or a leg that is
a mesh is written as its mesh has it, without sockets or a mould.

It compares simulated with built masses, and where they differ by more than a tenth warns and names
the flag that makes them agree. --check-hub computes how far the hub gives way.

All is checked: watertight surfaces, no undercut, no wall too thin, the mesh's volume within 0.5 %.
Writes mould_upper, mould_lower, core, hub and leg (.step, .stl), parts.csv, tubes.csv, drawing.pdf.

Example: pneumorph fabricate 1.0.0.2.2.0.0.1 --out runs/robot

Example: pneumorph fabricate b1.0.2.2.0.b1 --robot examples/plate.toml
--mould.smallest-wall-mm 0.75 --out runs/plate-to-build
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import tyro

from pneumorph.base.idle_settings import within
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.command.verb import Verb, flat
from pneumorph.fabrication.fabricated_robot import FabricatedRobot, checked_hub, fabricate
from pneumorph.fabrication.fabrication_settings import FabricationSettings
from pneumorph.fabrication.robot_to_make import described_robot_to_make, paper_robot_to_make
from pneumorph.report.assembly_drawing import write_assembly_drawing
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.gait_source import robot_of_source


@dataclass(frozen=True)
class FabricateOptions:
    """The design and how to make it."""

    design: tyro.conf.Positional[str] = tyro.MISSING
    """Design such as 1.0.0.2.2.0.0.1, or the folder of a run: of `coopt` or `search` for its best
    one, of `simulate` for the one that walked."""
    fabrication: Annotated[FabricationSettings, flat] = field(default_factory=FabricationSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)
    """The simulation whose masses are compared with the built ones; a run brings its own."""

    def idle_settings(self) -> dict[str, str]:
        """Those of how it is made."""
        return within("fabrication", self.fabrication)


def run(options: FabricateOptions, folder: RunFolder) -> FabricatedRobot:
    """Make, check and draw everything."""
    source, design = Path(options.design), options.design
    if source.is_dir():
        design = FinishedRun.read(source).chosen_design
    settings, description = options.fabrication, options.robot.description
    mesh = settings.mesh or options.robot.full.mesh
    settings, full = replace(settings, mesh=mesh), replace(options.robot.full, mesh=mesh)
    robot = replace(options.robot, full=full).spec()
    if description is None:
        asked = paper_robot_to_make(design, settings, robot)
    else:
        asked = described_robot_to_make(design, description, robot, settings)
    made = fabricate(asked, settings, folder)
    if settings.check_hub:
        made = checked_hub(made, asked, robot, settings, folder)
    drawing = write_assembly_drawing(folder / "drawing.pdf", asked, made)
    return replace(made, drawing=str(drawing))


VERB = Verb(FabricateOptions, run, taken_over=lambda options: robot_of_source(Path(options.design)))
