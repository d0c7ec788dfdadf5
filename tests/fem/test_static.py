"""Newton's method for a part at rest: where it ends, and in which units it tells what is left."""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.small_robot import small_leg
from helpers.synthetic_part import synthetic_part

from pneumorph.fem import static
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import (
    StaticResult,
    StaticSettings,
    raised_equilibrium,
    static_equilibrium,
)
from pneumorph.fem.static_tangent import SymmetricTangent
from pneumorph.geometry.quadratic import quadratic_mesh


def test_a_load_that_no_state_bears_is_halved_so_often_and_no_more(monkeypatch):
    part, loads = small_leg(), []

    def never(_problem, x, keeping, target, *_):
        loads.append(target)
        return StaticResult(x, False, np.inf, 1, target)

    monkeypatch.setattr(static, "_newton", never)
    settings = StaticSettings(load_step_kPa=8.0, halving_limit=3)
    found = static_equilibrium(part, 20.0, part.mesh.node_set("attachment"), settings=settings)
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
    part = small_leg()
    force = np.zeros_like(part.rest_nodes)
    force[part.mesh.node_set("right"), 2] = 0.1
    found = static_equilibrium(
        part, 0.0, part.mesh.node_set("attachment"), external_force=force, settings=settings
    )
    assert not found.converged
    assert found.iterations <= 30
    assert (found.iterations == 3) == (settings.iteration_limit == 3)


@pytest.mark.parametrize("raises", [False, True])
def test_where_a_tangent_is_not_definite_a_step_leads_down_the_energy(raises):
    """A column pressed straight beyond Euler's load: Newton's own step would lead to the saddle."""
    mesh = quadratic_mesh(box_mesh((40.0, 1.0, 1.0), (20, 1, 1)))
    part = PartModel(mesh, Material(1000.0, 0.0, "stable_neo_hookean"), 0.1)
    solver = SymmetricTangent(part, mesh.node_set("left"), "polar")
    pressed = mesh.nodes * np.array([0.98, 1.0, 1.0])  # Euler: a strain of 1.3e-4 would do
    down = np.zeros_like(pressed)
    down[mesh.node_set("right"), 2] = 1.0
    still = np.zeros_like(pressed)
    forces = down.ravel()[solver.free][:, None]
    solver.raises = raises
    step = solver.solve(pressed, 0.0, forces, still)
    assert solver.met_indefinite
    assert np.sum(step.reshape(-1, 3) * down) > 0.0
    nearest = solver._by(part.tangent_data(pressed, 0.0, "polar", definite=True), forces)
    assert np.array_equal(step, nearest) is not raises


def test_a_search_that_fails_on_indefinite_tangents_is_made_again_with_raised_ones(monkeypatch):
    part, seen = small_leg(), []

    def never(problem, x, keeping, pressure, before):
        solver = problem.solver
        seen.append((solver.raises, before, pressure))
        solver.met_indefinite = True
        return StaticResult(x, solver.raises, 0.0, 7, pressure)

    monkeypatch.setattr(static, "_newton", never)
    settings = StaticSettings(load_step_kPa=8.0)
    found = static_equilibrium(part, 16.0, part.mesh.node_set("attachment"), settings=settings)
    assert found.converged
    assert found.iterations == 28
    assert seen == [(False, 0.0, 8.0), (True, 0.0, 8.0), (False, 8.0, 16.0), (True, 8.0, 16.0)]


def test_a_load_step_begins_with_the_tangent_of_the_equilibrium_that_it_leaves(monkeypatch):
    part, seen, usual = small_leg(), [], static._step

    def step(problem, x, pressure, *rest):
        seen.append(pressure)
        return usual(problem, x, pressure, *rest)

    monkeypatch.setattr(static, "_step", step)
    settings = StaticSettings(load_step_kPa=1.0)
    static_equilibrium(part, 2.0, part.mesh.node_set("attachment"), settings=settings)
    second = seen.index(2.0)
    assert seen[0] == 0.0
    assert seen[second - 1] == 1.0
    assert set(seen[1 : second - 1]) == {1.0}
    assert set(seen[second:]) == {2.0}


def test_a_part_is_empty_where_no_pressure_is_named():
    part = small_leg()
    x = part.rest_nodes + 0.01 * np.random.default_rng(2).standard_normal(part.rest_nodes.shape)
    np.testing.assert_array_equal(part.tangent_data(x), part.tangent_data(x, 0.0))
    assert np.abs(part.tangent_data(x, 1.0) - part.tangent_data(x)).max() > 1e-3


def test_without_a_load_what_is_unbalanced_is_told_in_millinewtons():
    leg = synthetic_part((4, 4, 4), law="stable_neo_hookean")
    held = leg.mesh.node_set("attachment")
    start = leg.rest_nodes + 0.01 * np.random.default_rng(0).normal(size=leg.rest_nodes.shape)
    start[held] = leg.rest_nodes[held]
    found = static_equilibrium(leg, 0.0, held, start=start, settings=StaticSettings(tolerance=1e-3))
    free = np.setdiff1d(np.arange(len(start)), held)
    left = np.linalg.norm(leg.internal_force(found.positions)[free])
    assert found.converged
    assert found.relative_residual == pytest.approx(left, rel=1e-9)


def test_a_load_that_fails_at_once_is_raised_in_parts(monkeypatch):
    """Steps of pressure and force are halved together where they fail, down to the smallest."""
    part, tried = small_leg(), []
    force = np.zeros_like(part.rest_nodes)
    force[-1, 2] = 8.0

    def steps_of(limit):
        def newton(problem, x, keeping, target, before):
            assert problem.external[-1, 2] == pytest.approx(8.0 / 16.0 * target)
            tried.append(target)
            borne = target - before <= limit
            return StaticResult(x + (1.0 if borne else 5.0), borne, 0.0, 1, target)

        return newton

    def found(limit):
        monkeypatch.setattr(static, "_newton", steps_of(limit))
        settings = StaticSettings(halving_limit=2)
        return raised_equilibrium(
            part, 16.0, part.mesh.node_set("attachment"), force, settings=settings
        )

    whole = found(4.0)
    assert (whole.converged, whole.iterations, whole.pressure_kPa) == (True, 5, 16.0)
    assert tried == [8.0, 4.0, 8.0, 12.0, 16.0]
    assert whole.positions == pytest.approx(part.rest_nodes + 4.0)
    tried.clear()
    none = found(3.0)
    assert (none.converged, none.pressure_kPa, tried) == (False, 0.0, [8.0, 4.0])
    np.testing.assert_array_equal(none.positions, part.rest_nodes)


def test_a_raised_load_has_the_equilibrium_of_one_that_is_found_at_once():
    """To the tolerance: a gentle load, of whose path nothing depends."""
    part = small_leg()
    held = part.mesh.node_set("attachment")
    force = np.zeros_like(part.rest_nodes)
    force[part.mesh.node_set("right"), 2] = 0.5
    once = static_equilibrium(part, 2.0, held, external_force=force, rotation="polar")
    raised = raised_equilibrium(part, 2.0, held, force, rotation="polar")
    assert once.converged
    assert raised.converged
    assert raised.pressure_kPa == 2.0
    moved = np.abs(once.positions - part.rest_nodes).max()
    assert moved > 0.05
    np.testing.assert_allclose(raised.positions, once.positions, atol=1e-5 * moved)


def test_steps_that_turn_rubber_inside_out_are_shortened_where_a_load_is_raised_too(monkeypatch):
    """Each share's first step is made twice as long: in the second half of the load it ends at 1.5
    times the whole displacement, and beyond 1.2 times the part has no energy."""
    part = small_leg()
    held = part.mesh.node_set("attachment")
    force = np.zeros_like(part.rest_nodes)
    force[part.mesh.node_set("right"), 2] = 0.05
    whole = static_equilibrium(part, 0.0, held, external_force=force, rotation="polar")
    furthest = 1.2 * np.abs(whole.positions - part.rest_nodes).max()
    inner, usual = PartModel.internal_force, static._step

    def internal_force(self, x, *rest):
        within = np.abs(x - part.rest_nodes).max() < furthest
        return inner(self, x, *rest) if within else np.full_like(x, np.nan)

    def step(problem, x, pressure, residual, before):
        found, more = usual(problem, x, pressure, residual, before)
        return (found if np.any(before) else 2.0 * found), more

    monkeypatch.setattr(PartModel, "internal_force", internal_force)
    monkeypatch.setattr(static, "_step", step)
    settings = StaticSettings(halving_limit=1)
    raised = raised_equilibrium(part, 0.0, held, force, rotation="polar", settings=settings)
    assert raised.converged
    np.testing.assert_allclose(raised.positions, whole.positions, atol=1e-5 * furthest)
