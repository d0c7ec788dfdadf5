"""Modes hold all shapes to the tolerance, and no more of them are kept than that needs."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.report.replay.leg_modes import leg_modes


def _affine_shapes(count: int, mode_count: int, seed: int = 0) -> np.ndarray:
    """Shapes (shape, 3 node) of millimetres in an affine space, in single precision."""
    rng = np.random.default_rng(seed)
    mean, modes = 60.0 * rng.standard_normal(150), rng.standard_normal((mode_count, 150))
    return (mean + rng.standard_normal((count, mode_count)) @ modes).astype(np.float32)


def test_an_affine_space_is_found_with_its_dimension_and_held_exactly() -> None:
    shapes = _affine_shapes(900, 7)
    found = leg_modes([shapes[:500], shapes[500:]], 0.01)
    assert len(found.modes) == 7
    error = np.abs(found.shapes(found.coefficients(shapes)) - shapes).max()
    # Shapes and mean of 200 mm and coefficients of 10 mm, each rounded to 2^-24 of its size.
    assert error < 3 * 200 * 2**-24 * 2


def test_other_shapes_are_held_to_the_tolerance_and_a_wider_one_takes_fewer_modes() -> None:
    rng = np.random.default_rng(1)
    decay = 10.0 ** -np.arange(60.0)[:, None].clip(max=5) * rng.standard_normal((60, 150))
    shapes = (rng.standard_normal((400, 60)) @ decay).astype(np.float32)
    counts = []
    for tolerance in (1.0, 0.1, 0.01):
        found = leg_modes([shapes], tolerance)
        assert np.abs(found.shapes(found.coefficients(shapes)) - shapes).max() <= tolerance
        counts.append(len(found.modes))
    assert counts == sorted(set(counts))


def test_a_rare_shape_outside_the_first_sample_is_held_too() -> None:
    shapes = _affine_shapes(4000, 3)
    rare = shapes[1234].copy()
    rare[77] += 5.0  # along no mode of the others
    shapes[1234] = rare
    found = leg_modes([shapes], 0.01)
    assert np.abs(found.shapes(found.coefficients(shapes[[1234]])) - rare).max() <= 0.01


def test_what_cannot_be_held_is_refused() -> None:
    with pytest.raises(ValueError, match="tolerance_mm is 0"):
        leg_modes([_affine_shapes(4, 1)], 0.0)
    broken = _affine_shapes(4, 1)
    broken[2, 3] = np.nan
    with pytest.raises(ValueError, match="the simulation diverged"):
        leg_modes([broken], 0.01)
