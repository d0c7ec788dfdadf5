"""Free vibration of a free bar: frequencies of axial and bending modes, and Rayleigh's decay.

nu = 0, so that the axial mode is exact in three dimensions: pi / L sqrt(E / rho).
"""

from functools import cache

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from scipy.integrate import simpson
from scipy.sparse import diags_array
from scipy.sparse.linalg import eigsh

from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.soft_hub import SoftHub, SoftHubState
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.physics.physics import Physics

YOUNG, DENSITY, LENGTH = 1000.0, 1e-6, 6.0
AXIAL = np.pi / LENGTH * np.sqrt(YOUNG / DENSITY)
"""Frequency of the first axial mode [rad/s]."""
FREE_FREE = 4.730040744862704
"""First root of cos(z) cosh(z) = 1."""
ALPHA, BETA = 200.0, 2e-5
"""Rayleigh damping [1/s] and [s]."""


def bar(
    size: tuple[float, float, float], cells: tuple[int, int, int], quadratic: bool
) -> PartModel:
    box = box_mesh(size, cells)
    mesh = quadratic_mesh(box) if quadratic else box
    return PartModel(mesh, Material(YOUNG, 0.0), DENSITY * np.prod(size), mass_lumping="volume")


def mode_like(
    part: PartModel, shape: np.ndarray, near: float, axes: tuple[int, ...] = (0, 1, 2)
) -> tuple[float, np.ndarray]:
    """Frequency [rad/s] and shape, orthonormal in mass, of the mode likest to a shape.

    Args:
        part: The part.
        shape: Displacement of the nodes along each of `axes`, (node, axis).
        near: Where to look [rad/s].
        axes: Along which nodes may move.
    """
    unknowns = (3 * np.arange(part.node_count)[:, None] + np.array(axes)).ravel()
    mass = np.repeat(part.node_mass, len(axes))
    stiffness = part.stiffness(part.rest_nodes, "polar")[unknowns][:, unknowns].tocsc()
    squares, modes = eigsh(
        stiffness, 8, diags_array(mass).tocsc(), sigma=near**2, v0=np.ones(len(mass))
    )
    likeness = np.abs(modes.T @ (mass * shape.ravel())) / np.sqrt(mass @ shape.ravel() ** 2)
    best = int(np.argmax(likeness))
    assert likeness[best] > 0.99
    return float(np.sqrt(squares[best])), modes[:, best]


def axial_bar(cells: int, quadratic: bool) -> tuple[PartModel, np.ndarray]:
    """A bar 6 x 1 x 1 mm of cubes, `cells` over its section, and u_x of its mode, (node, 1)."""
    part = bar((LENGTH, 1.0, 1.0), (6 * cells, cells, cells), quadratic)
    return part, np.cos(np.pi * part.rest_nodes[:, :1] / LENGTH)


@pytest.mark.parametrize(("quadratic", "sizes"), [(False, (2, 4)), (True, (1, 2))])
def test_axial_frequency_converges_at_second_order(quadratic, sizes):
    """Linear elements by themselves (Strang and Fix, section 6.3), quadratic ones by their lumped
    mass: it integrates squares with an error of h^2 (test_node_mass.py).

    Nodes move along the bar alone, lest a bending mode of like frequency mix in.
    """
    errors = []
    for cells in sizes:
        part, along = axial_bar(cells, quadratic)
        errors.append(abs(mode_like(part, along, AXIAL, (0,))[0] / AXIAL - 1.0))
    # The next term, (k h)^2 relative to the first, is a few per cent of h = 1/2 and 27 % of h = 1.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


def free_free_shape(x: np.ndarray, derivative: int) -> np.ndarray:
    """w of the first bending mode of a free beam of length 1, or its derivative."""
    z = FREE_FREE * x
    ratio = (np.cosh(FREE_FREE) - np.cos(FREE_FREE)) / (np.sinh(FREE_FREE) - np.sin(FREE_FREE))
    quarter = derivative * np.pi / 2.0  # each derivative turns cosine and sine by a quarter
    hyperbolic = (np.cosh(z), np.sinh(z)) if derivative % 2 == 0 else (np.sinh(z), np.cosh(z))
    even = hyperbolic[0] + np.cos(z + quarter)
    odd = hyperbolic[1] + np.sin(z + quarter)
    return FREE_FREE**derivative * (even - ratio * odd)


def test_bending_frequency():
    """First free-free mode, omega = beta^2 sqrt(E I / rho A) with beta L = 4.730.

    Rotary inertia and shear lower it by I / (2 A) (R + S E / kappa G) of itself to first order
    (Rayleigh's quotient), R = int w'^2 / int w^2 and S = int w'''^2 / int w''^2, kappa = 5/6.
    """
    length = 20.0
    x = np.linspace(0.0, 1.0, 4001)
    squares = [simpson(free_free_shape(x, n) ** 2, x=x) for n in range(4)]
    rotary, shear = squares[1] / squares[0], squares[3] / squares[2]
    correction = (rotary + shear * 2.0 / (5.0 / 6.0)) / (24.0 * length**2)
    assert 0.005 < correction < 0.01
    slender = (FREE_FREE / length) ** 2 * np.sqrt(YOUNG / 12.0 / DENSITY)
    # Twice as wide as high, so that the two planes of bending do not mix.
    part = bar((length, 2.0, 1.0), (20, 2, 2), quadratic=True)
    shape = free_free_shape(part.rest_nodes[:, :1] / length, 0) * [0.0, 0.0, 1.0]
    found, _ = mode_like(part, shape, slender)
    # Lumping exaggerates int w^2 and the rotary inertia by 7/162 h^2 of their neighbourhood
    # (test_node_mass.py), here with h = 1 along and 1/2 across; that is the larger part of what is
    # left, and the elements' own stiffness works against it.
    lumping = 0.5 * 7.0 / 162.0 * (1.0 + 0.25) * rotary / length**2
    assert 1.0 - correction - lumping < found / slender < 1.0 - correction + 0.1 * lumping


@cache
def axial_mode() -> tuple[PartModel, float, np.ndarray]:
    """A bar, the frequency [rad/s] of its axial mode and this mode."""
    part, along = axial_bar(1, True)
    return part, *mode_like(part, along * [1.0, 0.0, 0.0], AXIAL)


def oscillation(
    damping: str, step: float, alpha: float = ALPHA, beta: float = BETA
) -> tuple[float, float, float]:
    """Decay [1/s] and frequency [rad/s] of the axial mode in 40 steps; its undamped frequency."""
    part, frequency, mode = axial_mode()
    physics = Physics(
        time_step_s=step,
        damping=damping,
        mass_damping_per_s=alpha,
        stiffness_damping_s=beta,
        gravity_mm_per_s2=0.0,
    )
    body, mass = SoftHub(part), np.repeat(part.node_mass, 3)
    amplitude = 1e-6 / np.abs(mode).max()
    start = part.rest_nodes + amplitude * mode.reshape(-1, 3)
    state = SoftHubState(start, np.zeros(body.unknown_count))
    records = []
    for _ in range(40):
        records.append(mode @ (mass * (state.positions - part.rest_nodes).ravel()) / amplitude)
        matrix, right = body.system(state, physics)
        state = body.advance(state, np.linalg.solve(matrix, right), step)
    # A damped oscillation has q_2 = s q_1 - d q_0 with roots exp((-decay +- i omega) h).
    q = np.array(records)
    (s, d), *_ = np.linalg.lstsq(np.column_stack([q[1:-1], -q[:-2]]), q[2:], rcond=None)
    root = np.log(np.roots([1.0, -s, d])[0]) / step
    return -root.real, abs(root.imag), frequency


@pytest.mark.parametrize("damping", ["published", "objective"])
def test_decay_is_rayleighs_to_first_order_in_the_step(damping):
    """zeta = (alpha / omega + beta omega) / 2; implicit Euler adds omega^2 h / 2 and more.

    About rest the two dampings are one.
    """
    steps = np.array([2.0 * np.pi / AXIAL / count for count in (400, 800)])
    (coarse, slow, w), (fine, fast, _) = (oscillation(damping, step) for step in steps)
    decay = 0.5 * (ALPHA + BETA * w**2)
    # The step multiplies the amplitude by D^(-1/2), D = 1 + alpha h + h (h + beta) omega^2. Strains
    # of 1e-6 and 1e-10 of the amplitude lost to rounding allow 1e-4.
    exact = np.log1p(ALPHA * steps + steps * (steps + BETA) * w**2) / (2.0 * steps)
    np.testing.assert_allclose([coarse, fine], exact, rtol=1e-4)
    # First order: halving the step halves the excess, up to (omega h)^2 and decay h, 1 %.
    assert (coarse - decay) / (fine - decay) == pytest.approx(2.0, rel=0.02)
    assert 2.0 * fine - coarse == pytest.approx(decay, rel=1e-3)
    assert 2.0 * fast - slow == pytest.approx(np.sqrt(w**2 - decay**2), rel=1e-3)


def added_damping_ratio(turn: float) -> float:
    """Damping ratio that a step of implicit Euler gives an oscillator without damping.

    It multiplies the amplitude by 1 / (1 - i w h) a step, (8) of docs/physics.md with a = b = 0: by
    (1 + w^2 h^2)^(-1/2) in size, at the phase arctan(w h).

    Args:
        turn: w h, how far the oscillator turns in a step [rad].
    """
    logarithm, phase = 0.5 * np.log1p(turn**2), np.arctan(turn)
    return float(logarithm / np.hypot(logarithm, phase))


@pytest.mark.parametrize(
    ("frequency_Hz", "added", "added_by_half"),
    [
        (7.8, 0.230, 0.120),
        (4.3, 0.132, 0.067),
        (3.4, 0.105, 0.053),
        (1.0, 0.031, 0.016),
        (0.25, 0.0079, 0.0039),
    ],
)
def test_what_the_step_of_robots_adds_to_the_damping(frequency_Hz, added, added_by_half):
    """The table of docs/physics.md to its digits, and steps of the bar, whose mode turns as far in
    a step as one of this frequency in 0.01 s; strains and rounding as above."""
    for step_s, told in ((0.01, added), (0.005, added_by_half)):
        turn = 2.0 * np.pi * frequency_Hz * step_s
        expected = added_damping_ratio(turn)
        assert expected == pytest.approx(told, abs=5.1e-4 if told > 0.01 else 5.1e-5)
        decay, slowed, frequency = oscillation("objective", turn / axial_mode()[1], 0.0, 0.0)
        assert decay / np.hypot(decay, slowed) == pytest.approx(expected, rel=1e-3)
        assert slowed / frequency == pytest.approx(np.arctan(turn) / turn, rel=1e-3)
