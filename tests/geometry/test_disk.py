import numpy as np
import pytest

pytest.importorskip("netgen")

from pneumorph.geometry.disk import DiskShape, mesh_disk


def test_disk_is_a_symmetric_inscribed_cone():
    shape = DiskShape()
    mesh = mesh_disk(shape)
    assert 60 <= len(mesh.nodes) <= 110
    assert np.array_equal(mesh.nodes[mesh.mirror_nodes], mesh.nodes * [1.0, -1.0, 1.0])
    # A polygon of n sides covers sin(2 pi/n) / (2 pi/n) of its circle; n is about 20 here.
    assert 0.96 * shape.volume_mm3() < mesh.volumes.sum() < shape.volume_mm3()
    assert np.allclose(mesh.nodes[mesh.node_sets["top"], 2], shape.top_centre_mm[2])


def test_a_disk_may_be_a_cylinder():
    shape = DiskShape(bottom_radius_mm=50.0, top_radius_mm=50.0)
    mesh = mesh_disk(shape)
    assert np.array_equal(mesh.nodes[mesh.mirror_nodes], mesh.nodes * [1.0, -1.0, 1.0])
    assert 0.9 * shape.volume_mm3() < mesh.volumes.sum() < shape.volume_mm3()
    np.testing.assert_allclose(np.ptp(mesh.nodes[:, 2]), shape.height_mm)


def test_negative_radius_is_refused():
    with pytest.raises(ValueError, match="bottom_radius_mm must be positive"):
        DiskShape(bottom_radius_mm=-1.0)
