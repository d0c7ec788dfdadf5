"""The bend of a leg under pressure, by pneumorph and by CalculiX."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from calculix_deck import CalculixSettings, calculix_deck
from calculix_run import run_calculix

from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.bend_curve import bend_curve
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import StaticSettings
from pneumorph.geometry.mesh import Mesh
from pneumorph.physics.physics import Rotation

SHEET_LAW = "st_venant_kirchhoff"
"""Law of the sheet in both codes: it hardly stretches, where all laws are one."""
YEOH_RATIOS = (0.16, -0.017)
"""C2 and C3 over C1 of Dragon Skin 30."""


@dataclass(frozen=True)
class LawPair:
    """A law here and the one in CalculiX that it is compared with."""

    ours: str
    """Name of the law here."""
    theirs: str
    """Name of the law there; another only where CalculiX lacks ours."""
    rotation: Rotation = "polar"
    """Where our corotational law takes its rotation from."""

    @property
    def same(self) -> bool:
        """Whether both follow the same equation, so that only rounding and iteration may differ."""
        return self.ours == self.theirs

    @property
    def label(self) -> str:
        """Our law, with its rotation where that matters."""
        return f"{self.ours} ({self.rotation})" if self.ours == "corotational" else self.ours


LAW_PAIRS = (
    LawPair("st_venant_kirchhoff", "st_venant_kirchhoff"),
    LawPair("stable_neo_hookean", "stable_neo_hookean"),
    LawPair("calculix_neo_hooke", "calculix_neo_hooke"),
    LawPair("yeoh", "yeoh"),
    # "edge": its tangent is not symmetric, and only so is it assembled in full.
    LawPair("calculix_corotational", "calculix_corotational", "edge"),
    LawPair("corotational", "calculix_corotational", "polar"),
    LawPair("corotational", "calculix_corotational", "edge"),
)


@dataclass(frozen=True, eq=False)
class BendCurve:
    """Bend of one code against pressure."""

    law: str
    """Law of the solid."""
    pressures_kPa: list[float]
    """Pressures that were reached [kPa]."""
    bends_deg: list[float]
    """Bend of the outer end face at each [degrees]."""
    iterations: int
    """Linear solves in all."""
    wall_s: float
    """Time of all pressures together [s]."""
    message: str
    """Why the first pressure that was not reached was not; empty if all were."""

    def as_json(self) -> dict[str, Any]:
        """All fields, by name."""
        return asdict(self)


def silicone(law: str) -> Material:
    """The silicone of the paper in another law."""
    material = leg_kind("published").materials.silicone
    return Material(material.young_modulus_kPa, material.poisson_ratio, law)


def sheet_membrane() -> Membrane:
    """The sheet of the paper's leg, in the law that both codes have."""
    materials = leg_kind("published").materials
    sheet = materials.sheet
    return Membrane(
        "sheet",
        Material(sheet.young_modulus_kPa, sheet.poisson_ratio, SHEET_LAW),
        materials.sheet_thickness_mm,
    )


def calculix_settings(law: str) -> CalculixSettings:
    """How CalculiX seeks the equilibrium of a law.

    Its hyperfoam takes principal stretches from the roots of a cubic, which cancellation makes
    inexact where strains are small: forces carry noise of 5e-4 of the mean one, and a test of the
    residual would never be passed. Corrections still shrink to 1e-6.
    """
    return CalculixSettings(largest_residual=1e-2 if law == "stable_neo_hookean" else 1e-6)


def calculix_bend(
    mesh: Mesh,
    law: str,
    pressures_kPa: Sequence[float],
    *,
    with_sheet: bool = True,
    time_limit_s: float = 3600.0,
) -> BendCurve:
    """Bend of a leg held at its inner end face, by CalculiX.

    Args:
        mesh: The leg, linear or quadratic.
        law: Law of the silicone, one of `calculix_laws`.
        pressures_kPa: Pressures, one after the other [kPa].
        with_sheet: Whether the leg has its sheet.
        time_limit_s: When to end the run [s].

    Raises:
        FileNotFoundError: CalculiX is not installed.
        ValueError: CalculiX has no such law.
    """
    deck = calculix_deck(
        mesh,
        silicone(law),
        pressures_kPa,
        membranes=(sheet_membrane(),) if with_sheet else (),
        settings=calculix_settings(law),
    )
    result = run_calculix(deck, len(mesh.nodes), time_limit_s)
    bends = [end_face_bend_deg(mesh, mesh.nodes + moved) for moved in result.displacements]
    return BendCurve(
        law,
        list(pressures_kPa[: len(bends)]),
        bends,
        result.iterations,
        result.wall_s,
        "" if len(bends) == len(pressures_kPa) else result.message or "ended early",
    )


def our_bend(
    mesh: Mesh,
    law: str,
    pressures_kPa: Sequence[float],
    *,
    rotation: Rotation = "polar",
    with_sheet: bool = True,
    settings: StaticSettings | None = None,
) -> BendCurve:
    """Bend of the same leg by pneumorph.

    Args:
        mesh: The leg, linear or quadratic.
        law: Law of the silicone.
        pressures_kPa: Pressures, one after the other [kPa].
        rotation: As in `static_equilibrium`.
        with_sheet: Whether the leg has its sheet.
        settings: Steps and tolerance.
    """
    membranes = (sheet_membrane(),) if with_sheet else ()
    part = PartModel(
        mesh, silicone(law), leg_kind("published").materials.mass_kg, membranes, "cavity"
    )
    start = time.perf_counter()
    found = bend_curve(part, pressures_kPa, rotation=rotation, settings=settings)
    wall = time.perf_counter() - start
    message = "" if found.converged else f"no equilibrium beyond {found.reached_kPa:g} kPa"
    return BendCurve(law, found.pressure_kPa, found.bend_deg, found.iterations, wall, message)


def relative_difference(ours: BendCurve, theirs: BendCurve) -> list[float]:
    """(ours - theirs) / theirs at every pressure that both reached."""
    count = min(len(ours.bends_deg), len(theirs.bends_deg))
    return [
        (mine - other) / other
        for mine, other in zip(ours.bends_deg[:count], theirs.bends_deg[:count], strict=True)
    ]
