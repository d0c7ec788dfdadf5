"""How far a leg of two chambers bends aside, as finite elements, held at the hub, without gravity.

    python reproduce/robots/push_aside.py

One chamber of the catalogue's `two_chambers` is inflated, or both, with the sheet under all of the
leg and with a strip of it along the middle: triangles whose middle is within half the width, so
that a strip's edge follows the mesh.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import tyro

from pneumorph.catalogue.built_module import CATALOGUE_FOLDER, BuiltModule
from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.leg_model import leg_model
from pneumorph.fem.static import rising_equilibria
from pneumorph.geometry.face_tie import FaceTie
from pneumorph.geometry.mesh import Mesh

PRESSURES_KPA = (15.0, 30.0, 45.0, 60.0)


def main(widths_mm: tuple[float, ...] = (40.0, 8.0)) -> None:
    """Bend it.

    Args:
        widths_mm: Widths of the sheet [mm]; the leg is 32 mm wide.
    """
    built = BuiltModule.find("two_chambers", CATALOGUE_FOLDER)
    mesh = Mesh.load(built.mesh)
    sheet, end = mesh.surfaces["sheet"], mesh.node_set("outer_end_face")
    across = np.abs(mesh.nodes[sheet[:, :3], 1].mean(axis=1))
    for width in widths_mm:
        strip = replace(mesh, surfaces={**mesh.surfaces, "sheet": sheet[across < width / 2.0]})
        leg, held = leg_model(strip, built.materials), FaceTie.of(strip).nodes
        for chambers, shares in (("left", (1.0, 0.0)), ("both", (1.0, 1.0))):
            inflated = leg.inflated_in(shares)
            for reached, pressure_kPa in zip(
                rising_equilibria(inflated, PRESSURES_KPA, held, rotation="polar"),
                PRESSURES_KPA,
                strict=True,
            ):
                if not reached.converged:
                    raise ArithmeticError(f"no equilibrium at {pressure_kPa:g} kPa")
            aside_mm = reached.positions[end, 1].mean()
            bend_deg = end_face_bend_deg(strip, reached.positions)
            print(
                f"sheet of {min(width, 32.0):g} mm, {chambers} at {PRESSURES_KPA[-1]:g} kPa: "
                f"{bend_deg:.1f} degrees down, {aside_mm:+.2f} mm to the left"
            )


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
