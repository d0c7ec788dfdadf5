"""A column pressed beyond Euler's load: its straight equilibrium is a saddle, the bent one is not.

The elastica, clamped at its foot, under a dead load P that turns its head by alpha (Love, Treatise
on the Mathematical Theory of Elasticity, section 263): with k = sin(alpha / 2) and complete
elliptic integrals K and E, L = K sqrt(B / P), the head moves sideways by 2 k L / K and stands at
(2 E / K - 1) L.
"""

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.surface_load import traction_load
from scipy.special import ellipe, ellipk

from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import StaticSettings, static_equilibrium
from pneumorph.geometry.quadratic import quadratic_mesh

YOUNG, LENGTH = 1000.0, 40.0


@pytest.mark.parametrize("turn_deg", [60.0, 110.0])
def test_a_column_buckles_as_the_elastica(turn_deg):
    mesh = quadratic_mesh(box_mesh((LENGTH, 1.0, 1.0), (20, 1, 1)))
    part = PartModel(mesh, Material(YOUNG, 0.0, "stable_neo_hookean"), 0.1)
    parameter = np.sin(np.radians(0.5 * turn_deg)) ** 2
    first, second = ellipk(parameter), ellipe(parameter)
    load = YOUNG / 12.0 * (first / LENGTH) ** 2
    skin = mesh.surface_connectivity("skin")
    head = skin[np.all(mesh.nodes[skin[:, :3], 0] > LENGTH - 1e-9, axis=1)]
    # A hundredth of the load to one side says to which, and moves the head by less than 1.5 mm
    # (measured: 0.6 mm at the smaller angle, where it is the softer).
    force = traction_load(mesh.nodes, head, load * np.array([-1.0, 0.0, 0.01]))
    result = static_equilibrium(
        part,
        0.0,
        mesh.node_set("left"),
        external_force=force,
        settings=StaticSettings(iteration_limit=100, patience=60),  # it leaves the saddle slowly
    )
    assert result.converged
    moved = (result.positions - mesh.nodes)[mesh.node_set("right")].mean(axis=0)
    assert moved[2] == pytest.approx(2.0 * np.sqrt(parameter) / first * LENGTH, abs=1.5)
    assert moved[0] == pytest.approx((2.0 * second / first - 2.0) * LENGTH, abs=1.5)
