"""Mass, centre of mass and inertia of a body, from its shape and density."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from pneumorph.geometry.surface import enclosed_volume, surface_area
from pneumorph.geometry.triangle_distance import distance_to

KG_PER_MM3 = 1e-6
"""Kilograms in a cubic millimetre of density 1 g/ml."""
_ONE_PLANE = 1e-6
"""Squared sine of angles, some 0.1 degrees, below which planes are one."""

_FACING = 0.5
"""Cosine between a node's way in and a face's normal from which on the face is the other side's:
faces beside a rounded edge look the other way."""
_WITHIN = 0.98
"""Share of the wall within which the other side's face is met: what planes fitted to curved skins
are off by."""


@dataclass(frozen=True, eq=False)
class MassProperties:
    """What a rigid body is in mechanics.

    Args:
        mass_kg: Mass [kg].
        centre_mm: Centre of mass [mm], (3,).
        inertia: Inertia tensor about the centre of mass, along the frame's axes [kg mm^2], (3, 3).

    Raises:
        ValueError: The mass is not positive, or the tensor is no body's: not symmetric, or a
            principal moment larger than the sum of the others.
    """

    mass_kg: float
    centre_mm: np.ndarray
    inertia: np.ndarray

    def __post_init__(self) -> None:
        _check_positive("mass_kg", self.mass_kg)
        for name, shape in (("centre_mm", (3,)), ("inertia", (3, 3))):
            value = np.array(getattr(self, name), dtype=float)
            if value.shape != shape or not np.isfinite(value).all():
                raise ValueError(f"{name} must be finite of shape {shape}, got {value.shape}")
            object.__setattr__(self, name, value)
        scale = np.trace(self.inertia)
        principal = np.linalg.eigvalsh(self.inertia)
        tolerance = 1e-9 * abs(scale)
        if (
            np.abs(self.inertia - self.inertia.T).max() > tolerance
            or principal[0] < -tolerance
            or principal[2] > principal[0] + principal[1] + tolerance
        ):
            raise ValueError(
                f"inertia has principal moments {', '.join(f'{m:g}' for m in principal)} kg mm^2, "
                "which no body has: expected a symmetric tensor whose moments are not negative, "
                "none larger than the sum of the others"
            )

    @property
    def first_moment(self) -> np.ndarray:
        """sum m r about the frame's origin [kg mm], (3,)."""
        return self.mass_kg * self.centre_mm

    @property
    def second_moment(self) -> np.ndarray:
        """sum m r r^T about the frame's origin [kg mm^2], (3, 3)."""
        about_centre = 0.5 * np.trace(self.inertia) * np.eye(3) - self.inertia
        moved = about_centre + self.mass_kg * np.outer(self.centre_mm, self.centre_mm)
        return 0.5 * (moved + moved.T)

    def weighing(self, mass_kg: float) -> MassProperties:
        """The same shape of another mass, as a balance says; inertia is scaled with it.

        Raises:
            ValueError: The mass is not positive.
        """
        _check_positive("mass_kg", mass_kg)
        return replace(self, mass_kg=mass_kg, inertia=self.inertia * (mass_kg / self.mass_kg))

    @classmethod
    def of_moments(
        cls, mass_kg: float, first_moment: np.ndarray, second_moment: np.ndarray
    ) -> MassProperties:
        """From sums over the mass about the frame's origin.

        Args:
            mass_kg: Mass [kg].
            first_moment: sum m r [kg mm], (3,).
            second_moment: sum m r r^T [kg mm^2], (3, 3).
        """
        _check_positive("mass_kg", mass_kg)
        centre = first_moment / mass_kg
        about_centre = second_moment - mass_kg * np.outer(centre, centre)
        return cls(mass_kg, centre, np.trace(about_centre) * np.eye(3) - about_centre)

    @classmethod
    def of_tetrahedra(
        cls, nodes: np.ndarray, tetrahedra: np.ndarray, density_g_per_ml: float
    ) -> MassProperties:
        """Of a mesh filled evenly.

        A tetrahedron of volume V with corners x_i has the integrals V/4 sum x_i and
        V/20 (sum x_i x_i^T + s s^T), s = sum x_i.

        Args:
            nodes: Positions [mm], (node, 3).
            tetrahedra: Corners of positive tetrahedra, (element, 4).
            density_g_per_ml: Density [g/ml].

        Raises:
            ValueError: The density is not positive.
        """
        _check_positive("density_g_per_ml", density_g_per_ml)
        return cls._of_corners(nodes[tetrahedra], density_g_per_ml)

    @classmethod
    def of_surface(
        cls, nodes: np.ndarray, triangles: np.ndarray, density_g_per_ml: float
    ) -> MassProperties:
        """Of what a closed surface encloses: signed tetrahedra from the origin to its triangles.

        Args:
            nodes: Positions [mm], (node, 3).
            triangles: Corners, normals outward, (triangle, 3).
            density_g_per_ml: Density [g/ml].

        Raises:
            ValueError: The density or the volume is not positive.
        """
        _check_positive("density_g_per_ml", density_g_per_ml)
        return cls._of_skin(nodes[triangles], density_g_per_ml)

    @classmethod
    def of_shell(
        cls, nodes: np.ndarray, triangles: np.ndarray, wall_mm: float, density_g_per_ml: float
    ) -> MassProperties:
        """Of walls inside a closed surface: what it encloses, less what the surface encloses that
        lies a wall further in.

        Its planes move in at right angles to themselves: flat faces, edges and corners of three
        faces do so exactly.

        Args:
            nodes: Positions [mm], (node, 3).
            triangles: Corners, normals outward, (triangle, 3).
            wall_mm: Thickness [mm].
            density_g_per_ml: Density [g/ml].

        Raises:
            ValueError: The thickness or the density is not positive, or walls of such a thickness
                leave no hollow between them, or meet where the solid is thinnest.
        """
        _check_positive("wall_mm", wall_mm)
        _check_positive("density_g_per_ml", density_g_per_ml)
        skin, corners = np.unique(triangles, return_inverse=True)
        triangles = corners.reshape(triangles.shape)
        outer = nodes[skin] - nodes[skin].mean(axis=0)
        inwards = _inwards(outer, triangles)
        most_mm = _solid_from_mm(outer, inwards, triangles)
        if wall_mm > (1.0 - 1e-6) * most_mm:
            raise ValueError(
                f"wall_mm is {wall_mm:g}, expected less than {most_mm:.4g}: such walls would leave "
                "no hollow between them; leave it out for a solid"
            )
        inner = outer + wall_mm * inwards
        if (meets := _first_meeting(outer, inner, triangles, wall_mm)) is not None:
            place = ", ".join(f"{each:.4g}" for each in nodes[skin][meets])
            raise ValueError(
                f"wall_mm is {wall_mm:g}, expected less than half of the thickness everywhere: "
                f"walls meet at ({place}) mm; thicken that part, or leave wall_mm out for a solid"
            )
        both = np.concatenate([outer[triangles], inner[triangles][:, ::-1]])
        walls = cls._of_skin(both, density_g_per_ml)
        return replace(walls, centre_mm=walls.centre_mm + nodes[skin].mean(axis=0))

    @classmethod
    def of_solid(cls, solid: Any, density_g_per_ml: float) -> MassProperties:
        """Of an OpenCASCADE solid, round faces exactly.

        Args:
            solid: The solid.
            density_g_per_ml: Density [g/ml].

        Raises:
            ValueError: The density is not positive.
        """
        _check_positive("density_g_per_ml", density_g_per_ml)
        scale, centre, about = KG_PER_MM3 * density_g_per_ml, solid.center, solid.inertia
        inertia = np.array([[about[row, column] for column in range(3)] for row in range(3)])
        return cls(scale * solid.mass, np.array([centre.x, centre.y, centre.z]), scale * inertia)

    @classmethod
    def _of_skin(cls, corners: np.ndarray, density_g_per_ml: float) -> MassProperties:
        """Of what triangles with these corners enclose, (triangle, 3, 3), as `of_surface`."""
        solids = np.concatenate([np.zeros((len(corners), 1, 3)), corners], axis=1)
        return cls._of_corners(solids, density_g_per_ml)

    @classmethod
    def _of_corners(cls, corners: np.ndarray, density_g_per_ml: float) -> MassProperties:
        edges = corners[:, 1:] - corners[:, :1]
        mass = KG_PER_MM3 * density_g_per_ml * np.linalg.det(edges) / 6.0
        total = corners.sum(axis=1)
        second = np.einsum("e,eci,ecj->ij", mass, corners, corners)
        second += np.einsum("e,ei,ej->ij", mass, total, total)
        return cls.of_moments(float(mass.sum()), mass @ total / 4.0, second / 20.0)


def _inwards(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """How far each node moves where the triangles about it move in by 1 at right angles to
    themselves, (node, 3): by least squares over the angles that they have there."""
    corners = nodes[triangles]
    normals = _unit_normals(corners)
    planes, wanted = np.zeros((len(nodes), 3, 3)), np.zeros((len(nodes), 3))
    for k in range(3):
        ahead, back = corners[:, (k + 1) % 3] - corners[:, k], corners[:, k - 1] - corners[:, k]
        across = np.linalg.norm(np.cross(ahead, back), axis=1)
        angle = np.arctan2(across, np.einsum("ti,ti->t", ahead, back))
        weighed = angle[:, None] * normals
        np.add.at(planes, triangles[:, k], np.einsum("ti,tj->tij", weighed, normals))
        np.add.at(wanted, triangles[:, k], -weighed)
    solved = np.linalg.pinv(planes, rcond=_ONE_PLANE, hermitian=True)
    return np.einsum("nij,nj->ni", solved, wanted)


def _unit_normals(corners: np.ndarray) -> np.ndarray:
    """Of triangles with these corners, (triangle, 3, 3), each of length 1, (triangle, 3)."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _solid_from_mm(nodes: np.ndarray, inwards: np.ndarray, triangles: np.ndarray) -> float:
    """Thickness of walls from which on there is no hollow between them [mm]: the volume within,
    a cubic in it, is nothing or grows again, as of a box that has turned inside out."""
    volume_mm3 = enclosed_volume(nodes, triangles)
    unit_mm = volume_mm3 / surface_area(nodes, triangles)
    at = np.arange(4.0)
    shares = [
        enclosed_volume(nodes + unit_mm * each * inwards, triangles) / volume_mm3 for each in at
    ]
    cubic = np.polynomial.Polynomial.fit(at, shares, 3).convert()
    roots = np.concatenate([cubic.roots(), cubic.deriv().roots()])
    real = roots.real[np.abs(roots.imag) < 1e-4 * np.abs(roots)]
    return unit_mm * float(min(real[real > 0.0], default=math.inf))


def _first_meeting(
    outer: np.ndarray, inner: np.ndarray, triangles: np.ndarray, wall_mm: float
) -> int | None:
    """Number of the first node that, moved in by a wall, is within the wall of the other side: of
    a face that looks the way in which it moved. None where there is none."""
    corners = outer[triangles]
    normals = _unit_normals(corners)
    moved = inner - outer
    moved /= np.linalg.norm(moved, axis=1, keepdims=True)
    middle = corners.mean(axis=1)
    reach = float(np.linalg.norm(corners - middle[:, None], axis=2).max())
    near = cKDTree(middle).query_ball_point(inner, wall_mm + reach)
    for node, some in enumerate(near):
        facing = [each for each in some if normals[each] @ moved[node] > _FACING]
        if facing and distance_to(inner[node], corners[facing]) < _WITHIN * wall_mm:
            return node
    return None


def _check_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} must be positive and finite, got {value}")
