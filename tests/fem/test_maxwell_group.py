"""Maxwell branches: relaxation, creep, loss over a cycle, rigid motion, dissipation, tangent."""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from scipy.spatial.transform import Rotation

from pneumorph.fem.element_stiffness import full_matrices
from pneumorph.fem.material import Material
from pneumorph.fem.maxwell_group import MaxwellGroup, ViscousState
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


@pytest.mark.parametrize(("w", "count"), [(1.6, 1000), (20.0, 200), (49.0, 200)])
def test_loss_over_a_cycle_is_that_of_the_series(branches, w, count):
    """Small shear g sin(w t), at a gait's 0.25 Hz, between the branches and at the beam's 7.8 Hz:
    pi G'' g^2 for a unit of volume. Steps of a tenth of the fast branch's time err by 1e-3."""
    amount, step = 1e-4, 2.0 * np.pi / w / count
    state = branches.relaxed(MESH.nodes)
    lost, before = 0.0, int(np.ceil(8.0 * max(SERIES.times_s) / (count * step)))
    for number in range(1, (before + 1) * count + 1):
        new = branches.advanced(state, sheared(amount * np.sin(w * number * step)), step)
        if number > before * count:
            lost += 0.5 * step * (branches.dissipation(state) + branches.dissipation(new))
        state = new
    expected = np.pi * SHEAR * SERIES.complex_modulus(w).imag * amount**2 * VOLUME
    assert lost == pytest.approx(expected, rel=1e-3)


def retardation(series: PronySeries, times: np.ndarray) -> np.ndarray:
    """J(t) G_inf, what a rubber gives to a load that stays over what it gives after a long rest.

    J = 1 - sum_m j_m exp(-t / lambda_m): s^2 J(s) G(s) = 1 in Laplace's transform, so the poles
    -1 / lambda_m are the roots of G(s) / G_inf = 1 + sum_i k_i s tau_i / (1 + s tau_i), one below
    each -1 / tau_i in size, and j_m = 1 / (lambda_m^-1 d(G / G_inf)/ds) there (Ferry, chapter 3).
    """
    ratios, tau = series.branch_ratios, np.array(series.times_s)
    poles = [np.polynomial.Polynomial([1.0, each]) for each in tau]
    whole = np.prod(poles)
    numerator = whole + sum(
        k * np.polynomial.Polynomial([0.0, each]) * np.prod([p for p in poles if p is not pole])
        for k, each, pole in zip(ratios, tau, poles, strict=True)
    )
    roots = numerator.roots()
    slopes = (ratios * tau) @ (1.0 + np.multiply.outer(tau, roots)) ** -2.0
    shares = 1.0 / (-roots * slopes)
    return 1.0 - np.exp(np.multiply.outer(times, roots)) @ shares


def test_creep_under_a_load_that_stays_is_the_retardation(branches):
    """A small shear under a sudden constant stress, found in every step from the branches' own
    force: mu (g + sum_i k_i q_i) = s with an even change of g. The first step takes the load as a
    ramp of the strain, so errs by half a step: the creep is 0.4 % of itself behind after three
    steps of a thirtieth of the fastest branch's time, and half as much with steps of half that."""
    stress, ratios = 1e-3 * SHEAR, SERIES.branch_ratios
    errors = []
    for step in (1e-3, 5e-4):
        _, gain = SERIES.step_factors(step)
        state, amounts = branches.relaxed(MESH.nodes), []
        for _ in range(round(0.8 / step)):
            # Branches' shear stress on the face z = 1, at the old amount, and what it gains by dg.
            old = amounts[-1] if amounts else 0.0
            kept = branches.advanced(state, sheared(old), step)
            top = MESH.nodes[:, 2] > 0.5
            force = -branch_force(branches, kept, old)[top, 0].sum() / 2.0  # 2 x 1 mm^2
            change = (stress - SHEAR * old - force) / (SHEAR * (1.0 + gain @ ratios))
            amounts.append(old + change)
            state = branches.advanced(state, sheared(amounts[-1]), step)
        times = step * np.arange(1, len(amounts) + 1)
        found = np.array(amounts) / (stress / SHEAR)
        wanted = retardation(SERIES, times)
        late = times > 3e-3
        errors.append(np.abs(found / wanted - 1.0)[late].max())
    assert retardation(SERIES, np.zeros(1))[0] == pytest.approx(1.0 / (1.0 + ratios.sum()))
    assert errors[0] < 5e-3
    assert errors[1] < 0.6 * errors[0]


def branch_force(branches: MaxwellGroup, state: ViscousState, amount: float) -> np.ndarray:
    """Force of the branches on the nodes [mN], (node, 3)."""
    by_corner = branches.forces_by_corner(state, sheared(amount))
    force = np.zeros_like(MESH.nodes)
    for corner, nodes in enumerate(branches.group.nodes_by_corner):
        np.add.at(force, nodes, by_corner[:, corner].T)
    return force


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
