"""A reduced part: everything a stepper needs to know of a soft part, and its provenance.

Points are x = Y + Phi alpha in the part's own frame, which moves with the hub the part is mounted
on; the attachment nodes have Phi = 0. The file is an npz that numpy alone can read; the methods
here are the reference the compiled engine is tested against.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from pneumorph.artefact import ArtefactError, load_artefact, save_artefact
from pneumorph.fem.rotation import Rotation
from pneumorph.reduction.cavity_polynomial import CavityPolynomial
from pneumorph.reduction.sampled_elements import SampledElements

FORMAT_VERSION = 1


class HasDigest(Protocol):
    """A mesh that knows its content hash."""

    def digest(self) -> str: ...


@dataclass(frozen=True)
class ReducedPart:
    """Modes, sampled elements, cavity volumes and mass integrals of one part [mm, kg, s, kPa].

    Axes: node, mode, element (sampled tetrahedra), triangle (sampled membrane triangles), cavity,
    point (collision points).
    """

    rest_nodes: np.ndarray
    """Rest positions Y [mm], (node, 3)."""
    modes: np.ndarray
    """Mode shapes Phi, mass-orthonormal [kg^-1/2], (node, 3, mode)."""
    skin: np.ndarray
    """Outer triangles, for drawing, (skin triangle, 3)."""

    tetrahedron_index: np.ndarray
    """Number of each sampled tetrahedron in the mesh, (element,)."""
    tetrahedron_weight: np.ndarray
    """Cubature weight, non-negative, (element,)."""
    tetrahedron_rest: np.ndarray
    """Rest deformation gradient in the material frame, (element, 3, 3)."""
    tetrahedron_mode_gradient: np.ndarray
    """dF'/dalpha, (element, 3, 3, mode)."""
    tetrahedron_lambda: np.ndarray
    """weight * volume * lambda [kPa mm^3], (element,)."""
    tetrahedron_mu: np.ndarray
    """weight * volume * mu [kPa mm^3], (element,)."""

    membrane_index: np.ndarray
    """Number of each sampled triangle in the membrane, (triangle,)."""
    membrane_weight: np.ndarray
    """Cubature weight, non-negative, (triangle,)."""
    membrane_rest: np.ndarray
    """Rest deformation gradient in the material frame, (triangle, 3, 2)."""
    membrane_mode_gradient: np.ndarray
    """dF'/dalpha, (triangle, 3, 2, mode)."""
    membrane_lambda: np.ndarray
    """weight * area * thickness * plane-stress lambda [kPa mm^3], (triangle,)."""
    membrane_mu: np.ndarray
    """weight * area * thickness * mu [kPa mm^3], (triangle,)."""

    linear_stiffness: np.ndarray
    """Additional linear stiffness of the mount, zero for a rigid hub, (mode, mode)."""

    cavity_volume: np.ndarray
    """Rest volume V0 [mm^3], (cavity,)."""
    cavity_volume_1: np.ndarray
    """(cavity, mode)"""
    cavity_volume_2: np.ndarray
    """(cavity, mode, mode)"""
    cavity_volume_3: np.ndarray
    """(cavity, mode, mode, mode); V = V0 + V1.a + 1/2 a V2 a + 1/6 V3 a a a."""

    mass: float
    """sum m [kg]"""
    first_moment: np.ndarray
    """sum m Y [kg mm], (3,)"""
    first_moment_modes: np.ndarray
    """sum m Phi, (3, mode)"""
    second_moment: np.ndarray
    """sum m Y Y^T [kg mm^2], (3, 3)"""
    second_moment_modes: np.ndarray
    """sum m Y_i Phi_j, (3, 3, mode)"""
    second_moment_mode_pairs: np.ndarray
    """sum m Phi_i^a Phi_j^b, (3, 3, mode, mode)"""

    contact_points: np.ndarray
    """Rest positions of the collision points [mm], (point, 3)."""
    contact_modes: np.ndarray
    """Mode shapes at the collision points, (point, 3, mode)."""

    metadata: dict[str, Any] = field(default_factory=dict)
    """Mesh digest, settings, tolerances, measured errors; JSON-serialisable."""

    def __post_init__(self) -> None:
        mode_count = self.modes.shape[-1]
        for name, shape in self._expected_shapes(mode_count).items():
            got = np.shape(getattr(self, name))
            if got != shape:
                raise ValueError(
                    f"{name} must have shape {shape} for a part of {mode_count} modes, got {got}; "
                    "arrays of two different reductions may have been mixed"
                )
        for name in ("tetrahedron_weight", "membrane_weight"):
            if np.any(getattr(self, name) < 0.0):
                raise ValueError(f"{name} must not be negative: the part would be unstable")

    def _expected_shapes(self, mode: int) -> dict[str, tuple[int, ...]]:
        node, point = len(self.rest_nodes), len(self.contact_points)
        cavity = len(self.cavity_volume)
        element, triangle = len(self.tetrahedron_rest), len(self.membrane_rest)
        return {
            "modes": (node, 3, mode),
            "rest_nodes": (node, 3),
            "tetrahedron_index": (element,),
            "tetrahedron_weight": (element,),
            "tetrahedron_rest": (element, 3, 3),
            "tetrahedron_mode_gradient": (element, 3, 3, mode),
            "tetrahedron_lambda": (element,),
            "tetrahedron_mu": (element,),
            "membrane_index": (triangle,),
            "membrane_weight": (triangle,),
            "membrane_rest": (triangle, 3, 2),
            "membrane_mode_gradient": (triangle, 3, 2, mode),
            "membrane_lambda": (triangle,),
            "membrane_mu": (triangle,),
            "linear_stiffness": (mode, mode),
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
        }

    def digest(self) -> str:
        """Hash of everything a simulation reads of the part, in hexadecimal."""
        content = hashlib.sha256()
        for each in fields(self):
            if each.name != "metadata":
                content.update(np.ascontiguousarray(getattr(self, each.name)).tobytes())
        return content.hexdigest()

    @property
    def mode_count(self) -> int:
        return int(self.modes.shape[2])

    @property
    def cavity_count(self) -> int:
        return len(self.cavity_volume)

    @cached_property
    def tetrahedra(self) -> SampledElements:
        """The sampled tetrahedra."""
        return SampledElements(
            self.tetrahedron_rest,
            self.tetrahedron_mode_gradient,
            self.tetrahedron_lambda,
            self.tetrahedron_mu,
        )

    @cached_property
    def membrane(self) -> SampledElements:
        """The sampled membrane triangles."""
        return SampledElements(
            self.membrane_rest,
            self.membrane_mode_gradient,
            self.membrane_lambda,
            self.membrane_mu,
        )

    def cavity(self, index: int = 0) -> CavityPolynomial:
        """Volume polynomial of one cavity."""
        return CavityPolynomial(
            float(self.cavity_volume[index]),
            self.cavity_volume_1[index],
            self.cavity_volume_2[index],
            self.cavity_volume_3[index],
        )

    def positions(self, alpha: np.ndarray) -> np.ndarray:
        """Node positions [mm] in the part's frame, (node, 3), at modal coordinates (mode,)."""
        return self.rest_nodes + self.modes @ alpha

    def internal_force(self, alpha: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Generalised elastic force at modal coordinates (..., mode), same shape.

        Args:
            alpha: Modal coordinates; leading axes are evaluated together.
            rotation: Where the elements take their rotation from.
        """
        return (
            self.tetrahedra.force(alpha, rotation)
            + self.membrane.force(alpha, rotation)
            - alpha @ self.linear_stiffness.T
        )

    def stiffness(self, alpha: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Rotated linear stiffness (mode, mode) at alpha (mode,), without geometric terms."""
        return (
            self.tetrahedra.stiffness(alpha, rotation)
            + self.membrane.stiffness(alpha, rotation)
            + self.linear_stiffness
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

    def save(self, path: Path | str) -> Path:
        """Write the part; mode shapes are stored in single precision."""
        arrays = {
            item.name: np.asarray(getattr(self, item.name))
            for item in fields(self)
            if item.name != "metadata"
        }
        arrays["modes"] = arrays["modes"].astype(np.float32)
        return save_artefact(path, "ReducedPart", FORMAT_VERSION, arrays, self.metadata)

    @classmethod
    def load(cls, path: Path | str) -> ReducedPart:
        """Read a part.

        Raises:
            ArtefactError: The file is truncated, of another kind or another format version.
        """
        arrays, metadata = load_artefact(path, "ReducedPart", FORMAT_VERSION)
        names = {item.name for item in fields(cls)} - {"metadata"}
        if names != set(arrays):
            raise ArtefactError(
                f"{path} lacks {sorted(names - set(arrays))} and has unknown "
                f"{sorted(set(arrays) - names)}; it was written by a different pneumorph"
            )
        content: dict[str, Any] = {
            name: value.astype(np.float64) if value.dtype == np.float32 else value
            for name, value in arrays.items()
        }
        content["mass"] = float(content["mass"])
        return cls(**content, metadata=metadata)
