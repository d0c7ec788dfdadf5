"""Pressure on a closed cavity: volume, gradient, resultant, and a thick shell."""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import static_equilibrium
from pneumorph.geometry.mesh import MeshError


@pytest.fixture(scope="module")
def shell() -> PartModel:
    return PartModel(
        box_mesh((10.0, 8.0, 6.0), (5, 4, 3), hollow=True), Material(500.0, 0.2), 0.1, (), "cavity"
    )


def wobbled(shell: PartModel) -> np.ndarray:
    rng = np.random.default_rng(4)
    return shell.rest_nodes + rng.uniform(-0.3, 0.3, shell.rest_nodes.shape)


def test_volume_at_rest_is_that_of_the_box(shell):
    assert shell.cavity_volume(shell.rest_nodes) == pytest.approx(6.0 * 4.0 * 2.0)


def test_gradient_is_the_derivative_of_the_volume(shell):
    x, step = wobbled(shell), 1e-5
    direction = np.random.default_rng(5).normal(size=x.shape)
    change = shell.cavity_volume(x + step * direction) - shell.cavity_volume(x - step * direction)
    expected = np.sum(shell.pressure_force(x, 1.0) * direction)
    assert change / (2 * step) == pytest.approx(expected, rel=1e-8)


def test_pressure_in_a_closed_cavity_has_no_resultant(shell):
    x = wobbled(shell)
    force = shell.pressure_force(x, 100.0)
    assert np.abs(force).max() > 10.0
    assert np.abs(force.sum(axis=0)).max() < 1e-10
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-10


def test_pressure_pushes_outwards(shell):
    """In the middle of a face the load is p times the area a node stands for, along the normal."""
    force = shell.pressure_force(shell.rest_nodes, 2.0)
    top = np.flatnonzero(np.abs(shell.rest_nodes[:, 2] - 4.0) < 1e-9)
    in_cavity = np.intersect1d(top, shell.mesh.surfaces["cavity"])
    assert force[in_cavity, 2].sum() == pytest.approx(2.0 * 6.0 * 4.0)


def test_follower_load_turns_with_the_surface(shell):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    x = wobbled(shell)
    np.testing.assert_allclose(
        shell.pressure_force(x @ turn.T, 3.0), shell.pressure_force(x, 3.0) @ turn.T, atol=1e-12
    )


def test_inflating_needs_work_p_dV(shell):
    held = shell.mesh.node_sets["left"]
    result = static_equilibrium(shell, 10.0, held, rotation="polar")
    assert result.converged
    assert shell.cavity_volume(result.positions) > shell.cavity_volume(shell.rest_nodes)
    # Clapeyron: in the linear range the elastic energy is half p dV.
    small = static_equilibrium(shell, 0.01, held, rotation="polar")
    u = (small.positions - shell.rest_nodes).ravel()
    energy = 0.5 * u @ (shell.stiffness(shell.rest_nodes) @ u)
    swelling = shell.cavity_volume(small.positions) - shell.cavity_volume(shell.rest_nodes)
    # The strain is about 1e-5, and so is the departure from linearity.
    assert energy == pytest.approx(0.5 * 0.01 * swelling, rel=1e-3)


def test_part_without_cavity_refuses_pressure():
    part = PartModel(box_mesh(), Material(500.0, 0.2), 0.1)
    with pytest.raises(MeshError, match="no cavity"):
        part.pressure_force(part.rest_nodes, 1.0)
