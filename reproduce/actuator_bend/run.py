"""Why the published pressure map has a slope of four: the bend of one leg by several models.

    python reproduce/actuator_bend/run.py --out runs/actuator_bend

One file for each model, so that a run that was stopped goes on; then bend.json and bend.png.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from pneumorph.artefact import write_json
from pneumorph.fem.bend_curve import BendCurve, bend_curve
from pneumorph.fem.material import LegMaterials, Material
from pneumorph.fem.part_model import leg_model
from pneumorph.fem.rotation import Rotation
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape, mesh_pneunet
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.presets import paper_leg_mesh


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
        10, "stable_neo_hookean", 600.0, 0.45, 10.0, 14, size_mm=6.0
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


def main() -> None:
    """Bend every model's leg."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("runs/actuator_bend"))
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    for name, model in MODELS.items():
        path = folder / f"{name.replace(' ', '_').replace(',', '').replace('.', '')}.json"
        if path.exists():
            continue
        print(name, flush=True)
        start = time.monotonic()
        curve = bend(model)
        write_json(
            path,
            {"name": name, **asdict(model), **asdict(curve), "wall_s": time.monotonic() - start},
        )
        print("  ", [round(each, 1) for each in curve.bend_deg], flush=True)


if __name__ == "__main__":
    main()
