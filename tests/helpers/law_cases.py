"""Laws and deformation gradients that the tests of elements share."""

import numpy as np
import own_law  # noqa: F401  (registers isochoric_neo_hookean)
from scipy.spatial.transform import Rotation

from pneumorph.fem.material import Material

SHEET_LAWS = ("corotational", "st_venant_kirchhoff", "stable_neo_hookean")
SOLID_LAWS = (*SHEET_LAWS, "isochoric_neo_hookean", "yeoh")
LAWS = [(law, 3) for law in SOLID_LAWS] + [(law, 2) for law in SHEET_LAWS]
"""Each law with each number of material dimensions it is for."""
MEAN = " with mean dilatation"
SOLIDS = (*SOLID_LAWS, "stable_neo_hookean" + MEAN, "yeoh" + MEAN)
"""Each law, and with the volume's change taken once for an element where that differs."""


def case_material(name: str, young: float = 100.0, poisson: float = 0.4) -> Material:
    """A material of one of `SOLIDS`; yeoh stiffens and then softens, as a silicone does."""
    law = name.removesuffix(MEAN)
    ratios = (0.16, -0.017) if law == "yeoh" else (0.0, 0.0)
    return Material(young, poisson, law, *ratios, "pointwise" if law == name else "mean")


def rotations(count: int, seed: int = 0) -> np.ndarray:
    """Random rotations laid out component first, (3, 3, point)."""
    quaternions = np.random.default_rng(seed).normal(size=(count, 4))
    return np.moveaxis(Rotation.from_quat(quaternions).as_matrix(), 0, 2)


def strained(dimension: int, count: int = 20, size: float = 0.25, seed: int = 1) -> np.ndarray:
    """Turned and strained F, det > 0, (3, d, point)."""
    shape = np.random.default_rng(seed).uniform(-size, size, (3, 3, count))
    gradient = product(rotations(count, seed), np.eye(3)[:, :, None] + shape)
    assert np.all(np.linalg.det(np.moveaxis(gradient, 2, 0)) > 0.0)
    return np.ascontiguousarray(gradient[:, :dimension])


def product(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Matrix product at every point."""
    return np.einsum("ijp,jkp->ikp", first, second)


def points(*matrices) -> np.ndarray:
    """Matrices stacked as points, (3, d, point)."""
    return np.stack([np.asarray(matrix, dtype=float) for matrix in matrices], axis=2)
