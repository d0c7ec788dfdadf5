"""Isotropic elastic materials."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Material:
    """Hooke's constants at small strain, and the law that goes on from there.

    Args:
        young_modulus_kPa: Young's modulus E [kPa].
        poisson_ratio: Poisson's ratio nu.
        law: ``corotational``, ``st_venant_kirchhoff``, ``stable_neo_hookean``, or one registered
            with `pneumorph.fem.law_registry.register_law`.

    Raises:
        ValueError: E is not positive or nu lies outside [0, 0.5).
    """

    young_modulus_kPa: float
    poisson_ratio: float
    law: str = "corotational"

    def __post_init__(self) -> None:
        if not 0.0 < self.young_modulus_kPa < float("inf"):
            raise ValueError(
                f"young_modulus_kPa must be positive and finite, got {self.young_modulus_kPa}"
            )
        if not 0.0 <= self.poisson_ratio < 0.5:
            raise ValueError(
                f"poisson_ratio must lie in [0, 0.5), got {self.poisson_ratio}; an incompressible "
                "material needs other elements"
            )

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

    def stiffer(self, factor: float) -> Material:
        """The same material with `factor` times its Young's modulus."""
        return replace(self, young_modulus_kPa=self.young_modulus_kPa * factor)


@dataclass(frozen=True)
class Membrane:
    """A thin sheet on a surface region: resists stretching, not bending."""

    surface: str
    """Name of the mesh's surface region."""
    material: Material
    """What it is made of."""
    thickness_mm: float = 1.0
    """Thickness [mm]."""

    def __post_init__(self) -> None:
        if not self.thickness_mm > 0.0:
            raise ValueError(f"thickness_mm must be positive, got {self.thickness_mm}")


@dataclass(frozen=True)
class LegMaterials:
    """What a leg is made of; the defaults are the paper's table of simulation parameters."""

    silicone: Material = Material(1160.0, 0.2)
    """The inflatable body."""
    paper: Material = Material(2320.0, 0.49)
    """The layer that cannot stretch."""
    paper_thickness_mm: float = 1.0
    """Thickness of that layer [mm]."""
    mass_kg: float = 0.105
    """Mass of the leg, spread evenly over its nodes [kg]."""


@dataclass(frozen=True)
class DiskMaterials:
    """What the disk is made of; the defaults are the paper's."""

    body: Material = Material(5000.0, 0.3)
    """The disk."""
    mass_kg: float = 0.075
    """Mass of the disk, spread evenly over its nodes [kg]."""
