"""The load of a pressure or traction on triangles, by integration over them."""

import numpy as np

from pneumorph.fem.quadrature import shape_gradients, shape_values

# Dunavant's rule of degree 4, Int. J. Numer. Meth. Eng. 21 (1985) 1129: exact for the quartic
# integrand N_n (x_u x x_v) of a quadratic triangle.
_OUTER = (0.445948490915965, 0.091576213509771)
_POINTS = np.array([np.roll([1.0 - 2.0 * a, a, a], turn) for a in _OUTER for turn in range(3)])
_WEIGHTS = np.repeat([0.223381589678011, 0.109951743655322], 3) / 2.0


def pressure_load(x: np.ndarray, triangles: np.ndarray, pressure: float) -> np.ndarray:
    """p int N_n n dA [mN], (node, 3).

    Args:
        x: Node positions [mm], (node, 3).
        triangles: Node indices, (triangle, 3 or 6), normals along the push.
        pressure: Pressure [kPa].
    """
    return _gathered(x, triangles, pressure * _normals(x, triangles))


def traction_load(x: np.ndarray, triangles: np.ndarray, traction: np.ndarray) -> np.ndarray:
    """int N_n t dA [mN], (node, 3), of an even traction t [kPa], (3,)."""
    area = np.linalg.norm(_normals(x, triangles), axis=2, keepdims=True)
    return _gathered(x, triangles, area * traction)


def _normals(x: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """x_u x x_v at the points, (triangle, point, 3)."""
    slopes = shape_gradients(_POINTS, triangles.shape[1])
    tangents = np.einsum("tni,qnd->dtqi", x[triangles], slopes)
    return np.cross(tangents[0], tangents[1])


def _gathered(x: np.ndarray, triangles: np.ndarray, at_points: np.ndarray) -> np.ndarray:
    values = shape_values(_POINTS, triangles.shape[1])
    force = np.zeros_like(x)
    np.add.at(force, triangles, np.einsum("q,qn,tqi->tni", _WEIGHTS, values, at_points))
    return force
