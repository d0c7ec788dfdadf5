"""Isotropic elastic materials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Annotated, Any, Literal

from pneumorph.base.checked import Bounds, Checked, Positive
from pneumorph.fem.prony import PronySeries

MassLumping = Literal["even", "volume"]
"""How a mass is shared among nodes: evenly, or by what their elements hold."""

Dilatation = Literal["pointwise", "mean"]
"""Where elements take their change of volume: at each integration point, or once for an element, so
that nearly incompressible ones do not lock."""

YEOH_RATIOS = ("yeoh_c2_over_c1", "yeoh_c3_over_c1")
"""Constants of a material that are of Yeoh's law."""
LAWS_OF_HOOKES_CONSTANTS = ("corotational", "st_venant_kirchhoff", "stable_neo_hookean")
"""Laws that have no constants but these."""


@dataclass(frozen=True, repr=False)
class Material(Checked):
    """Hooke's constants, which hold at small strain, and the law that holds at large strain.

    Args:
        young_modulus_kPa: Young's modulus E [kPa].
        poisson_ratio: Poisson's ratio nu.
        law: ``corotational``, ``st_venant_kirchhoff``, ``stable_neo_hookean``, ``yeoh``, or one
            registered with `pneumorph.fem.law_registry.register_law`.
        yeoh_c2_over_c1: C2 / C1 of the law ``yeoh``; C1 is mu / 2.
        yeoh_c3_over_c1: C3 / C1 of the law ``yeoh``.
        dilatation: Where a solid's elements take their change of volume; ``mean`` is for laws whose
            energy depends on lambda by lambda/2 (J - 1)^2 alone.

    Raises:
        ValueError: E is not positive or nu lies outside [0, 0.5).
    """

    young_modulus_kPa: Positive
    poisson_ratio: Annotated[
        float, Bounds(least=0.0, below=0.5, why="an incompressible material needs other elements")
    ]
    law: str = "corotational"
    yeoh_c2_over_c1: float = 0.0
    yeoh_c3_over_c1: float = 0.0
    dilatation: Dilatation = "pointwise"

    @property
    def lame_mu(self) -> float:
        """Shear modulus mu = E / (2 (1 + nu)) [kPa]."""
        return self.young_modulus_kPa / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lame_lambda(self) -> float:
        """First Lame constant lambda = E nu / ((1 + nu) (1 - 2 nu)) [kPa]."""
        young, poisson = self.young_modulus_kPa, self.poisson_ratio
        return young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))

    def lame_constants(self, dimension: int) -> tuple[float, float]:
        """lambda and mu [kPa]; lambda of a sheet (2) is that of plane stress, E nu / (1 - nu^2)."""
        if dimension == 2:
            young, poisson = self.young_modulus_kPa, self.poisson_ratio
            return young * poisson / (1.0 - poisson**2), self.lame_mu
        return self.lame_lambda, self.lame_mu

    def without_lambda(self) -> Material:
        """The same law and shear modulus with lambda = 0, volume taken at every point."""
        return replace(
            self,
            young_modulus_kPa=2.0 * self.lame_mu,
            poisson_ratio=0.0,
            dilatation="pointwise",
        )

    def __repr__(self) -> str:
        # What full-order walks are kept by: fields that were not asked for are no part of it.
        return f"Material({', '.join(f'{k}={v!r}' for k, v in self.ingredients().items())})"

    def ingredients(self) -> dict[str, Any]:
        """Fields by name, JSON-serialisable, without those that were not asked for."""
        optional = (*YEOH_RATIOS, "dilatation")
        unused = {name for name in optional if getattr(self, name) == getattr(Material, name)}
        return {name: value for name, value in asdict(self).items() if name not in unused}

    def refuse_unused(self, dimension: int) -> None:
        """Refuse what its elements would do nothing with.

        Args:
            dimension: 3 for a solid and 2 for a sheet.

        Raises:
            ValueError: Constants of Yeoh's law of another law, or a sheet's mean dilatation.
        """
        if self.law in LAWS_OF_HOOKES_CONSTANTS:
            for name in YEOH_RATIOS:
                if getattr(self, name) != 0.0:
                    raise ValueError(
                        f"{name} is {getattr(self, name):g} of the law {self.law!r}, expected 0: "
                        "it is a constant of the law 'yeoh' alone; leave it out, or choose that law"
                    )
        if dimension == 2 and self.dilatation != "pointwise":
            raise ValueError(
                f"a sheet's dilatation is {self.dilatation!r}, expected 'pointwise': a sheet is "
                "free to change its thickness, and has no volume of its own"
            )

    def stiffer(self, factor: float) -> Material:
        """The same material with `factor` times its Young's modulus."""
        return replace(self, young_modulus_kPa=self.young_modulus_kPa * factor)


@dataclass(frozen=True)
class Membrane(Checked):
    """A thin sheet on a surface region: resists stretching, not bending."""

    surface: str
    """Name of the mesh's surface region."""
    material: Material
    """What it is made of."""
    thickness_mm: Positive = 1.0
    """Thickness [mm]."""


@dataclass(frozen=True)
class LegMaterials(Checked):
    """What a leg is made of."""

    silicone: Material = Material(1160.0, 0.2)
    """Silicone of the inflatable body."""
    sheet: Material = Material(2320.0, 0.49)
    """Sheet under the leg, which hardly stretches and so makes it bend."""
    sheet_thickness_mm: Positive = 1.0
    """Thickness of the sheet [mm]."""
    mass_kg: Positive = 0.105
    """Mass of the leg [kg]."""
    mass_lumping: MassLumping = "even"
    """How the mass is shared among the nodes. `even`: the same for all (the paper). `volume`: by
    the volume of their elements, as in a casting."""
    relaxation: PronySeries = field(default_factory=PronySeries)
    """Relaxation of the silicone, down to the constants given as `silicone`."""

    @classmethod
    def upgraded(cls, content: Mapping[str, Any]) -> dict[str, Any]:
        """Settings of an earlier version, whose sheet was called ``paper``."""
        return {name.replace("paper", "sheet", 1): value for name, value in content.items()}
