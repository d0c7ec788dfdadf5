"""Newton's method for a bar on a stiff sheet that turns far, and loads that are found in vain."""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.small_robot import small_leg

from pneumorph.fem import static
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.silicones import silicone
from pneumorph.fem.static import StaticResult, StaticSettings, static_equilibrium
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


def test_a_load_that_no_state_bears_is_halved_so_often_and_no_more(monkeypatch):
    part, loads = bar(), []

    def never(_part, x, keeping, target, *_):
        loads.append(target)
        return StaticResult(x, False, np.inf, 1, target)

    monkeypatch.setattr(static, "_newton", never)
    settings = StaticSettings(load_step_kPa=8.0, halving_limit=3)
    found = static_equilibrium(part, 20.0, part.mesh.node_set("left"), settings=settings)
    assert not found.converged
    assert loads == [8.0, 4.0, 2.0, 1.0]


@pytest.mark.parametrize(
    "settings",
    [
        StaticSettings(tolerance=1e-300, iteration_limit=3, halving_limit=0),
        StaticSettings(tolerance=1e-300, iteration_limit=40, patience=2, halving_limit=0),
    ],
)
def test_a_search_ends_at_its_limit_or_when_its_patience_ends(settings):
    part = bar()
    force = np.zeros_like(part.rest_nodes)
    force[part.mesh.node_set("right"), 2] = 0.1
    found = static_equilibrium(
        part, 0.0, part.mesh.node_set("left"), external_force=force, settings=settings
    )
    assert not found.converged
    assert found.iterations <= 30
    assert (found.iterations == 3) == (settings.iteration_limit == 3)


def test_a_part_is_empty_where_no_pressure_is_named():
    part = small_leg()
    x = part.rest_nodes + 0.01 * np.random.default_rng(2).standard_normal(part.rest_nodes.shape)
    np.testing.assert_array_equal(part.tangent_data(x), part.tangent_data(x, 0.0))
    assert np.abs(part.tangent_data(x, 1.0) - part.tangent_data(x)).max() > 1e-3
