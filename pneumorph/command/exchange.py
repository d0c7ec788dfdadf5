"""Turn gaits and reductions into other programs' files, and back.

A gait (CSV, or sorotraj YAML) becomes the other of the two: --to csv or --to sorotraj. A reduced
leg (npz, or `shipped` for the one that ships) becomes a SOFA scene for the ModelOrderReduction
plugin with --to sofa; a folder of such a reduction of one's own becomes a reduced leg with
--to part.

Writes gait.csv, gait.yaml, scene.py with its files, or part.npz.

Example: pneumorph exchange runs/quick/training/gaits/L1.csv --to sorotraj --out runs/sorotraj
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import tyro

from pneumorph.command.robots import part_description
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.exchange.sofa_reduction import read_sofa_reduction, reduced_part_of
from pneumorph.exchange.sofa_scene import export_sofa_scene
from pneumorph.exchange.sorotraj import read_sorotraj, write_sorotraj
from pneumorph.fem.part_model import leg_model
from pneumorph.gait.gait_file import read_gait, write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.interpolated_gait import InterpolatedGait
from pneumorph.geometry.mesh import Mesh
from pneumorph.presets import load_default_leg, paper_leg_mesh
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.simulation.simulation_settings import SimulationSettings

SHIPPED = "shipped"


@dataclass(frozen=True)
class ExchangeOptions:
    """What to turn into what."""

    source: tyro.conf.Positional[str] = tyro.MISSING
    """Gait file, reduced leg (npz), `shipped`, or the folder of a reduction by the plugin."""
    to: Literal["csv", "sorotraj", "sofa", "part"] = "sorotraj"
    """What to write."""
    kPa_per_unit: float = 1.0
    """What one unit of a sorotraj file is [kPa]; 6.894757 for psi."""
    repetitions: int = 1
    """How often a sorotraj file's main part is run."""
    hold_s: float = 0.1
    """Straight lines become commands that are held for so long in a CSV file [s]."""
    mesh: Path | None = None
    """Mesh that a reduction belongs to; by default the shipped leg's."""
    simulation: SimulationSettings = field(default_factory=SimulationSettings)

    def __post_init__(self) -> None:
        if self.repetitions < 1:
            raise ValueError(f"repetitions is {self.repetitions}, expected at least 1")
        for name in ("kPa_per_unit", "hold_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")


def exchange(options: ExchangeOptions, folder: RunFolder) -> dict[str, Any]:
    """Read one format, write another, and say what was written."""
    start = time.monotonic()
    if options.to in ("csv", "sorotraj"):
        summary = _exchange_gait(options, folder)
    else:
        mesh = paper_leg_mesh() if options.mesh is None else Mesh.load(options.mesh)
        model = leg_model(mesh)
        if options.to == "sofa":
            shipped = options.source == SHIPPED
            part = load_default_leg() if shipped else ReducedPart.load(options.source)
            scene = export_sofa_scene(folder.path, part, model, options.simulation)
            summary = {"scene": str(scene), "leg": part_description(part, options.source)}
        else:
            part = reduced_part_of(read_sofa_reduction(Path(options.source)), model)
            path = part.save(folder / "part.npz")
            summary = {
                "part": str(path),
                "torn_attachment": part.metadata["torn_attachment"],
                "leg": part_description(part, str(path)),
            }
    return {"to": options.to, **summary, "wall_s": time.monotonic() - start}


def _exchange_gait(options: ExchangeOptions, folder: RunFolder) -> dict[str, Any]:
    source = Path(options.source)
    comments: dict[str, str] = {}
    if source.suffix in (".yaml", ".yml"):
        gait: HeldGait | InterpolatedGait = read_sorotraj(
            source, options.kPa_per_unit, options.repetitions
        )
    else:
        gait, comments = read_gait(source)
    if options.to == "sorotraj":
        path = write_sorotraj(folder / "gait.yaml", gait, comments)
    else:
        held = gait.held(options.hold_s) if isinstance(gait, InterpolatedGait) else gait
        path = write_gait(folder / "gait.csv", held, comments)
    return {
        "gait": str(path),
        "duration_s": gait.duration_s,
        "regulator_count": gait.regulator_count,
    }


VERB = Verb(ExchangeOptions, exchange)
