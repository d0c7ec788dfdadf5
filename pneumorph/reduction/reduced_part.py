"""A reduced part: everything a stepper needs to know of a soft part, and its provenance.

Points are x = Y + Phi alpha in the part's own frame, which moves with the hub the part is mounted
on; the attachment nodes have Phi = 0. The methods here are the reference that the compiled engine
is tested against.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.settings import settings_from_dict
from pneumorph.fem.material import LegMaterials
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.silicones import silicone_of
from pneumorph.geometry.contact_surfaces import ContactSurfaces
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.cavity_polynomial import CavityPolynomial
from pneumorph.reduction.facing_walls import FacingWalls
from pneumorph.reduction.index_check import POINT_COUNTS
from pneumorph.reduction.mixed_dilatation import MixedDilatation
from pneumorph.reduction.mixed_sheet import MixedSheet
from pneumorph.reduction.part_file import read_part, write_part
from pneumorph.reduction.part_summary import PartSummary
from pneumorph.reduction.reduced_arrays import ReducedArrays
from pneumorph.reduction.sampled_branches import SampledBranches
from pneumorph.reduction.sampled_elements import SampledElements
from pneumorph.reduction.snapshot_range import range_ratio

SAME_MASS = 1e-3
"""Masses of a reduction and its finite elements that differ by less, relatively, are one that was
rounded."""
SAME_THICKNESS = 1e-6
"""Thicknesses that differ by less, relatively, are one that was rounded."""
CAVITY_CENTRES = "cavity_centres_mm"
"""Name in a part's metadata of where its cavities are."""


class HasDigest(Protocol):
    """A mesh that knows its content hash."""

    def digest(self) -> str: ...


@dataclass(frozen=True)
class ReducedPart(ReducedArrays):
    """Forces, stiffnesses and volumes of one part, of its `ReducedArrays` [mm, kg, s, kPa]."""

    def __repr__(self) -> str:
        sampled = len(self.tetrahedron_index) + len(self.membrane_index)
        return (
            f"ReducedPart({len(self.rest_nodes)} nodes, {self.mode_count} modes, {sampled} sampled "
            f"points, {self.cavity_count} cavities, {1e3 * self.mass:.4g} g)"
        )

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
    def walls(self) -> FacingWalls:
        """Walls that may not pass through each other; none where it is not known which."""
        return FacingWalls(
            self.wall_axis,
            self.wall_axis_modes,
            self.wall_pair_gap,
            self.wall_pair,
            self.wall_pair_modes,
            self.wall_pair_stiffness,
        )

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
    def cavity_centres_mm(self) -> np.ndarray | None:
        """Middle of each cavity at rest in the part's frame [mm], (cavity, 3); None of a part that
        does not say, as older files."""
        found = self.metadata.get(CAVITY_CENTRES)
        size = self.metadata.get("size_factor", 1.0)
        return size * np.reshape(found, (-1, 3)) if found else None

    @property
    def seen_pressure_kPa(self) -> float:
        """Highest simulated pressure of the free bends that it was reduced from [kPa]; zero of a
        part that does not say."""
        bend = self.metadata.get("report", {}).get("bend") or {}
        return float(max(bend.get("pressure_kPa") or [0.0]))

    @property
    def chamber_growth(self) -> tuple[float, ...] | None:
        """Growth g1, g2 ... of its chambers with the pressure in all of them, as it was reduced:
        relative to rest their volume is 1 + g1 p + g2 p^2 ...; None of a part that was not asked,
        as older files."""
        found = self.metadata.get("report", {}).get("chamber_growth")
        return tuple(found) if found else None

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
        """Node positions [mm] in the part's frame, (..., node, 3), at modal coordinates
        (..., mode), in one product: reading the modes takes longer than multiplying."""
        moved = alpha @ self.modes.reshape(-1, self.mode_count).T
        return self.rest_nodes + moved.reshape(*np.shape(alpha)[:-1], *self.rest_nodes.shape)

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
            + self.walls.force(alpha)
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
            + self.walls.stiffness(alpha)
            + self.linear_stiffness
        )

    def objective_stiffness(self, alpha: np.ndarray) -> np.ndarray:
        """Stiffness that objective damping acts on (mode, mode), at alpha (mode,)."""
        return (
            self.tetrahedra.objective_stiffness(alpha)
            + self.membrane.objective_stiffness(alpha)
            + self.dilatation.stiffness(alpha)
            + self.sheet.stiffness(alpha)
            + self.walls.stiffness(alpha)
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
            mass_kg=self.mass,
            silicone=silicone_of(self.tetrahedron_material),
            digest=self.digest(),
        )

    @property
    def is_polar(self) -> bool:
        """Whether it was made with polar rotations, which `objective` damping has."""
        return bool(self.metadata.get("settings", {}).get("rotation") == "polar")

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
            ArtefactError: The mesh, a material, the relaxation, the mass or the number of sheets
                differs; of a part that knows what it was made of, their thickness or how the mass
                is shared among nodes.
            ValueError: The model has other cavities than its mesh names so.
        """
        self.check_mesh(model.mesh)
        model.check_cavities()
        self._check_sheets(model)
        sheets = [membrane.material for membrane in model.membranes]
        for kind, material, other in zip(
            ("tetrahedron", "membrane"),
            (self.tetrahedron_material, self.membrane_material),
            (model.material, *sheets),
            strict=False,  # without a sheet its material has no meaning
        ):
            if material != other:
                raise ArtefactError(
                    f"this reduction's {kind} elements are of {material}, got {other}; reduce the "
                    "part again"
                )
        if not math.isclose(self.mass, model.mass_kg, rel_tol=SAME_MASS):
            raise ArtefactError(
                f"this reduction weighs {1e3 * self.mass:.4g} g, got finite elements of "
                f"{1e3 * model.mass_kg:.4g} g, expected one mass; say what the leg weighs "
                "(masses.leg_mass_g, or mass_g of a module), or reduce the part again"
            )
        series = None if model.branches is None else model.branches.series
        if self.relaxation != series:
            raise ArtefactError(
                f"this reduction's solid relaxes by {self.relaxation}, got {series}; reduce the "
                "part again"
            )

    @property
    def sheet_thickness_mm(self) -> float | None:
        """Thickness of its sheet [mm]; None without one, or where it does not say what it is made
        of."""
        made_of = self._made_of
        if made_of is None or not self._has_sheet:
            return None
        size: float = self.metadata.get("size_factor", 1.0)
        return made_of.sheet_thickness_mm * size

    @property
    def _made_of(self) -> LegMaterials | None:
        recorded = self.metadata.get("materials")
        return None if recorded is None else settings_from_dict(LegMaterials, recorded)

    @property
    def _has_sheet(self) -> bool:
        seen = len(self.membrane_rest) + len(self.stretch_1)
        return bool(self.metadata.get(POINT_COUNTS, {}).get("membrane", seen) > 0)

    def _check_sheets(self, model: PartModel) -> None:
        """Refuse other sheets, and masses that are shared otherwise.

        Raises:
            ArtefactError: They are.
        """
        own = int(self._has_sheet)
        if len(model.membranes) != own:
            raise ArtefactError(
                f"this reduction has {'one sheet' if own else 'no sheet'}, got finite elements of "
                f"{len(model.membranes)}; reduce the part again"
            )
        made_of, thickness_mm = self._made_of, self.sheet_thickness_mm
        if made_of is None:
            return
        for sheet in model.membranes:
            if thickness_mm is not None and not math.isclose(
                sheet.thickness_mm, thickness_mm, rel_tol=SAME_THICKNESS
            ):
                raise ArtefactError(
                    f"this reduction's sheet is {thickness_mm:g} mm thick, got finite elements "
                    f"with one of {sheet.thickness_mm:g} mm; say how thick it is "
                    "(materials.sheet_thickness_mm), or reduce the part again"
                )
        if isinstance(model.mass_lumping, str) and model.mass_lumping != made_of.mass_lumping:
            raise ArtefactError(
                f"this reduction's mass is shared by {made_of.mass_lumping!r} lumping "
                f"(materials.mass_lumping), got finite elements with {model.mass_lumping!r}; "
                "reduce the part again"
            )

    def save(self, path: Path | str) -> Path:
        """Write the part; mode shapes are stored in single precision."""
        return write_part(path, self)

    @classmethod
    def load(cls, path: Path | str) -> ReducedPart:
        """Read a part.

        Raises:
            ArtefactError: The file is truncated, of another kind or another format version, or its
                law is not known.
        """
        return read_part(path, cls)
