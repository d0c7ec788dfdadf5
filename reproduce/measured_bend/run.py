"""How far the leg bends with its silicone as measured, without any map of pressures.

    python reproduce/measured_bend/run.py --out runs/measured_bend

The constants are those of the tension test of Dragon Skin 30; none was chosen by a bend. One file
for each equilibrium, so that a run that was stopped goes on; then bend.json and bend.png.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyro
from scipy.interpolate import PchipInterpolator

from pneumorph.base.artefact import load_artefact, read_json, save_artefact, write_json
from pneumorph.base.run_folder import made_once
from pneumorph.catalogue.leg_kinds import load_default_leg
from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.leg_model import leg_model
from pneumorph.fem.material import LegMaterials, Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.silicones import BEAM_RELAXATION, TEST_RATE_PER_S, TEST_STRAIN, silicone
from pneumorph.fem.static import StaticSettings, static_equilibrium
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape, mesh_pneunet
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.geometry.tooth_gap import least_tooth_gap_mm
from pneumorph.report.style import figure_style, new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_REAL = read_json(Path(__file__).with_name("real_leg.json"), "JSON")
PRESSURES = tuple(_REAL["pressure_kPa"])
"""Real pressure [kPa]."""
REAL_BEND_DEG = tuple(_REAL["bend_deg"])
"""What the paper's ten pairs of real and simulated pressure imply of the real leg, read through the
bend of the published simulation [degrees]."""
FINE_SIZES_MM = (3.0, 2.4)
"""Largest edges of finer meshes, whose equilibria take an hour [mm]."""
BEYOND = (110, 120)
"""Pressures that a factor below 1 on the modulus asks for [kPa]."""
FITTED = PRESSURES[::2]
"""Pressures that the factor on the modulus is fitted to; the others test it."""


@dataclass(frozen=True)
class Case:
    """One leg."""

    size_mm: float = 8.0
    """Largest edge of the quadratic tetrahedra, whose grading is 0.9 [mm]."""
    bulk_over_shear: float = 200.0
    sheet_kPa_mm: float = 2e5
    """Young's modulus of the sheet times its thickness: paper of 2 GPa and 0.1 mm, assumed."""
    pressures_kPa: tuple[int, ...] = PRESSURES + BEYOND


CASES = {
    "measured": Case(),
    "sheet twice as stiff": Case(sheet_kPa_mm=4e5, pressures_kPa=(20, 60, 100)),
    "bulk modulus doubled": Case(bulk_over_shear=400.0, pressures_kPa=(20, 60, 100)),
    "finer mesh": Case(size_mm=4.0, pressures_kPa=PRESSURES),
    **{f"edges of {size:g} mm": Case(size_mm=size) for size in FINE_SIZES_MM},
}
"""The prediction first; each of the others changes one thing."""


@cache
def leg_mesh(size_mm: float) -> Mesh:
    """Quadratic mesh of the paper's leg."""
    return quadratic_mesh(
        mesh_pneunet(PneuNetShape(), MesherSettings(size_mm=size_mm, grading=0.9))
    )


def leg(case: Case) -> PartModel:
    """Its finite elements."""
    rubber = silicone("Dragon Skin 30").material(case.bulk_over_shear)
    sheet = Material(case.sheet_kPa_mm / 0.1, 0.3, "st_venant_kirchhoff")
    return leg_model(leg_mesh(case.size_mm), LegMaterials(rubber, sheet, 0.1))


def equilibrium(part: PartModel, case: Case, pressure: int, folder: Path, near: Path) -> np.ndarray:
    """Node positions at a pressure [mm], kept in a file of the folder.

    Args:
        part: The leg.
        case: What it is.
        pressure: Pressure [kPa].
        folder: Of this case's equilibria.
        near: Of those of a like leg on the same mesh, to start from where they are.
    """
    path = folder / f"{pressure}.npz"
    if not path.exists():
        guess, before = part.rest_nodes, 0.0
        lower = [p for p in PRESSURES + BEYOND if p < pressure and (folder / f"{p}.npz").exists()]
        if (near / path.name).exists() and near != folder:
            guess, before = (
                load_artefact(near / path.name, "equilibrium", 1)[0]["positions"],
                pressure,
            )
        elif lower:
            nearest = folder / f"{lower[-1]}.npz"
            guess, before = load_artefact(nearest, "equilibrium", 1)[0]["positions"], lower[-1]
        found = static_equilibrium(
            part,
            float(pressure),
            part.mesh.node_set("inner_end_face"),
            start=guess,
            start_pressure_kPa=float(before),
            rotation="polar",
            settings=StaticSettings(load_step_kPa=10.0),
        )
        if not found.converged:
            raise ArithmeticError(f"no equilibrium above {found.pressure_kPa:g} kPa in {folder}")
        content = {**asdict(replace(case, pressures_kPa=())), "pressure_kPa": pressure}
        save_artefact(path, "equilibrium", 1, {"positions": found.positions}, content)
    return load_artefact(path, "equilibrium", 1)[0]["positions"]


def bend(case: Case, folder: Path, near: Path) -> dict[str, Any]:
    """Bend and gap between teeth of one case at its pressures."""
    part = leg(case)
    bends, gaps = [], []
    for pressure in case.pressures_kPa:
        positions = equilibrium(part, case, pressure, folder, near)
        bends.append(end_face_bend_deg(part.mesh, positions))
        gaps.append(least_tooth_gap_mm(PneuNetShape(), part.mesh, positions))
        print(f"  {pressure} kPa: {bends[-1]:.1f} degrees, gap {gaps[-1]:.2f} mm", flush=True)
    return {"bend_deg": bends, "gap_mm": gaps, "nodes": part.node_count}


def judged(bends: np.ndarray) -> dict[str, Any]:
    """A prediction of the ten bends against the real ones."""
    real = np.array(REAL_BEND_DEG)
    errors = 100.0 * np.abs(bends / real - 1.0)
    return {
        "bend_slope": float(np.polyfit(real, bends, 1)[0]),
        "bend_mean_error_percent": float(errors.mean()),
        "bend_worst_error_percent": float(errors.max()),
    }


def held(bends: np.ndarray) -> np.ndarray:
    """Bend of a leg that is held until its silicone has relaxed: constants of a tension test are
    those of its rate, the relaxed ones lie lower by as much as `fitted_factor` says it.

    Args:
        bends: Bend at all of `PRESSURES` and `BEYOND` [degrees].
    """
    ratio = BEAM_RELAXATION.secant_ratio(TEST_STRAIN, TEST_RATE_PER_S)
    curve = PchipInterpolator([0.0, *PRESSURES, *BEYOND], [0.0, *bends])
    bent: np.ndarray = curve(ratio * np.array(PRESSURES))
    return bent


def shipped() -> dict[str, Any]:
    """The measured leg that ships, whose constants are the relaxed ones: its finite elements (edges
    of 6 mm, tied over a face), as its reduction's report has them."""
    report = load_default_leg("measured").metadata["report"]["bend"]
    bent = dict(zip(report["pressure_kPa"], report["full_deg"], strict=True))
    bends = np.array([bent[pressure] for pressure in PRESSURES])
    return {"bend_deg": bends.tolist(), **judged(bends)}


def fitted_factor(bends: np.ndarray) -> dict[str, Any]:
    """One factor on the modulus: of least squares at half of the pressures, tested at the others.

    Twice the modulus at twice the pressure bends alike, but for the sheet, which hardly stretches.
    """
    curve = PchipInterpolator([0.0, *PRESSURES, *BEYOND], [0.0, *bends])
    real = np.array(REAL_BEND_DEG)
    at = np.isin(PRESSURES, FITTED)
    factors = np.linspace(PRESSURES[-1] / BEYOND[-1], 1.3, 301)  # what the curve reaches
    bent = curve(np.array(PRESSURES)[None] / factors[:, None])
    errors = 100.0 * np.abs(bent / real - 1.0)
    best = int(np.argmin(np.sum((bent / real - 1.0)[:, at] ** 2, axis=1)))
    return {
        "modulus_factor": float(factors[best]),
        "tested_mean_error_percent": float(errors[best, ~at].mean()),
        "tested_worst_error_percent": float(errors[best, ~at].max()),
    }


@figure_style()
def bend_figure(found: dict[str, dict[str, Any]]) -> Figure:
    """Bend against pressure: predicted, and the real leg's."""
    figure = new_figure(5.0, 3.2)
    axes = figure.add_subplot()
    for name, each in found.items():
        marks = "-" if name == "measured" else "x"
        axes.plot(CASES[name].pressures_kPa, each["bend_deg"], marks, label=name)
    axes.plot(PRESSURES, REAL_BEND_DEG, "ko", markersize=4, label="real leg, as published")
    axes.set(xlabel="pressure (kPa)", ylabel="bend (°)", xlim=(0, 105), ylim=(0, None))
    axes.legend(fontsize="x-small")
    return figure


def main(out: Path = Path("runs/measured_bend")) -> None:
    """Bend the leg, judge the prediction, and draw it.

    Args:
        out: Folder of the equilibria, a file for each case, bend.json and bend.png.
    """
    found: dict[str, dict[str, Any]] = {}
    for name, case in CASES.items():
        print(name, flush=True)
        folder, near = (out / each.replace(" ", "_") for each in (name, "measured"))
        if case.size_mm != CASES["measured"].size_mm:
            near = folder
        make = partial(bend, case, folder, near)
        found[name] = made_once(folder / "bend.json", make, name=name, **asdict(case))
    bends = np.array(found["measured"]["bend_deg"])
    content = {
        "cases": found,
        "prediction": judged(bends[: len(PRESSURES)]),
        "held": {"bend_deg": held(bends).tolist(), **judged(held(bends))},
        "prediction_finer_mesh": judged(np.array(found["finer mesh"]["bend_deg"])),
        "fit": fitted_factor(bends),
        "leg that ships": shipped(),
        "finer meshes": {
            name: {**judged(bent[: len(PRESSURES)]), "fit": fitted_factor(bent)}
            for name in (f"edges of {size:g} mm" for size in FINE_SIZES_MM)
            for bent in [np.array(found[name]["bend_deg"])]
        },
    }
    write_json(out / "bend.json", content)
    save_figure(bend_figure(found), out / "bend.png", ("png",))


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
