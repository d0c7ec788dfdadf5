"""Sections of files that were made: meshes, what a workshop needs, files of other programs."""

from __future__ import annotations

import csv
from pathlib import Path

from pneumorph.gait.gait_file import read_gait
from pneumorph.geometry.mesh import Mesh
from pneumorph.report import page
from pneumorph.report.mesh_figure import mesh_figure
from pneumorph.report.page import Section
from pneumorph.report.pairs_figure import Pair, pairs_figure
from pneumorph.report.run import Run
from pneumorph.report.sheet import Sheet
from pneumorph.robot.design import Design
from pneumorph.simulation.simulation_settings import SimulationSettings


def making_sections(run: Run, sheet: Sheet) -> list[Section]:
    """Return the mesh, the parts to build, or the exchanged file of a run."""
    sections = []
    if (run.folder / "mesh.npz").exists():
        sections.append(_mesh_section(run, sheet))
    if (run.folder / "drawing.png").exists():
        sections.append(_drawing_section(run))
    if "solids" in run.summary:
        sections.append(_solids_section(run))
    for name, title in (("parts.csv", "Parts"), ("tubes.csv", "Tubes")):
        if (run.folder / name).exists():
            header, *rows = csv.reader((run.folder / name).read_text().splitlines())
            sections.append(Section(title, page.table(header, rows)))
    if run.summary["verb"] == "exchange":
        sections.append(_exchange_section(run, sheet))
    return sections


def _mesh_section(run: Run, sheet: Sheet) -> Section:
    mesh = Mesh.load(run.folder / "mesh.npz")
    rows = [
        *((name, "surface", f"{len(each)} triangles") for name, each in mesh.surfaces.items()),
        *((name, "node set", f"{len(each)} nodes") for name, each in mesh.node_sets.items()),
    ]
    caption = "The mesh at a slant and from below; named surfaces in colours, node sets as dots."
    drawn = sheet.drawn("mesh", mesh_figure(mesh), caption)
    return Section("Regions", drawn + page.table(["region", "kind", "size"], rows))


def _drawing_section(run: Run) -> Section:
    caption = f"Assembly of {run.summary['design']}; drawing.pdf is the same to scale."
    return Section("Drawing", page.picture(run.folder / "drawing.png", caption))


def _solids_section(run: Run) -> Section:
    columns = ["volume_mm3", "triangle_count", "thinnest_wall_mm"]
    rows = [
        [name.replace("_", " "), Path(solid["step"]).name, Path(solid["stl"]).name,
         *(solid[key] for key in columns)]
        for name, solid in run.summary["solids"].items()
    ]  # fmt: skip
    header = ["solid", "STEP", "STL", *(name.replace("_", " ") for name in columns)]
    return Section("Solids to print or mill", page.table(header, rows))


def _exchange_section(run: Run, sheet: Sheet) -> Section:
    files = sorted(
        path for path in run.folder.rglob("*") if path.is_file() and "report" not in path.parts
    )
    rows = [(str(path.relative_to(run.folder)), path.stat().st_size) for path in files]
    body = page.table(["file", "bytes"], rows)
    if (run.folder / "gait.csv").exists():
        gait, comments = read_gait(run.folder / "gait.csv", maximum_pressure_kPa=float("inf"))
        if "design" in comments:
            pair = Pair("gait", Design.parse(comments["design"]), gait, None)
            rate = SimulationSettings().pressure_rate_kPa_per_s
            body += sheet.drawn("gait", pairs_figure([pair], rate), "The gait that was written.")
    return Section("What was written", body)
