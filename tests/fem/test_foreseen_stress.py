"""Newton's method for a bar on a stiff sheet that turns far."""

import numpy as np
from helpers.box_mesh import box_mesh

from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.silicones import silicone
from pneumorph.fem.static import StaticSettings, static_equilibrium
from pneumorph.geometry.quadratic import quadratic_mesh

SHEET = Membrane("bottom", Material(2e6, 0.3, "st_venant_kirchhoff"), 0.1)


def bar() -> PartModel:
    mesh = quadratic_mesh(box_mesh((60.0, 6.0, 4.0), (12, 1, 1)))
    return PartModel(mesh, silicone("Dragon Skin 30").material(), 0.01, (SHEET,))


def test_a_bar_on_a_stiff_sheet_bends_by_half_its_length_at_once():
    """Ten Newton steps; with the stresses that the steps really reach, none is found in forty."""
    part = bar()
    force = np.zeros_like(part.rest_nodes)
    right = part.mesh.node_set("right")
    force[right, 2] = 40.0 / len(right)
    result = static_equilibrium(
        part,
        0.0,
        part.mesh.node_set("left"),
        external_force=force,
        rotation="polar",
        settings=StaticSettings(iteration_limit=20),
    )
    assert result.converged
    assert result.positions[right, 2].mean() > 27.0


def test_a_step_of_nothing_changes_no_tangent():
    part = bar()
    x = part.rest_nodes + 0.01 * np.random.default_rng(1).standard_normal(part.rest_nodes.shape)
    usual = part.tangent_data(x, rotation="polar")
    same = part.tangent_data(x, rotation="polar", change=np.zeros_like(x))
    assert np.abs(same - usual).max() < 1e-12 * np.abs(usual).max()
