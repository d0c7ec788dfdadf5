"""Sections of files that were made: meshes, what a workshop needs, files of other programs."""

from __future__ import annotations

import csv
from pathlib import Path

from pneumorph.exchange.conversion import GAIT_FILE, ConvertedFile
from pneumorph.fabrication.fabricated_robot import FabricatedRobot
from pneumorph.fabrication.parts_list import parts_csv
from pneumorph.fabrication.tube_plan import tubes_csv
from pneumorph.gait.gait_file import read_gait
from pneumorph.geometry.mesh import Mesh
from pneumorph.physics.physics import Physics
from pneumorph.physics.regulators import RateLimited
from pneumorph.report import page
from pneumorph.report.mesh_figure import mesh_figure
from pneumorph.report.page import Section
from pneumorph.report.pairs_figure import Pair, pairs_figure
from pneumorph.report.sheet import Sheet
from pneumorph.robot.design import Design
from pneumorph.study.built_catalogue import Catalogue
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.made_mesh import MESH_FILE, MadeMesh


def mesh_sections(made: MadeMesh, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return a mesh with its regions."""
    mesh = Mesh.load(run.folder / MESH_FILE)
    rows = [
        *((name, "surface", f"{count} triangles") for name, count in made.surfaces.items()),
        *((name, "node set", f"{count} nodes") for name, count in made.node_sets.items()),
    ]
    caption = "The mesh at a slant and from below; named surfaces in colours, node sets as dots."
    drawn = sheet.drawn("mesh", mesh_figure(mesh), caption)
    return [Section("Regions", drawn + page.table(["region", "kind", "size"], rows))]


def catalogue_sections(found: Catalogue, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return what each module is, and what is known of those that are built."""
    shapes = [
        (name, each.length_mm, each.width_mm, each.tooth_count, each.chamber_count, each.leg,
         each.load_pressure_kPa, 1e-3 * each.load_mN)
        for name, each in found.shapes.items()
    ]  # fmt: skip
    header = ["module", "length mm", "width mm", "teeth", "chambers", "as", "up to kPa", "up to N"]
    reports = [
        (name, each.mass_g, each.reached_kPa, each.bend_deg, each.bend_error_percent,
         each.blocked_error_percent, each.compliance_error_percent,
         each.heldout_force_error_percent, each.mode_count, each.tetrahedron_count,
         1e-6 * each.part_bytes)
        for name, each in found.reports.items()
    ]  # fmt: skip
    known = ["module", "mass g", "kPa", "bend deg", "its error %", "blocked force %",
             "compliance %", "held-out forces %", "modes", "points", "MB"]  # fmt: skip
    left = ", ".join(found.not_built)
    return [
        Section("Modules", page.table(header, shapes)),
        Section(
            "Built",
            page.table(known, reports)
            + (page.paragraph(f"Not built: {left}.", "note") if left else ""),
        ),
    ]


def fabrication_sections(made: FabricatedRobot, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return the drawing, the solids, and what to buy and cut."""
    caption = f"Assembly of {made.design}; drawing.pdf is the same to scale."
    rows = [
        [name.replace("_", " "), "" if solid.step is None else Path(solid.step).name,
         Path(solid.stl).name, solid.volume_mm3, solid.triangle_count, solid.thinnest_wall_mm]
        for name, solid in made.solids.items()
    ]  # fmt: skip
    header = ["solid", "STEP", "STL", "volume mm3", "triangle count", "thinnest wall mm"]
    return [
        Section("Drawing", page.picture(run.folder / "drawing.png", caption)),
        Section("Masses", _masses(made)),
        Section("Solids to print or mill", page.table(header, rows)),
        Section("Parts", _table_of(parts_csv(made.parts))),
        Section("Tubes", _table_of(tubes_csv(made.tubes))),
    ]


def _masses(made: FabricatedRobot) -> str:
    """Built and simulated masses side by side, and how far the hub gives way."""
    pairs: dict[str, tuple[float | None, float | None]] = {
        f"leg {each.name}".rstrip(): (each.mass_g, each.simulated_mass_g) for each in made.legs
    }
    if not made.legs:  # of an earlier version
        pairs["leg"] = made.leg_mass_g, made.simulated_leg_mass_g
    pairs["hub"] = made.hub_mass_g, made.simulated_hub_mass_g
    rows = [
        (name, built, simulated, 100.0 * (simulated / built - 1.0))
        for name, (built, simulated) in pairs.items()
        if built is not None and simulated is not None
    ]
    body = page.table(["part", "built g", "simulated g", "difference %"], rows)
    if made.mass_warning is not None:
        body += page.paragraph(made.mass_warning)
    if made.hub_stiffness is not None:
        found = made.hub_stiffness
        body += page.paragraph(
            f"Under {found.largest_force_N:.2g} N at a leg's outer end the hub turns the leg's "
            f"mount by {found.mount_turns_deg:.2g} degrees and moves that end by "
            f"{found.end_moves_mm:.2g} mm, {found.share_of_leg_percent:.2g} % of what the leg "
            "itself gives.",
            "note",
        )
    return body


def _table_of(text: str) -> str:
    header, *rows = csv.reader(text.splitlines())
    return page.table(header, rows)


def conversion_sections(written: ConvertedFile, run: FinishedRun, sheet: Sheet) -> list[Section]:
    """Return the files that were written, and the gait where it is ours."""
    files = sorted(
        path for path in run.folder.rglob("*") if path.is_file() and "report" not in path.parts
    )
    rows = [(str(path.relative_to(run.folder)), path.stat().st_size) for path in files]
    body = page.table(["file", "bytes"], rows)
    if written.to == "csv":
        gait, comments = read_gait(run.folder / GAIT_FILE, maximum_pressure_kPa=float("inf"))
        if "design" in comments:
            pair = Pair("gait", Design.parse(comments["design"]), gait, None)
            usual = RateLimited(Physics().pressure_rate_kPa_per_s)
            figure = pairs_figure([pair], lambda _: usual)
            body += sheet.drawn("gait", figure, "The gait that was written.")
    return [Section("What was written", body)]
