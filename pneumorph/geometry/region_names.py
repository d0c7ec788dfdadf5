"""Regions of a mesh that were called otherwise by earlier versions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, TypeVar

Region = TypeVar("Region")


class HasSurfaces(Protocol):
    """A mesh with named surfaces."""

    @property
    def surfaces(self) -> Mapping[str, Any]:
        """Triangles by region name."""


NODE_SETS = ("attachment", "attachment_face", "inner_end_face", "outer_end_face")
"""What is known by its nodes: where a part is held and how far it turned. In files they may be
faces, of which no surface that touches the floor is made."""

_FIRST_NAMES = {"sheet": "paper"}
_CURRENT_NAMES = {first: now for now, first in _FIRST_NAMES.items()}


def cavity_regions(mesh: HasSurfaces) -> list[str]:
    """Names of a mesh's cavities, in the order in which a reduced part has them."""
    return sorted(name for name in mesh.surfaces if name.startswith("cavity"))


def current_name(name: str) -> str:
    """What a region is called now: ``sheet`` for ``paper``."""
    return _CURRENT_NAMES.get(name, name)


def first_name(name: str) -> str:
    """What a region was called first: digests know it by that, and find what was made with it."""
    return _FIRST_NAMES.get(name, name)


def with_current_names(regions: Mapping[str, Region]) -> dict[str, Region]:
    """Regions by what they are called now; both stay where a mesh has both names."""
    return {
        name if current_name(name) in regions else current_name(name): region
        for name, region in regions.items()
    }
