"""A cantilever of rubber let go: it swings at its storage modulus and decays by its loss factor."""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from scipy.optimize import curve_fit
from scipy.sparse import diags_array
from scipy.sparse.linalg import eigsh

from pneumorph.fem.held_motion import held_motion
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.yeoh_constants import yeoh_material
from pneumorph.geometry.quadratic import quadratic_mesh

SERIES = PronySeries((0.02, 0.14, 0.05), (0.65, 0.04, 0.008))


def test_frequency_and_decay_are_those_of_the_series():
    """w^2 = w_0^2 |G*(s)| at s = i w - z w solves s^2 + w_0^2 G*(s) = 0, with w_0 of the relaxed
    bar; the bulk modulus does not relax, whose share in bending is mu / K. Steps of 1/30 period
    slow it by 0.37 %, and the springs' update errs as much."""
    # Wider than high, lest a sideways swing of equal frequency mixes in.
    mesh = quadratic_mesh(box_mesh((40.0, 9.0, 6.0), (4, 1, 1)))
    material = yeoh_material(45.0, bulk_over_shear=1000.0)
    part = PartModel(
        mesh, material, 1.07e-6 * 40.0 * 54.0, mass_lumping="volume", relaxation=SERIES
    )
    free = np.setdiff1d(np.arange(part.node_count), mesh.node_set("left"))
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    stiffness = part.stiffness(part.rest_nodes, "polar")[unknowns][:, unknowns].tocsc()
    masses = diags_array(np.repeat(part.node_mass[free], 3)).tocsc()
    first = float(np.sqrt(eigsh(stiffness, 1, masses, sigma=0.0, v0=np.ones(len(unknowns)))[0][0]))

    s = 1j * first
    for _ in range(50):
        ratios, times = SERIES.branch_ratios, np.array(SERIES.times_s)
        modulus = 1.0 + ratios @ (s * times / (1.0 + s * times))
        s = 0.5 * s + 0.5j * first * np.sqrt(modulus)
    step = 2.0 * np.pi / abs(s) / 30.0

    load = np.zeros_like(mesh.nodes)  # of the first mode, so that no other swings
    load[:, 2] = -1000.0 * part.node_mass * (mesh.nodes[:, 0] / 40.0) ** 2
    tip = mesh.node_set("right")
    times, heights = [], []
    for state in held_motion(part, mesh.node_set("left"), load, step):
        times.append(state.time_s)
        heights.append(state.positions[tip, 2].mean() - 3.0)
        if len(times) == 100:
            break
    t, z = np.array(times), np.array(heights) / abs(heights[-1])

    def swing(t, rest, creep, rate, size, decay, frequency, phase):
        swinging = size * np.exp(-decay * t) * np.cos(frequency * t + phase)
        return rest + creep * np.exp(-rate * t) + swinging

    start = (-1.0, 0.0, 1.0, 1.0, -s.real, s.imag, 0.0)
    found = curve_fit(swing, t[10:], z[10:], start)[0]
    assert found[5] == pytest.approx(s.imag, rel=8e-3)
    assert found[4] / found[5] == pytest.approx(-s.real / s.imag, rel=0.03)
