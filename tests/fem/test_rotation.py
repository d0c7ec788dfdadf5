"""Rotations of deformation gradients that no iteration reaches."""

import numpy as np

from pneumorph.fem.rotation import polar_rotation


def test_crushed_elements_get_the_nearest_rotation_among_whole_ones():
    """Of F = U S V^T the nearest proper rotation is U diag(1, 1, det U V^T) V^T (Kabsch)."""
    drawn = np.random.default_rng(0).normal(size=(3, 3, 7))
    gradient = np.eye(3)[:, :, None] + 0.1 * drawn
    gradient[:, 2, [1, 5]] *= -0.3  # turned inside out
    found = polar_rotation(gradient)
    for number in range(7):
        left, _, right = np.linalg.svd(gradient[:, :, number])
        handed = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
        np.testing.assert_allclose(found[:, :, number], left @ handed @ right, atol=1e-12)
