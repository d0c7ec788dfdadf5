"""Refuse masses that nothing of such a volume has."""

from __future__ import annotations

from pneumorph.geometry.mass_properties import KG_PER_MM3
from pneumorph.geometry.surface import enclosed_volume
from pneumorph.reduction.reduced_part import ReducedPart

CAST_G_PER_ML = (0.3, 3.0)
"""Of a leg that was not weighed: between foam and the published legs, which weigh 2.5 times what
silicone does."""
WEIGHED_G_PER_ML = (0.02, 25.0)
"""Of what was weighed: between a hollow print and solid metal. Kilograms or milligrams where grams
are expected are a thousand times less or more."""
IN_GRAMS = "masses are in grams, so 0.042 kg are 42"


def material_volume(part: ReducedPart) -> float:
    """Volume of a part's material at rest, without its cavities [mm^3]."""
    return enclosed_volume(part.rest_nodes, part.skin) - float(part.cavity_volume.sum())


def check_density(
    what: str, mass_kg: float, volume_mm3: float, expected: tuple[float, float], cause: str
) -> None:
    """Refuse a mass whose density is beyond what is expected.

    Args:
        what: What weighs so much, or the setting that says so.
        mass_kg: The mass [kg].
        volume_mm3: Of its material [mm^3].
        expected: Lowest and highest density [g/ml].
        cause: What a message adds: what may be wrong.

    Raises:
        ValueError: It is beyond.
    """
    density, (low, high) = mass_kg / (KG_PER_MM3 * volume_mm3), expected
    if not low <= density <= high:
        raise ValueError(
            f"{what} weighs {1e3 * mass_kg:.4g} g and has a volume of {1e-3 * volume_mm3:.1f} ml, "
            f"{density:.2g} g/ml, expected {low:g} to {high:g}: {cause}"
        )
