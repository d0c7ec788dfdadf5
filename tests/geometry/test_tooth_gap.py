"""Neighbouring teeth of a PneuNet: how far apart they are."""

import numpy as np
import pytest

from pneumorph.catalogue.leg_kinds import measured_leg_mesh, paper_leg_mesh
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.tooth_gap import least_tooth_gap_mm

SHAPE = PneuNetShape()


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
