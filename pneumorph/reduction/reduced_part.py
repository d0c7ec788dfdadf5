"""A reduced part: everything a stepper needs to know of a soft part, and its provenance.

Points are x = Y + Phi alpha in the part's own frame, which moves with the hub the part is mounted
on; the attachment nodes have Phi = 0. The file is an npz that numpy alone can read
(docs/file_formats.md); the methods here are the reference the compiled engine is tested against.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float, Int, Shaped

from pneumorph.base.artefact import ArtefactError, load_artefact, reading, save_artefact
from pneumorph.fem.law_registry import law_names
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.prony import PronySeries
from pneumorph.geometry.contact_surfaces import ContactSurfaces
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.cavity_polynomial import CavityPolynomial
from pneumorph.reduction.mixed_dilatation import MixedDilatation
from pneumorph.reduction.mixed_sheet import LAW as SHEET_LAW
from pneumorph.reduction.mixed_sheet import MixedSheet
from pneumorph.reduction.sampled_branches import SampledBranches
from pneumorph.reduction.sampled_elements import SampledElements
from pneumorph.reduction.snapshot_range import range_ratio

FORMAT_VERSION = 3
_UNCHANGING_VERSION = 2
"""Of files that know neither Yeoh's law, nor volumes of whole elements, nor relaxation."""
ROUNDING = 1e-9
"""What rounding may leave of a spread of mass that is zero, relative to the largest."""
_OPTIONAL = ("contact_surface", "contact_area_mm2", "snapshot_range")
"""What files of earlier versions lack: their points lie on one surface without a name, and how far
their snapshots went is not known."""
_STRETCHES = ("stretch_1", "stretch_2")
"""What parts lack whose sheets are sampled, or that have none."""
_MATERIAL_ENTRIES = tuple(item.name for item in fields(Material))


@dataclass(frozen=True)
class PartSummary:
    """Size, provenance and measured errors of a reduced part."""

    part: str
    """What it is called: its file, or a name."""
    mode_count: int
    tetrahedron_count: int
    """Sampled integration points of the solid."""
    membrane_count: int
    """The same of the membrane."""
    mesh_digest: str
    errors: dict[str, float | None]
    """By the names that the report of the reduction gives them; None where it measured none."""
    bend: dict[str, list[float]] | None
    """Pressures [kPa] with the bend of both models [degrees]; None where it was not measured."""
    knows_range: bool = False
    """Whether it can tell when it leaves the range of its snapshots; older files cannot."""
    stress_count: int = 0
    """Fields of stress that the membrane is seen by instead of sampled points; older files have
    none."""


@dataclass(frozen=True)
class PartsSummary(PartSummary):
    """Of the parts that a robot has: the first, and the other kinds beside it."""

    others: dict[str, PartSummary] = field(default_factory=dict)
    """By what they are called."""


class HasDigest(Protocol):
    """A mesh that knows its content hash."""

    def digest(self) -> str: ...


@dataclass(frozen=True)
class ReducedPart:
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
    stretch_1: Float[np.ndarray, "stretch mode"] = field(default_factory=lambda: np.zeros((0, 0)))
    """c1 of the stretches of a membrane that is seen by fields of stress, c = c1.a + 1/2 c2 a a
    [mm^1.5], see `mixed_sheet.py`; none where its points are sampled, (stretch, mode)."""
    stretch_2: Float[np.ndarray, "stretch mode mode"] = field(
        default_factory=lambda: np.zeros((0, 0, 0))
    )
    """(stretch, mode, mode); likewise."""
    snapshot_range: Float[np.ndarray, "mode mode"] | Float[np.ndarray, "0 0"] = field(
        default_factory=lambda: np.zeros((0, 0))
    )
    """Principal axes over half-lengths of the ellipsoid that holds every snapshot [kg^-1/2 mm^-1],
    see `snapshot_range.py`, (mode, mode); of no entries where it is not known."""

    metadata: dict[str, Any] = field(default_factory=dict)
    """Mesh digest, settings, tolerances, measured errors; JSON-serialisable."""

    def __post_init__(self) -> None:
        mode_count = self.modes.shape[-1]
        for power, name in enumerate(_STRETCHES, 1):
            if np.size(getattr(self, name)) == 0:  # one way to have none, for all who read them
                object.__setattr__(self, name, np.zeros((0, *(mode_count,) * power)))
        for name, shape in self._expected_shapes(mode_count).items():
            got = np.shape(getattr(self, name))
            if got != shape and not (name in _OPTIONAL and 0 in got):
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

    def _expected_shapes(self, mode: int) -> dict[str, tuple[int, ...]]:
        node, point = len(self.rest_nodes), len(self.contact_points)
        cavity, pressure = len(self.cavity_volume), len(self.dilatation_1)
        stretch = len(self.stretch_1)
        element, triangle = len(self.tetrahedron_rest), len(self.membrane_rest)
        return {
            "modes": (node, 3, mode),
            "rest_nodes": (node, 3),
            "skin": (len(self.skin), 3),
            "tetrahedron_index": (element,),
            "tetrahedron_weight": (element,),
            "tetrahedron_rest": (element, 3, 3),
            "tetrahedron_mode_gradient": (element, 3, 3, mode),
            "tetrahedron_measure": (element,),
            "membrane_index": (triangle,),
            "membrane_weight": (triangle,),
            "membrane_rest": (triangle, 3, 2),
            "membrane_mode_gradient": (triangle, 3, 2, mode),
            "membrane_measure": (triangle,),
            "dilatation_1": (pressure, mode),
            "dilatation_2": (pressure, mode, mode),
            "dilatation_3": (pressure, mode, mode, mode),
            "stretch_1": (stretch, mode),
            "stretch_2": (stretch, mode, mode),
            "relaxation_weight": (len(self.relaxation_weight),),
            "relaxation_time": (len(self.relaxation_weight),),
            "linear_stiffness": (mode, mode),
            "cavity_volume": (cavity,),
            "cavity_volume_1": (cavity, mode),
            "cavity_volume_2": (cavity, mode, mode),
            "cavity_volume_3": (cavity, mode, mode, mode),
            "first_moment": (3,),
            "first_moment_modes": (3, mode),
            "second_moment": (3, 3),
            "second_moment_modes": (3, 3, mode),
            "second_moment_mode_pairs": (3, 3, mode, mode),
            "contact_points": (point, 3),
            "contact_modes": (point, 3, mode),
            "contact_surface": (point,),
            "contact_area_mm2": (point,),
            "snapshot_range": (mode, mode),
        }

    def digest(self) -> str:
        """Hash of everything that decides how the part moves, in hexadecimal.

        What its points lie on says nothing of that: friction is the physics'. Nor does its range.
        """
        content = hashlib.sha256()
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(value, Material):
                content.update(repr(value).encode())
            elif each.name in _STRETCHES and len(value) == 0:
                continue  # as before there were any
            elif each.name not in ("metadata", *_OPTIONAL):
                content.update(np.ascontiguousarray(value).tobytes())
        return content.hexdigest()

    @property
    def mode_count(self) -> int:
        return int(self.modes.shape[2])

    @property
    def cavity_count(self) -> int:
        return len(self.cavity_volume)

    @cached_property
    def contact_surfaces(self) -> ContactSurfaces:
        """What the collision points lie on."""
        if len(self.contact_surface) != len(self.contact_points):
            return ContactSurfaces.unnamed(len(self.contact_points))
        return ContactSurfaces(self.contact_surface, self.contact_area_mm2)

    @cached_property
    def tetrahedra(self) -> SampledElements:
        """The sampled points of the tetrahedra; of mean dilatation those of the shape alone."""
        material = self.tetrahedron_material
        if material.dilatation == "mean":
            material = material.without_lambda()
        return SampledElements(
            self.tetrahedron_rest,
            self.tetrahedron_mode_gradient,
            self.tetrahedron_measure,
            material,
        )

    @cached_property
    def dilatation(self) -> MixedDilatation:
        """What the solid's volumes cost; nothing where every point has its own."""
        return MixedDilatation(
            self.tetrahedron_material.lame_lambda,
            self.dilatation_1,
            self.dilatation_2,
            self.dilatation_3,
        )

    @cached_property
    def sheet(self) -> MixedSheet:
        """What the stretches of a membrane cost that is seen by fields of stress; nothing where
        its points are sampled, or where there is none."""
        return MixedSheet(self.membrane_material.young_modulus_kPa, self.stretch_1, self.stretch_2)

    @cached_property
    def relaxation(self) -> PronySeries | None:
        """How the solid relaxes; None if it does not."""
        if len(self.relaxation_weight) == 0:
            return None
        weights, times = self.relaxation_weight.tolist(), self.relaxation_time.tolist()
        return PronySeries(tuple(weights), tuple(times))

    @cached_property
    def branches(self) -> SampledBranches | None:
        """What of the solid's stress relaxes."""
        return (
            None if self.relaxation is None else SampledBranches(self.tetrahedra, self.relaxation)
        )

    @cached_property
    def membrane(self) -> SampledElements:
        """The sampled points of the membrane."""
        return SampledElements(
            self.membrane_rest,
            self.membrane_mode_gradient,
            self.membrane_measure,
            self.membrane_material,
        )

    def cavity(self, index: int = 0) -> CavityPolynomial:
        """Volume polynomial of one cavity."""
        return CavityPolynomial(
            float(self.cavity_volume[index]),
            self.cavity_volume_1[index],
            self.cavity_volume_2[index],
            self.cavity_volume_3[index],
        )

    @property
    def knows_range(self) -> bool:
        """Whether it knows how far its snapshots went."""
        return len(self.snapshot_range) > 0

    def range_ratio(self, alpha: np.ndarray) -> np.ndarray:
        """How far from rest, relative to the furthest snapshot; NaN of a part that cannot tell.

        Args:
            alpha: Modal coordinates, (..., mode).

        Returns:
            (...): above 1 the part extrapolates.
        """
        if not self.knows_range:
            return np.full(np.shape(alpha)[:-1], np.nan)
        return range_ratio(self.snapshot_range, alpha)

    def positions(self, alpha: np.ndarray) -> np.ndarray:
        """Node positions [mm] in the part's frame, (node, 3), at modal coordinates (mode,)."""
        return self.rest_nodes + self.modes @ alpha

    def internal_force(self, alpha: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Generalised force of the relaxed part at modal coordinates (..., mode), same shape.

        Args:
            alpha: Modal coordinates; leading axes are evaluated together.
            rotation: Where the elements take their rotation from.
        """
        return (
            self.tetrahedra.force(alpha, rotation)
            + self.membrane.force(alpha, rotation)
            + self.dilatation.force(alpha)
            + self.sheet.force(alpha)
            - alpha @ self.linear_stiffness.T
        )

    def stiffness(self, alpha: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Stiffness of the published step (mode, mode) at alpha (mode,), positive semi-definite.

        Of corotational elements the rotated linear stiffness, without geometric terms; of others
        their tangent, negative eigenvalues removed point by point.
        """
        return (
            self.tetrahedra.stiffness(alpha, rotation)
            + self.membrane.stiffness(alpha, rotation)
            + self.dilatation.stiffness(alpha)
            + self.sheet.stiffness(alpha)
            + self.linear_stiffness
        )

    def objective_stiffness(self, alpha: np.ndarray) -> np.ndarray:
        """Stiffness that objective damping acts on (mode, mode), at alpha (mode,)."""
        return (
            self.tetrahedra.objective_stiffness(alpha)
            + self.membrane.objective_stiffness(alpha)
            + self.dilatation.stiffness(alpha)
            + self.sheet.stiffness(alpha)
            + self.linear_stiffness
        )

    def describe(self, name: str) -> PartSummary:
        """Size, provenance and measured errors, for a summary that calls the part by a name."""
        report = self.metadata.get("report", {})
        return PartSummary(
            part=name,
            mode_count=self.mode_count,
            tetrahedron_count=len(self.tetrahedron_rest),
            membrane_count=len(self.membrane_rest),
            stress_count=len(self.stretch_1),
            mesh_digest=self.metadata["mesh_digest"],
            errors={key: report[key] for key in report if "error" in key},
            bend=report.get("bend"),
            knows_range=self.knows_range,
        )

    def check_mesh(self, mesh: HasDigest) -> None:
        """Refuse a mesh this reduction was not made from.

        Raises:
            ArtefactError: The mesh's content hash differs from the one recorded.
        """
        expected, got = self.metadata.get("mesh_digest"), mesh.digest()
        if expected != got:
            raise ArtefactError(
                f"this reduction was made from the mesh {str(expected)[:12]}, got the mesh "
                f"{got[:12]}; reduce that mesh, or load the one the reduction was made from"
            )

    def check_model(self, model: PartModel) -> None:
        """Refuse finite elements that this reduction does not stand for.

        Raises:
            ArtefactError: The mesh, a material or the relaxation differs.
        """
        self.check_mesh(model.mesh)
        sheets = [membrane.material for membrane in model.membranes]
        for kind, material, other in zip(
            ("tetrahedron", "membrane"),
            (self.tetrahedron_material, self.membrane_material),
            (model.material, *sheets),
            strict=False,
        ):
            if material != other:
                raise ArtefactError(
                    f"this reduction's {kind} elements are of {material}, got {other}; reduce the "
                    "part again"
                )
        series = None if model.branches is None else model.branches.series
        if self.relaxation != series:
            raise ArtefactError(
                f"this reduction's solid relaxes by {self.relaxation}, got {series}; reduce the "
                "part again"
            )

    def save(self, path: Path | str) -> Path:
        """Write the part; mode shapes are stored in single precision."""
        arrays: dict[str, np.ndarray] = {}
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, Material):
                for entry in _MATERIAL_ENTRIES:
                    arrays[_entry_name(item.name, entry)] = np.array(getattr(value, entry))
            elif item.name != "metadata" and not (
                item.name in (*_OPTIONAL, *_STRETCHES) and len(value) == 0
            ):
                arrays[item.name] = np.asarray(value)
        arrays["modes"] = arrays["modes"].astype(np.float32)
        return save_artefact(path, "ReducedPart", FORMAT_VERSION, arrays, self.metadata)

    @classmethod
    def load(cls, path: Path | str) -> ReducedPart:
        """Read a part.

        Raises:
            ArtefactError: The file is truncated, of another kind or another format version, or its
                law is not known.
        """
        versions = (FORMAT_VERSION, _UNCHANGING_VERSION)
        arrays, metadata = load_artefact(path, "ReducedPart", *versions)
        with reading(path, "ReducedPart"):
            if metadata["format_version"] == _UNCHANGING_VERSION:
                _add_what_is_new(arrays)
            return cls._from_arrays(path, arrays, metadata)

    @classmethod
    def _from_arrays(
        cls, path: Path | str, arrays: dict[str, np.ndarray], metadata: dict[str, Any]
    ) -> ReducedPart:
        materials = {item.name for item in fields(cls) if item.name.endswith("_material")}
        names = {item.name for item in fields(cls)} - {"metadata"} - materials
        names |= {_entry_name(name, entry) for name in materials for entry in _MATERIAL_ENTRIES}
        lacking = names - set(arrays) - {*_OPTIONAL, *_STRETCHES}
        if lacking or set(arrays) - names:
            raise ArtefactError(
                f"{path} lacks {sorted(lacking)} and has unknown "
                f"{sorted(set(arrays) - names)}; it was written by a different pneumorph"
            )
        content: dict[str, Any] = {}
        for name in materials:
            entry = {each: arrays.pop(_entry_name(name, each)).item() for each in _MATERIAL_ENTRIES}
            if entry["law"] not in law_names():
                raise ArtefactError(
                    f"{path} has the law {entry['law']!r}, expected {', '.join(law_names())}; a "
                    "law of your own must be registered before its parts are read"
                )
            content[name] = Material(**entry)
        for name, value in arrays.items():
            content[name] = value.astype(np.float64) if value.dtype == np.float32 else value
        content["mass"] = float(content["mass"])
        return cls(**content, metadata=metadata)


def _add_what_is_new(arrays: dict[str, np.ndarray]) -> None:
    """Give the arrays of an older file those that it does not know, as they were before."""
    mode_count = len(arrays["linear_stiffness"])
    for power in (1, 2, 3):
        arrays[f"dilatation_{power}"] = np.zeros((0, *(mode_count,) * power))
    arrays["relaxation_weight"] = arrays["relaxation_time"] = np.zeros(0)
    for material in ("tetrahedron_material", "membrane_material"):
        for entry in ("yeoh_c2_over_c1", "yeoh_c3_over_c1", "dilatation"):
            arrays[_entry_name(material, entry)] = np.array(getattr(Material, entry))


def _entry_name(material: str, entry: str) -> str:
    # tetrahedron_material's law is saved as tetrahedron_law, and so on.
    return material.removesuffix("material") + entry
