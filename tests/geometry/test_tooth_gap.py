"""Neighbouring teeth of a PneuNet: how far apart they are, and where those of the leg would touch.

Nothing models their contact.
"""

import numpy as np
import pytest

from pneumorph.catalogue.paper_leg import load_default_leg, measured_leg_mesh, paper_leg_mesh
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.tooth_gap import least_tooth_gap_mm
from pneumorph.reduction.blocked_force import blocked_forces
from pneumorph.reduction.held_bend import held_bends

SHAPE = PneuNetShape()
HIGHEST_KPA = 100.0
REST_ERROR_MM = 0.3
"""The nodes of a reduced leg are within 0.26 mm of those of held-out snapshots at worst, 0.06 on
average (docs/physics.md): a gap that is wider than this is one of the finite elements as well."""


def test_gap_at_rest_is_the_shapes():
    for mesh in (paper_leg_mesh(), measured_leg_mesh()):
        assert least_tooth_gap_mm(SHAPE, mesh, mesh.nodes) == pytest.approx(1.0, abs=1e-9)


def test_gap_of_a_turned_leg_is_the_same_and_of_a_squeezed_one_less():
    mesh = measured_leg_mesh()
    turn = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    assert least_tooth_gap_mm(SHAPE, mesh, mesh.nodes @ turn.T + 5.0) == pytest.approx(1.0)
    moved = mesh.nodes.copy()
    moved[mesh.nodes[:, 0] > -40.5, 0] -= 0.6  # all behind the middle of the first gap
    assert least_tooth_gap_mm(SHAPE, mesh, moved) == pytest.approx(0.4, abs=1e-9)
    moved[mesh.nodes[:, 0] > -40.5, 0] -= 1.2  # and through each other
    assert least_tooth_gap_mm(SHAPE, mesh, moved) == pytest.approx(-0.8, abs=1e-9)


def test_a_mesh_of_another_shape_is_refused():
    with pytest.raises(ValueError, match="no nodes on the walls of the gap at x = -41"):
        least_tooth_gap_mm(SHAPE, measured_leg_mesh().scaled(1.1), measured_leg_mesh().nodes)


def test_teeth_of_a_leg_that_bends_freely_do_not_touch():
    """At the highest pressure; finite elements of 8 mm have a gap of 0.69 mm at 120 kPa
    (reproduce/measured_bend)."""
    leg, mesh = load_default_leg("measured"), measured_leg_mesh()
    *_, (bend, found) = held_bends(leg, mesh, np.linspace(20.0, HIGHEST_KPA, 5))
    assert found.converged
    assert bend > 120.0
    assert least_tooth_gap_mm(SHAPE, mesh, leg.positions(found.alpha)) > REST_ERROR_MM


def test_teeth_of_a_leg_whose_tip_is_kept_down_would_touch_below_30_kPa():
    """Its walls bulge and nothing turns them apart. Nothing models that contact: what is computed
    beyond is of a leg whose teeth pass through each other, which docs/physics.md says. A change
    that moves this pressure asks for another look at it."""
    leg, mesh = load_default_leg("measured"), measured_leg_mesh()
    gaps = [
        least_tooth_gap_mm(SHAPE, mesh, each.positions)
        for each in blocked_forces(leg, mesh, (10.0, 20.0, 30.0))
    ]
    assert gaps[0] > gaps[1] > 0.2
    assert -0.3 < gaps[2] < 0.1
