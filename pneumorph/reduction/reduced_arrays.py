"""The arrays of a reduced part, and what they must have in common."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, get_args, get_type_hints

import numpy as np
from jaxtyping import Float, Int, Shaped

from pneumorph.fem.material import Material
from pneumorph.fem.prony import PronySeries
from pneumorph.reduction.index_check import check_indices
from pneumorph.reduction.mixed_sheet import LAW as SHEET_LAW

ROUNDING = 1e-9
"""What rounding may leave of a spread of mass that is zero, relative to the largest."""
OPTIONAL = ("contact_surface", "contact_area_mm2", "contact_flexibility", "snapshot_range")
"""What files of earlier versions lack: their points lie on one surface without a name and give way
as their modes do, and how far their snapshots went is not known."""
STRETCHES = ("stretch_1", "stretch_2")
"""What parts lack whose sheets are sampled, or that have none."""
WALLS = (
    "wall_axis",
    "wall_axis_modes",
    "wall_pair_gap",
    "wall_pair",
    "wall_pair_modes",
    "wall_pair_stiffness",
)
"""What parts lack whose walls do not face each other, or are free to pass through each other."""


@dataclass(frozen=True)
class ReducedArrays:
    """Modes, sampled elements, cavity volumes and mass integrals of one part [mm, kg, s, kPa].

    Axes: node, mode, element (sampled integration points of tetrahedra), triangle (those of the
    membrane), cavity, point (collision points). A linear element has one integration point, a
    quadratic one several, which follow each other.
    """

    rest_nodes: Float[np.ndarray, "node 3"]
    """Rest positions Y [mm], (node, 3)."""
    modes: Float[np.ndarray, "node 3 mode"]
    """Mode shapes Phi, mass-orthonormal [kg^-1/2], (node, 3, mode)."""
    skin: Int[np.ndarray, "_ 3"]
    """Outer triangles, for drawing, (skin triangle, 3)."""

    tetrahedron_index: Int[np.ndarray, " element"]
    """Number of each sampled point among those of all tetrahedra of the mesh, (element,)."""
    tetrahedron_weight: Float[np.ndarray, " element"]
    """Cubature weight, non-negative, (element,)."""
    tetrahedron_rest: Float[np.ndarray, "element 3 3"]
    """Rest deformation gradient in the material frame, (element, 3, 3)."""
    tetrahedron_mode_gradient: Float[np.ndarray, "element 3 3 mode"]
    """dF'/dalpha, (element, 3, 3, mode)."""
    tetrahedron_measure: Float[np.ndarray, " element"]
    """weight * volume that the point stands for [mm^3], (element,)."""
    tetrahedron_material: Material
    """What the solid is made of, and its law."""

    membrane_index: Int[np.ndarray, " triangle"]
    """Number of each sampled point among those of the whole membrane, (triangle,)."""
    membrane_weight: Float[np.ndarray, " triangle"]
    """Cubature weight, non-negative, (triangle,)."""
    membrane_rest: Float[np.ndarray, "triangle 3 2"]
    """Rest deformation gradient in the material frame, (triangle, 3, 2)."""
    membrane_mode_gradient: Float[np.ndarray, "triangle 3 2 mode"]
    """dF'/dalpha, (triangle, 3, 2, mode)."""
    membrane_measure: Float[np.ndarray, " triangle"]
    """weight * area * thickness [mm^3], (triangle,)."""
    membrane_material: Material
    """What the membrane is made of, and its law; of no meaning where there is none. One that is
    seen by fields of stress has no sampled point."""

    dilatation_1: Float[np.ndarray, "pressure mode"]
    """c1 of the changes of volume of a solid with mean dilatation, c = c1.a + 1/2 c2 a a + 1/6 c3 a
    a a [mm^1.5], see `mixed_dilatation.py`; none of other solids, (pressure, mode)."""
    dilatation_2: Float[np.ndarray, "pressure mode mode"]
    """(pressure, mode, mode)"""
    dilatation_3: Float[np.ndarray, "pressure mode mode mode"]
    """(pressure, mode, mode, mode)"""
    relaxation_weight: Float[np.ndarray, " branch"]
    """Of the solid's Prony series, none where it does not relax, (branch,)."""
    relaxation_time: Float[np.ndarray, " branch"]
    """Its times [s], (branch,)."""

    linear_stiffness: Float[np.ndarray, "mode mode"]
    """Additional linear stiffness of the mount, zero for a rigid hub, (mode, mode)."""

    cavity_volume: Float[np.ndarray, " cavity"]
    """Rest volume V0 [mm^3], (cavity,)."""
    cavity_volume_1: Float[np.ndarray, "cavity mode"]
    """(cavity, mode)"""
    cavity_volume_2: Float[np.ndarray, "cavity mode mode"]
    """(cavity, mode, mode)"""
    cavity_volume_3: Float[np.ndarray, "cavity mode mode mode"]
    """(cavity, mode, mode, mode); V = V0 + V1.a + 1/2 a V2 a + 1/6 V3 a a a."""

    mass: float
    """sum m [kg]"""
    first_moment: Float[np.ndarray, " 3"]
    """sum m Y [kg mm], (3,)"""
    first_moment_modes: Float[np.ndarray, "3 mode"]
    """sum m Phi, (3, mode)"""
    second_moment: Float[np.ndarray, "3 3"]
    """sum m Y Y^T [kg mm^2], (3, 3)"""
    second_moment_modes: Float[np.ndarray, "3 3 mode"]
    """sum m Y_i Phi_j, (3, 3, mode)"""
    second_moment_mode_pairs: Float[np.ndarray, "3 3 mode mode"]
    """sum m Phi_i^a Phi_j^b, (3, 3, mode, mode)"""

    contact_points: Float[np.ndarray, "point 3"]
    """Rest positions of the collision points [mm], (point, 3)."""
    contact_modes: Float[np.ndarray, "point 3 mode"]
    """Mode shapes at the collision points, (point, 3, mode)."""

    contact_surface: Shaped[np.ndarray, " point"] | Shaped[np.ndarray, " 0"] = field(
        default_factory=lambda: np.zeros(0, dtype=str)
    )
    """Name of the surface that each collision point lies on, (point,); of no entries where none are
    named, as in files of earlier versions."""
    contact_area_mm2: Float[np.ndarray, " point"] | Float[np.ndarray, " 0"] = field(
        default_factory=lambda: np.zeros(0)
    )
    """Area that each stands for [mm^2], (point,); likewise."""
    contact_flexibility: Float[np.ndarray, "point point"] | Float[np.ndarray, "0 0"] = field(
        default_factory=lambda: np.zeros((0, 0))
    )
    """How far each point gives way beyond the modes under a force at another, alike in all
    directions [mm/mN], see `contact_flexibility.py`, (point, point); of no entries for not at
    all."""
    stretch_1: Float[np.ndarray, "stretch mode"] = field(default_factory=lambda: np.zeros((0, 0)))
    """c1 of the stretches of a membrane that is seen by fields of stress, c = c1.a + 1/2 c2 a a
    [mm^1.5], see `mixed_sheet.py`; none where its points are sampled, (stretch, mode)."""
    stretch_2: Float[np.ndarray, "stretch mode mode"] = field(
        default_factory=lambda: np.zeros((0, 0, 0))
    )
    """(stretch, mode, mode); likewise."""
    wall_axis: Float[np.ndarray, "gap 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    """From the middle of one side of a gap between walls to that of the other at rest [mm], see
    `facing_walls.py`, (gap, 3)."""
    wall_axis_modes: Float[np.ndarray, "gap 3 mode"] = field(
        default_factory=lambda: np.zeros((0, 3, 0))
    )
    """Its change with the modes, (gap, 3, mode)."""
    wall_pair_gap: Int[np.ndarray, " pair"] = field(default_factory=lambda: np.zeros(0, int))
    """Gap of each pair of facing points, (pair,), rising."""
    wall_pair: Float[np.ndarray, "pair 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    """From the one to the other at rest [mm], (pair, 3)."""
    wall_pair_modes: Float[np.ndarray, "pair 3 mode"] = field(
        default_factory=lambda: np.zeros((0, 3, 0))
    )
    """Its change with the modes, (pair, 3, mode)."""
    wall_pair_stiffness: Float[np.ndarray, " pair"] = field(default_factory=lambda: np.zeros(0))
    """What an overlap costs [mN/mm], (pair,)."""
    snapshot_range: Float[np.ndarray, "mode mode"] | Float[np.ndarray, "0 0"] = field(
        default_factory=lambda: np.zeros((0, 0))
    )
    """Principal axes over half-lengths of the ellipsoid that holds every snapshot [kg^-1/2 mm^-1],
    see `snapshot_range.py`, (mode, mode); of no entries where it is not known."""

    metadata: dict[str, Any] = field(default_factory=dict)
    """Mesh digest, settings, tolerances, measured errors; JSON-serialisable."""

    def __post_init__(self) -> None:
        mode_count = self.modes.shape[-1]
        for power, name in enumerate(STRETCHES, 1):
            if np.size(getattr(self, name)) == 0:  # one way to have none, for all who read them
                object.__setattr__(self, name, np.zeros((0, *(mode_count,) * power)))
        for name in ("wall_axis_modes", "wall_pair_modes"):
            if np.size(getattr(self, name)) == 0:
                object.__setattr__(self, name, np.zeros((0, 3, mode_count)))
        for name, shape in self.expected_shapes().items():
            got = np.shape(getattr(self, name))
            if got != shape and not (name in OPTIONAL and 0 in got):
                raise ValueError(
                    f"{name} must have shape {shape} for a part of {mode_count} modes, got {got}; "
                    "arrays of two different reductions may have been mixed"
                )
        for name in ("tetrahedron_weight", "membrane_weight"):
            if np.any(getattr(self, name) < 0.0):
                raise ValueError(f"{name} must not be negative: the part would be unstable")
        for item in fields(self):
            value = getattr(self, item.name)
            numbers = isinstance(value, np.ndarray) and value.dtype.kind != "U"
            if numbers and not np.isfinite(value).all():
                raise ValueError(f"{item.name} must be finite, got NaN or infinity")
        check_indices(vars(self), self.metadata)
        if not 0.0 < self.mass < math.inf:
            raise ValueError(f"mass must be positive and finite, got {self.mass}")
        if len(self.dilatation_1) > 0 and self.tetrahedron_material.dilatation != "mean":
            raise ValueError(
                f"dilatation_1 has {len(self.dilatation_1)} changes of volume, expected none where "
                "the material's dilatation is pointwise: its points have them already"
            )
        if len(self.stretch_1) > 0:
            self._check_sheet()
        _ = self.relaxation  # refuses a series that is none
        centre = self.first_moment / self.mass
        spread = np.linalg.eigvalsh(self.second_moment / self.mass - np.outer(centre, centre))
        if spread[0] < -ROUNDING * abs(spread[-1]):
            raise ValueError(
                f"second_moment and first_moment spread the mass by {spread[0]:g} mm^2 along one "
                "axis, expected no less than zero: some of the mass would be negative"
            )

    def _check_sheet(self) -> None:
        """Refuse a membrane seen by fields of stress that has points as well, or laws of whose
        parts that cannot be.

        Raises:
            ValueError: It has, or they are.
        """
        if len(self.membrane_measure) > 0:
            raise ValueError(
                f"the membrane has {len(self.membrane_measure)} sampled points beside "
                f"{len(self.stretch_1)} stretches, expected none: it would count twice"
            )
        if self.membrane_material.law != SHEET_LAW:
            raise ValueError(
                f"the membrane's law is {self.membrane_material.law!r}, expected {SHEET_LAW!r} of "
                "one that is seen by fields of stress"
            )
        if self.tetrahedron_material.law == "corotational":
            raise ValueError(
                "the solid's law is 'corotational', expected one of large strain, such as 'yeoh', "
                "beside a membrane that is seen by fields of stress; sample its triangles instead"
            )

    @cached_property
    def relaxation(self) -> PronySeries | None:
        """How the solid relaxes; None if it does not."""
        if len(self.relaxation_weight) == 0:
            return None
        weights, times = self.relaxation_weight.tolist(), self.relaxation_time.tolist()
        return PronySeries(tuple(weights), tuple(times))

    def expected_shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape that each array must have, by the axes that its annotation names.

        How many modes there are `modes` says, and the length of any other axis the first array that
        has it.
        """
        lengths = {"mode": self.modes.shape[-1]}
        expected = {}
        for name, axes in AXES.items():
            got = np.shape(getattr(self, name))
            if len(got) == len(axes):
                for axis, length in zip(axes, got, strict=True):
                    lengths.setdefault(axis, length)
            expected[name] = tuple(
                int(axis) if axis.isdigit() else lengths.get(axis, 0) for axis in axes
            )
        return expected

    def digest(self) -> str:
        """Hash of everything that decides how the part moves, in hexadecimal.

        What its points lie on is none of it, since friction is the physics': where that names
        surfaces or depends on areas, what is kept of a robot says them besides. Nor is its range.
        """
        content, decisive = hashlib.sha256(), (*STRETCHES, "contact_flexibility")
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(value, Material):
                content.update(repr(value).encode())
            elif each.name in decisive and len(value) == 0:
                continue  # as before there were any
            elif each.name in decisive or each.name not in ("metadata", *OPTIONAL):
                content.update(np.ascontiguousarray(value).tobytes())
        return content.hexdigest()


AXES = {
    name: tuple(choice.dim_str.split())
    for name, hint in get_type_hints(ReducedArrays).items()
    for choice in get_args(hint)[:1] or (hint,)
    if hasattr(choice, "dim_str")
}
"""Name, or else length, of each axis of an array; of two kinds of it that may stand there, of the
first."""
