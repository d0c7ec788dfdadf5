"""What a part of finite elements is made of, for files and for digests of what is computed with it.

Surface regions are called what the first version called them: renaming one changes no file.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

from pneumorph.base.settings import settings_to_dict
from pneumorph.fem.material import Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.region_names import cavity_regions, first_name


def ingredients(part: PartModel) -> dict[str, Any]:
    """Its materials, JSON-serialisable: ``material``, ``membranes``, ``mass_kg``, and where they
    are not the usual ones ``mass_lumping``, ``relaxation`` and ``cavities``."""
    series = None if part.branches is None else settings_to_dict(part.branches.series)
    return {
        "material": part.material.ingredients(),
        "membranes": [
            {**asdict(each), "material": each.material.ingredients()} for each in _membranes(part)
        ],
        "mass_kg": part.mass_kg,
        **lumping(part),
        **({} if series is None else {"relaxation": series}),
        **_cavities(part),
    }


def lumping(part: PartModel) -> dict[str, Any]:
    """``mass_lumping`` unless it is even: what earlier versions kept does not say so."""
    chosen = part.mass_lumping
    if isinstance(chosen, str):
        return {} if chosen == "even" else {"mass_lumping": chosen}
    return {"mass_lumping": chosen.tolist()}


def materials_text(part: PartModel) -> list[str]:
    """What it is made of as text."""
    relaxation = [] if part.branches is None else [repr(part.branches.series)]
    cavities = [f"{name} {each!r}" for name, each in _cavities(part).items()]
    return [repr(part.material), repr(_membranes(part)), *relaxation, *cavities]


def _cavities(part: PartModel) -> dict[str, list[str]]:
    """``cavities`` unless they are all that the mesh has, in its order: what earlier versions kept
    does not say so."""
    inflated = list(part.cavity_names)
    return {} if inflated == cavity_regions(part.mesh) else {"cavities": inflated}


def _membranes(part: PartModel) -> tuple[Membrane, ...]:
    return tuple(replace(each, surface=first_name(each.surface)) for each in part.membranes)
