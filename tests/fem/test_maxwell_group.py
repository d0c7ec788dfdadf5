"""Maxwell branches: exact relaxation, loss over a cycle, rigid motion, dissipation, tangent."""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from scipy.spatial.transform import Rotation

from pneumorph.fem.element_stiffness import full_matrices
from pneumorph.fem.material import Material
from pneumorph.fem.maxwell_group import MaxwellGroup
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.solid import tetrahedron_group

SERIES = PronySeries((0.15, 0.25), (0.65, 0.03))
SHEAR = 100.0
MESH = box_mesh((2.0, 1.0, 1.0), (1, 1, 1))
VOLUME = 2.0


@pytest.fixture
def branches() -> MaxwellGroup:
    material = Material(2.0 * SHEAR, 0.0, "stable_neo_hookean")
    return MaxwellGroup(tetrahedron_group(MESH.nodes, MESH.tetrahedra, material), SERIES)


def sheared(amount: float) -> np.ndarray:
    """x + g z along x."""
    return MESH.nodes + amount * MESH.nodes[:, 2:] * [1.0, 0.0, 0.0]


def test_relaxation_after_a_sudden_strain_is_exact_whatever_the_step(branches):
    """psi_i = mu_i Q : Q with Q_i = E exp(-t / tau_i)."""
    gradient = np.eye(3)
    gradient[0, 2] = 0.3
    strain = 0.5 * (gradient.T @ gradient - np.eye(3))
    state = branches.relaxed(MESH.nodes)
    state = branches.advanced(state, sheared(0.3), 1e-9)
    for step in (0.05, 0.25, 0.1):
        state = branches.advanced(state, sheared(0.3), step)
    left = np.exp(-0.4 / np.array(SERIES.times_s))
    expected = VOLUME * SHEAR * SERIES.branch_ratios @ left**2 * np.sum(strain**2)
    assert branches.energy(state) == pytest.approx(expected, rel=1e-6)  # the first step takes 1e-9


def test_loss_over_a_cycle_is_that_of_the_series(branches):
    """Small shear g sin(w t): pi G'' g^2 for a unit of volume; steps of 1/200 cycle err by 2e-4."""
    w, amount, count = 20.0, 1e-4, 200
    step = 2.0 * np.pi / w / count
    state = branches.relaxed(MESH.nodes)
    lost = 0.0
    for number in range(1, 12 * count + 1):
        new = branches.advanced(state, sheared(amount * np.sin(w * number * step)), step)
        if number > 11 * count:
            lost += 0.5 * step * (branches.dissipation(state) + branches.dissipation(new))
        state = new
    expected = np.pi * SHEAR * SERIES.complex_modulus(w).imag * amount**2 * VOLUME
    assert lost == pytest.approx(expected, rel=1e-3)


def test_rigid_motion_changes_nothing(branches):
    state = branches.advanced(branches.relaxed(MESH.nodes), sheared(0.4), 0.01)
    turn = Rotation.from_rotvec([0.3, -1.2, 2.0]).as_matrix()
    turned = branches.advanced(state, sheared(0.4) @ turn.T + [5.0, 1.0, -2.0], 0.02)
    stayed = branches.advanced(state, sheared(0.4), 0.02)
    assert turned.spring == pytest.approx(stayed.spring, abs=1e-13)
    forces = branches.forces_by_corner(stayed, sheared(0.4))
    after = branches.forces_by_corner(turned, sheared(0.4) @ turn.T)
    assert after == pytest.approx(np.einsum("ij,jkp->ikp", turn, forces), abs=1e-10)


def test_what_is_put_in_is_stored_or_lost():
    """Work of the stress along a random path = energy + loss; loss is never negative.

    Both integrals by the trapezoid over fine steps of an even path, so to second order.
    """
    material = Material(2.0 * SHEAR, 0.0, "stable_neo_hookean")
    group = tetrahedron_group(MESH.nodes, MESH.tetrahedra, material)
    branches = MaxwellGroup(group, SERIES)
    random = np.random.default_rng(3)
    ends = [MESH.nodes + 0.2 * random.standard_normal(MESH.nodes.shape) for _ in range(3)]
    x, state = MESH.nodes, branches.relaxed(MESH.nodes)
    work = lost = 0.0
    force = branches.forces_by_corner(state, x)
    for end in ends:
        path = np.linspace(x, end, 401)[1:]
        for new_x in path:
            new = branches.advanced(state, new_x, 2e-4)
            new_force = branches.forces_by_corner(new, new_x)
            move = (new_x - x).T[:, group.nodes_by_corner]
            work -= 0.5 * np.sum((force + new_force) * move)
            power = 0.5 * (branches.dissipation(state) + branches.dissipation(new))
            assert power >= 0.0
            lost += 2e-4 * power
            x, state, force = new_x, new, new_force
    assert lost > 0.2 * work
    assert branches.energy(state) + lost == pytest.approx(work, rel=1e-4)


def test_tangent_is_the_derivative_of_the_force(branches):
    random = np.random.default_rng(5)
    x = MESH.nodes + 0.1 * random.standard_normal(MESH.nodes.shape)
    start = branches.advanced(branches.relaxed(MESH.nodes), sheared(0.2), 0.03)
    direction = random.standard_normal(x.shape)

    def forces(where: np.ndarray) -> np.ndarray:
        return branches.forces_by_corner(branches.advanced(start, where, 0.02), where)

    difference = (forces(x + 1e-5 * direction) - forces(x - 1e-5 * direction)) / 2e-5
    entries = branches.tangent_entries(branches.advanced(start, x, 0.02), x, 0.02)
    move = direction[branches.group.connectivity].reshape(branches.group.element_count, -1)
    product = np.einsum("eij,ej->ei", full_matrices(entries), move)
    expected = -np.transpose(difference, (2, 1, 0)).reshape(len(move), -1)
    assert product == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
