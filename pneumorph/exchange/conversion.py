"""A gait or a reduced leg, read in one format and written in another program's, or back."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pneumorph.base.checked import Checked, Count, Positive
from pneumorph.base.layers import changed_flags
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.leg_kinds import paper_leg_mesh
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.exchange.sofa_reduction import read_sofa_reduction, reduced_part_of
from pneumorph.exchange.sofa_scene import export_sofa_scene
from pneumorph.exchange.sorotraj import read_sorotraj, write_sorotraj
from pneumorph.fem.leg_model import leg_model
from pneumorph.gait.gait_file import UNIT, gait_remarks, read_gait, write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.interpolated_gait import InterpolatedGait
from pneumorph.geometry.leg_mesh import load_leg_mesh
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartSummary
from pneumorph.reduction.reduced_part import ReducedPart

SHIPPED = "shipped"
"""Stands for the leg that ships, in place of a file."""
GAIT_FILE = "gait.csv"


@dataclass(frozen=True)
class ConversionSettings(Checked):
    """What to write, and the units of what is read."""

    to: Literal["csv", "sorotraj", "sofa", "part"] = "sorotraj"
    """Format to write."""
    kPa_per_unit: Positive | None = None
    """Pressure unit of the sorotraj file [kPa]: 6.894757 for psi; by default what the file says of
    itself, or kPa. A CSV file is always in kPa."""
    repetitions: Count = 1
    """How often the main part of a sorotraj file runs."""
    hold_s: Positive = 0.1
    """In a CSV file that a sorotraj file becomes: how long each command is held [s]. Ramps become
    commands of this length."""
    mesh: Path | None = None
    """Mesh that the reduction belongs to; by default the shipped leg's."""
    physics: Physics = field(default_factory=Physics)
    """Of a SOFA scene."""

    def refuse_unused(self, source: str) -> None:
        """Refuse settings that this conversion would not look at.

        Args:
            source: What is converted.

        Raises:
            ValueError: There is one; names its flag and what it is for.
        """
        of_gait = self.to in ("csv", "sorotraj")
        reads_sorotraj = of_gait and _is_sorotraj(source)
        uses = {
            "--kPa-per-unit": (
                reads_sorotraj or self.to == "sorotraj",
                "where a sorotraj file (YAML) is read or written: the pressures of a CSV file are "
                "in kPa, as its header says, and numbers in another unit are to be multiplied "
                "before",
            ),
            "--repetitions": (reads_sorotraj, "with a sorotraj file (YAML), which has a main part"),
            "--hold-s": (
                reads_sorotraj and self.to == "csv",
                "where a sorotraj file (YAML) becomes a CSV file: a CSV file says itself how long "
                "it holds each command",
            ),
            "--mesh": (not of_gait, "with --to sofa or --to part, of a reduced leg"),
            "--physics.": (self.to == "sofa", "with --to sofa, of a scene"),
        }
        for flag in changed_flags(ConversionSettings(), self):
            for begin, (is_used, use) in uses.items():
                if flag.startswith(begin) and not is_used:
                    raise ValueError(
                        f"{flag} is given, and {source} is converted to {self.to}, expected it "
                        f"{use}; it would be ignored"
                    )


@dataclass(frozen=True)
class ConvertedFile:
    """What was written; what the file is not of stays None."""

    to: str
    wall_s: float
    gait: str | None = None
    """File of the gait."""
    duration_s: float | None = None
    regulator_count: int | None = None
    scene: str | None = None
    """File of the SOFA scene."""
    part: str | None = None
    """File of the reduced leg."""
    torn_attachment: float | None = None
    """Share of the modes' motion at the attachment that is not rigid, in a reduction by SOFA."""
    leg: PartSummary | None = None
    """The reduced leg."""


def convert(source: str, settings: ConversionSettings, folder: RunFolder) -> ConvertedFile:
    """Read one format and write another.

    Args:
        source: Gait file, reduced leg (npz), ``shipped``, or the folder of a reduction by the
            plugin ModelOrderReduction.
        settings: What to write.
        folder: Receives ``gait.csv``, ``gait.yaml``, ``scene.py`` with its files, or ``part.npz``.

    Raises:
        FileNotFoundError: No such source.
        ValueError: The source is damaged, or does not belong to the mesh; or a setting has no
            effect on this conversion.
    """
    settings.refuse_unused(source)
    start = time.monotonic()
    write = _gait if settings.to in ("csv", "sorotraj") else _leg
    written = write(source, settings, folder)
    return ConvertedFile(settings.to, time.monotonic() - start, **written)


def _leg(source: str, settings: ConversionSettings, folder: RunFolder) -> dict[str, Any]:
    # What any such leg is compared with: the paper's materials, whatever its file says of them.
    model = leg_model(paper_leg_mesh() if settings.mesh is None else load_leg_mesh(settings.mesh))
    if settings.to == "sofa":
        own = None if source == SHIPPED else Path(source)
        if own is not None and ReducedPart.load(own).relaxation is not None:
            raise ValueError(
                f"{source} is a leg of the measured physics (it relaxes), expected one of the "
                "published physics: the scene's plugin knows no relaxation; `pneumorph reduce "
                "--preset paper` makes one"
            )
        leg = module_of_leg("published", own)
        scene = export_sofa_scene(folder.path, leg.reduced, model, settings.physics)
        return {"scene": str(scene), "leg": leg.describe()}
    part = reduced_part_of(read_sofa_reduction(Path(source)), model)
    path = part.save(folder / "part.npz")
    return {
        "part": str(path),
        "torn_attachment": part.metadata["torn_attachment"],
        "leg": module_of_leg("published", path).describe(),
    }


def _is_sorotraj(source: str) -> bool:
    return Path(source).suffix in (".yaml", ".yml")


def _gait(source: str, settings: ConversionSettings, folder: RunFolder) -> dict[str, Any]:
    path = Path(source)
    if _is_sorotraj(source):
        gait: HeldGait | InterpolatedGait = read_sorotraj(
            path, settings.kPa_per_unit, settings.repetitions
        )
        comments = {name: said for name, said in gait_remarks(path).items() if name != UNIT}
    else:
        gait, comments = read_gait(path)
    if settings.to == "sorotraj":
        written = write_sorotraj(folder / "gait.yaml", gait, comments, settings.kPa_per_unit or 1.0)
    else:
        held = gait.held(settings.hold_s) if isinstance(gait, InterpolatedGait) else gait
        written = write_gait(folder / GAIT_FILE, held, comments)
    return {
        "gait": str(written),
        "duration_s": gait.duration_s,
        "regulator_count": gait.regulator_count,
    }
