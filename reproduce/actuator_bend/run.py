"""Why the published pressure map has a slope of four: the bend of one leg by several models.

    python reproduce/actuator_bend/run.py --out runs/actuator_bend

One file for each model, so that a run that was stopped goes on; then bend.json and bend.png.
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyro
from scipy.interpolate import PchipInterpolator

from pneumorph.base.artefact import write_json
from pneumorph.base.result import finite
from pneumorph.base.run_folder import made_once
from pneumorph.catalogue.leg_kinds import paper_leg_mesh
from pneumorph.fem.bend_curve import BendCurve, bend_curve
from pneumorph.fem.leg_model import leg_model
from pneumorph.fem.material import LegMaterials, Material
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape, mesh_pneunet
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.physics.physics import Rotation
from pneumorph.report.style import figure_style, new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BEND_DEG = 60.0
"""Models are compared by the pressure that bends a leg so far."""

PUBLISHED_PAIRS = (
    (10.0, 29.54),
    (20.0, 65.67),
    (30.0, 93.51),
    (40.0, 128.17),
    (50.0, 178.47),
    (60.0, 224.37),
    (70.0, 277.59),
    (80.0, 316.16),
    (90.0, 343.51),
    (100.0, 382.57),
)
"""Real and simulated pressure of equal bend [kPa], from the paper's figure of its calibration."""


@dataclass(frozen=True)
class Model:
    """One model of the leg."""

    nodes: int
    """Nodes of a tetrahedron, 4 or 10."""
    law: str
    young_modulus_kPa: float
    poisson_ratio: float
    step_kPa: float
    count: int
    """Pressures are multiples of the step, so many."""
    rotation: Rotation = "polar"
    size_mm: float | None = None
    """Edge length of the mesh; None for the linear mesh that ships."""


MODELS = {
    "published": Model(4, "corotational", 1160.0, 0.2, 20.0, 19, "edge"),
    "polar rotations": Model(4, "corotational", 1160.0, 0.2, 20.0, 19),
    "St. Venant-Kirchhoff": Model(4, "st_venant_kirchhoff", 1160.0, 0.2, 20.0, 19),
    "neo-Hookean": Model(4, "stable_neo_hookean", 1160.0, 0.2, 20.0, 19),
    "datasheet stiffness, quadratic": Model(
        10, "stable_neo_hookean", 600.0, 0.45, 10.0, 13, size_mm=6.0
    ),
    "neo-Hookean, quadratic": Model(10, "stable_neo_hookean", 1160.0, 0.2, 20.0, 10, size_mm=6.0),
    "polar rotations, quadratic": Model(10, "corotational", 1160.0, 0.2, 20.0, 10, size_mm=6.0),
    "datasheet stiffness, linear": Model(4, "stable_neo_hookean", 600.0, 0.45, 10.0, 14),
    "datasheet stiffness, quadratic, finer": Model(
        10, "stable_neo_hookean", 600.0, 0.45, 20.0, 2, size_mm=4.0
    ),
}
"""The published model first; each of the others changes one thing, or all of them."""


def bend(model: Model) -> BendCurve:
    """Bend one model's leg."""
    mesh = paper_leg_mesh()
    if model.size_mm is not None:
        mesh = mesh_pneunet(PneuNetShape(), MesherSettings(size_mm=model.size_mm, grading=0.9))
    if model.nodes == 10:
        mesh = quadratic_mesh(mesh)
    stiff = Material(2.0 * model.young_modulus_kPa, 0.49, model.law)
    materials = LegMaterials(
        Material(model.young_modulus_kPa, model.poisson_ratio, model.law), stiff
    )
    pressures = [model.step_kPa * (number + 1) for number in range(model.count)]
    return bend_curve(
        leg_model(mesh, materials),
        pressures,
        rotation=model.rotation,
        progress=lambda done, total, _: print(f"  {done}/{total}", flush=True),
    )


def pressure_for(curve: dict[str, Any], bend_deg: float | np.ndarray) -> np.ndarray:
    """Pressure at which a model's leg bends so far, by monotone interpolation [kPa]."""
    inverse = PchipInterpolator([0.0, *curve["bend_deg"]], [0.0, *curve["pressure_kPa"]])
    reached = np.asarray(bend_deg) <= curve["bend_deg"][-1]
    return np.where(reached, inverse(bend_deg), np.nan)


def contributions(curves: dict[str, dict[str, Any]]) -> dict[str, float]:
    """Factor by which each change lowers the pressure for one bend."""
    needed = {name: float(pressure_for(curve, BEND_DEG)) for name, curve in curves.items()}
    chain = ("published", "polar rotations", "neo-Hookean", "neo-Hookean, quadratic",
             "datasheet stiffness, quadratic")  # fmt: skip
    names = ("rotations", "law", "locking", "stiffness")
    steps = zip(names, chain[:-1], chain[1:], strict=True)
    return {name: needed[before] / needed[after] for name, before, after in steps} | {
        "all": needed[chain[0]] / needed[chain[-1]],
        **{f"pressure_kPa: {name}": value for name, value in needed.items()},
    }


def calibration(curves: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Affine map of real pressure to that of equal bend, for the published and the datasheet leg.

    The bend of the real leg is what the published model makes of the published pairs.
    """
    published = curves["published"]
    bend = PchipInterpolator([0.0, *published["pressure_kPa"]], [0.0, *published["bend_deg"]])
    real, simulated = np.array(PUBLISHED_PAIRS).T
    inside = simulated <= published["pressure_kPa"][-1]
    real, bends = real[inside], bend(simulated[inside])
    equal = pressure_for(curves["datasheet stiffness, quadratic"], bends)
    found = np.isfinite(equal)
    slope, intercept = np.polyfit(real[found], equal[found], 1)
    fit = slope * real[found] + intercept
    return {
        "real_kPa": real[found].tolist(),
        "bend_deg": bends[found].tolist(),
        "equal_kPa": equal[found].tolist(),
        "slope": float(slope),
        "intercept_kPa": float(intercept),
        "rms_residual_kPa": float(np.sqrt(np.mean((equal[found] - fit) ** 2))),
    }


@figure_style()
def bend_figure(curves: dict[str, dict[str, Any]], fitted: dict[str, Any]) -> Figure:
    """Bend against pressure of every model, and the real leg's as published."""
    figure = new_figure(7.5, 3.6)
    axes = figure.add_subplot()
    for number, (name, curve) in enumerate(curves.items()):
        dashed = curve["nodes"] == 4
        axes.plot(
            [0.0, *curve["pressure_kPa"]],
            [0.0, *curve["bend_deg"]],
            "--" if dashed else "-",
            color=f"C{number}",
            label=name,
        )
    axes.plot(
        fitted["real_kPa"], fitted["bend_deg"], "ko", markersize=4, label="real leg, as published"
    )
    axes.set(xlabel="pressure (kPa)", ylabel="bend (°)", xlim=(0, 380), ylim=(0, 170))
    figure.legend(fontsize="x-small", loc="outside right upper")
    return figure


def timed(model: Model) -> dict[str, Any]:
    """One model's curve, and how long it took [s]."""
    start = time.monotonic()
    return asdict(bend(model)) | {"wall_s": time.monotonic() - start}


def main(out: Path = Path("runs/actuator_bend")) -> None:
    """Bend every model's leg, say what each change does, and fit the map.

    Args:
        out: Folder of a file for each model, bend.json and bend.png.
    """
    curves = {}
    for name, model in MODELS.items():
        print(name, flush=True)
        path = out / f"{name.replace(' ', '_').replace(',', '').replace('.', '')}.json"
        curves[name] = made_once(path, partial(timed, model), name=name, **asdict(model))
        if not curves[name]["converged"]:
            print(f"{name} found no equilibrium above {curves[name]['pressure_kPa'][-1]:g} kPa")
    fitted = calibration(curves)
    columns = ("bend_deg", "pressure_kPa")
    content = {key: {name: curve[key] for name, curve in curves.items()} for key in columns}
    content |= {"factors": finite(contributions(curves)), "calibration": fitted}
    write_json(out / "bend.json", content)
    save_figure(bend_figure(curves, fitted), out / "bend.png", ("png",))


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
