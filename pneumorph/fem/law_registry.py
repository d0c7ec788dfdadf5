"""The elastic laws that a material may name; your own are registered here as well."""

from __future__ import annotations

from collections.abc import Callable

from pneumorph.fem.corotational import Corotational
from pneumorph.fem.law import Law
from pneumorph.fem.material import Material
from pneumorph.fem.st_venant_kirchhoff import StVenantKirchhoff
from pneumorph.fem.stable_neo_hookean import StableNeoHookean
from pneumorph.fem.yeoh import Yeoh

LawFactory = Callable[[Material, int], Law]
"""Makes a law from a material and d, 3 for a solid and 2 for a sheet; usually the law's class."""

_FACTORIES: dict[str, LawFactory] = {
    "corotational": Corotational,
    "st_venant_kirchhoff": StVenantKirchhoff,
    "stable_neo_hookean": StableNeoHookean,
    "yeoh": Yeoh,
}


def register_law(name: str, factory: LawFactory) -> None:
    """Make a law known by a name.

    Args:
        name: What `Material.law` calls it.
        factory: Usually the law's class.

    Raises:
        ValueError: Another law has this name.
    """
    if _FACTORIES.get(name, factory) is not factory:
        raise ValueError(f"law {name!r} is taken by {_FACTORIES[name]}; choose another name")
    _FACTORIES[name] = factory


def law_names() -> tuple[str, ...]:
    """Names of all laws known."""
    return tuple(_FACTORIES)


def make_law(material: Material, dimension: int) -> Law:
    """The law that a material names.

    Args:
        material: The material.
        dimension: d, 3 for a solid and 2 for a sheet.

    Raises:
        ValueError: No law has that name.
    """
    if material.law not in _FACTORIES:
        raise ValueError(
            f"law must be one of {', '.join(_FACTORIES)}, got {material.law!r}; a law of "
            "your own must be registered first"
        )
    return _FACTORIES[material.law](material, dimension)
