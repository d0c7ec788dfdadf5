"""Force that keeps a leg's tip down: superposition, and that of a basis that holds the answer."""

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_part, vibration_modes

from pneumorph.fem.static import StaticSettings, rising_equilibria, static_equilibrium
from pneumorph.geometry.mesh import MeshError
from pneumorph.reduction import blocked_snapshots
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.blocked_force import blocked_forces

PRESSURES_KPA = (20.0, 60.0)
KEPT_MM = 1e-6  # how near to zero the searches bring the mean height


@pytest.fixture(scope="module")
def leg():
    return synthetic_part((4, 4, 4), law="stable_neo_hookean")


@pytest.fixture(scope="module")
def blocked(leg):
    return list(blocked_forces(leg, leg.mesh, PRESSURES_KPA))


def tip_triangles(leg) -> np.ndarray:
    """Of the end face, all of one size, (triangle, 3)."""
    skin = leg.mesh.surface("skin")
    return skin[np.isin(skin, leg.mesh.node_set("outer_end_face")).all(axis=1)]


def tip_height(leg, positions) -> float:
    """Of the end face over that at rest [mm]."""
    return float((positions - leg.rest_nodes)[tip_triangles(leg), 2].mean())


def test_the_tip_stays_where_it_was(leg, blocked):
    free = static_equilibrium(leg, PRESSURES_KPA[-1], leg.mesh.node_set("attachment"))
    assert abs(tip_height(leg, free.positions)) > 0.5
    for each in blocked:
        assert abs(tip_height(leg, each.positions)) < 1.01 * KEPT_MM


def test_the_force_given_leaves_the_leg_where_it_is(leg, blocked):
    """Kept and given force are one equilibrium: another search that starts there takes no step."""
    triangles = tip_triangles(leg)
    for each in blocked:
        push = np.zeros_like(leg.rest_nodes)
        np.add.at(push[:, 2], triangles.ravel(), each.force_mN / triangles.size)
        given = static_equilibrium(
            leg,
            each.pressure_kPa,
            leg.mesh.node_set("attachment"),
            start=each.positions,
            start_pressure_kPa=each.pressure_kPa,
            external_force=push,
            settings=StaticSettings(tolerance=1e-6),  # the kept one is balanced to 1e-7
        )
        assert given.converged
        assert given.iterations == 0


def test_at_small_pressure_it_is_free_deflection_over_compliance(leg):
    """Superposition; what is left is of second order, here in a deflection of 1e-3 of the leg."""
    (found,) = blocked_forces(leg, leg.mesh, [1.0])
    held = leg.mesh.node_set("attachment")
    free = tip_height(leg, static_equilibrium(leg, 1.0, held).positions)
    triangles = tip_triangles(leg)
    push = np.zeros_like(leg.rest_nodes)
    np.add.at(push[:, 2], triangles.ravel(), 10.0 / triangles.size)
    pushed = static_equilibrium(leg, 0.0, held, external_force=push)
    compliance = tip_height(leg, pushed.positions) / 10.0
    assert found.force_mN == pytest.approx(-free / compliance, rel=0.01)


def test_a_basis_that_holds_the_state_finds_its_force(leg, blocked):
    """Galerkin's solution is the exact one where that lies in the space."""
    moved = [each.positions - leg.rest_nodes for each in blocked]
    columns = np.concatenate([np.stack(moved, axis=2), vibration_modes(leg, 4)], axis=2)
    mass = np.sqrt(np.repeat(leg.node_mass, 3))[:, None]
    flat = np.linalg.qr(mass * columns.reshape(-1, columns.shape[2]))[0] / mass
    reduced = assemble_reduced_part(leg, flat.reshape(*columns.shape))
    found = [each.force_mN for each in blocked_forces(reduced, leg.mesh, PRESSURES_KPA)]
    # The modes are kept in single precision.
    assert found == pytest.approx([each.force_mN for each in blocked], rel=2e-3)


def test_fewer_tips_than_asked_for_are_refused(leg, monkeypatch):
    """Those that are missing would leave a reduction too stiff where nobody looks."""
    found = list(blocked_forces(leg, leg.mesh, [10.0]))
    monkeypatch.setattr(blocked_snapshots, "blocked_forces", lambda *_, **__: iter(found))
    settings = blocked_snapshots.BlockedSnapshotSettings(count=3, pressure_kPa=30.0)
    with pytest.raises(ValueError, match="up to 30 kPa, got none above 10"):
        blocked_snapshots.blocked_snapshots(leg, settings)


def test_a_region_without_faces_is_refused(leg):
    with pytest.raises(MeshError, match="attachment"):
        next(blocked_forces(leg, leg.mesh, [1.0], region="attachment"))


def test_a_small_pressure_takes_two_steps_of_newton(leg):
    """Both unknowns of the linear problem are right at once; one more for what is not linear."""
    triangles = tip_triangles(leg)
    kept = np.zeros_like(leg.rest_nodes)
    np.add.at(kept[:, 2], triangles.ravel(), 1.0 / triangles.size)
    (found,) = rising_equilibria(leg, [1e-3], leg.mesh.node_set("attachment"), kept=kept)
    assert found.converged
    assert found.iterations <= 2
