"""What can be mounted at a site of a robot, reduced and as finite elements."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.pose import Pose
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.fewer_modes import with_fewer_modes
from pneumorph.reduction.fewer_points import FewerPoints, fewer_points
from pneumorph.reduction.part_summary import PartSummary
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.scaled_part import scaled_part


def _unknown_face() -> None:
    return None


@dataclass(frozen=True, eq=False)
class Module:
    """A part, such as a leg, in both models; each is made when it is first asked for.

    Where the functions that make it can be pickled, so can robots that have it.

    Attributes:
        name: What it is called in summaries.
        make_reduced: Makes or reads the reduced part.
        make_full: Makes the finite elements, given factors on all Young's moduli and on the mass.
        modulus_factor: Young's moduli of this module over those it was made with.
        mass_factor: Mass of this module over that it was made with.
        damping_factor: Stiffness of what relaxes in it over that it was made with.
        pressure_map: Real to simulated pressure that makes it bend as the real one does, where that
            is known of it.
        find_face: Finds the frame of its attachment face in its own frame
            (`pneumorph.geometry.attachment`); None where it is not known.
        shape: Its sizes, of a PneuNet leg that is made from such; None of any other part.
        mode_limit: Most modes of the reduced part, see `with_fewer_modes`; None for all it has.
        points: Which sampled points of the part with so many modes stand for all; None for all.
    """

    name: str
    make_reduced: Callable[[], ReducedPart]
    make_full: Callable[[float, float], PartModel]
    modulus_factor: float = 1.0
    mass_factor: float = 1.0
    damping_factor: float = 1.0
    pressure_map: PressureMap | None = None
    find_face: Callable[[], Pose | None] = _unknown_face
    shape: PneuNetShape | None = None
    mode_limit: int | None = None
    points: FewerPoints | None = None

    def __repr__(self) -> str:
        return f"Module({self.name})"

    def reduced_again(self, part: Path) -> Module:
        """The same module with another reduction of its finite elements as they are now.

        Args:
            part: File of the reduced part.
        """

        return Module(
            str(part),
            partial(ReducedPart.load, part),
            self._full_now,
            pressure_map=self.pressure_map,
            find_face=self._face_now,
            shape=self.shape,
        )

    def _full_now(self, modulus_factor: float, mass_factor: float) -> PartModel:
        factors = self.modulus_factor * modulus_factor, self.mass_factor * mass_factor
        return self.make_full(*factors).damped(self.damping_factor)

    def _face_now(self) -> Pose | None:
        return self.face

    @cached_property
    def face(self) -> Pose | None:
        """The frame of its attachment face in its own frame; None where it is not known.

        Raises:
            MeshError: Its attachment nodes span no face.
        """
        return self.find_face()

    @cached_property
    def reduced(self) -> ReducedPart:
        """The reduced part."""
        part = self.make_reduced()
        if self.mode_limit is not None:
            part = with_fewer_modes(part, self.mode_limit)
        if self.points is not None:
            part = self.points.of(part)
        factors = (self.modulus_factor, self.mass_factor, self.damping_factor)
        return part if factors == (1.0, 1.0, 1.0) else scaled_part(part, *factors)

    @cached_property
    def bending_digest(self) -> str:
        """Hash of what decides how it bends beside `sheet_mm`, in hexadecimal: its shape at rest
        and its materials as it was made; other reductions of it have the same."""
        part = self.make_reduced()
        content = hashlib.sha256(np.ascontiguousarray(part.rest_nodes).tobytes())
        content.update(f"{part.tetrahedron_material!r}{part.membrane_material!r}".encode())
        return content.hexdigest()

    @property
    def sheet_mm(self) -> float | None:
        """Thickness of its sheet [mm]; None without one, or where its reduction does not say."""
        return self.reduced.sheet_thickness_mm

    @cached_property
    def full(self) -> PartModel:
        """The finite elements."""
        return self.make_full(self.modulus_factor, self.mass_factor).damped(self.damping_factor)

    def scaled(
        self,
        modulus_factor: float = 1.0,
        mass_factor: float = 1.0,
        damping_factor: float = 1.0,
    ) -> Module:
        """The same module of a stiffer or heavier material, or of one that relaxes more."""
        if modulus_factor == mass_factor == damping_factor == 1.0:
            return self
        return replace(
            self,
            modulus_factor=self.modulus_factor * modulus_factor,
            mass_factor=self.mass_factor * mass_factor,
            damping_factor=self.damping_factor * damping_factor,
        )

    def with_fewer_modes(self, count: int) -> Module:
        """The same module, its reduced part with fewer modes.

        Args:
            count: Most modes.
        """
        known = self.mode_limit
        limit = count if known is None else min(known, count)
        return replace(self, mode_limit=limit, points=None)

    def with_fewer_points(self, states: np.ndarray, tolerance: float) -> Module:
        """The same module, its reduced part with fewer sampled points; see
        `pneumorph.reduction.fewer_points`.

        Args:
            states: What it goes through, modal coordinates (state, mode).
            tolerance: Relative residual of its forces there.
        """
        whole = replace(self, points=None)
        return replace(whole, points=fewer_points(whole.reduced, states, tolerance))

    def check_reduction(self) -> None:
        """Refuse a reduced part that does not stand for the finite elements.

        Raises:
            ArtefactError: It was made from another mesh or material.
            ValueError: The finite elements have other cavities than their mesh names so.
        """
        self.reduced.check_model(self.full)

    def driven_by(self, regulators: tuple[int, ...], asked: str, site: object) -> tuple[int, ...]:
        """The regulator of each of its cavities.

        Args:
            regulators: One for each cavity, or one for all.
            asked: What asks for them, for the error.
            site: Name or number of its site, for the error.

        Raises:
            ValueError: There are others.
        """
        cavities = self.reduced.cavity_count
        if len(regulators) not in (1, cavities):
            raise ValueError(
                f"{asked} gives {len(regulators)} regulators to {self.name} at site {site}, "
                f"expected one for each of its {cavities} cavities (such as *+* or 1+2 of two), or "
                "one for all"
            )
        return regulators if len(regulators) == cavities else regulators * cavities

    def describe(self) -> PartSummary:
        """Size, provenance and measured errors of the reduced part, for a summary."""
        return self.reduced.describe(self.name)
