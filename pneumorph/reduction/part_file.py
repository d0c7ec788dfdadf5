"""The file of a reduced part: an npz that numpy alone can read (docs/file_formats.md)."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from pneumorph.base.artefact import ArtefactError, load_artefact, reading, save_artefact
from pneumorph.fem.law_registry import law_names
from pneumorph.fem.material import Material
from pneumorph.reduction.reduced_arrays import OPTIONAL, STRETCHES, WALLS, ReducedArrays

FORMAT_VERSION = 3
_UNCHANGING_VERSION = 2
"""Of files that know neither Yeoh's law, nor volumes of whole elements, nor relaxation."""
_MATERIAL_ENTRIES = tuple(item.name for item in fields(Material))

Part = TypeVar("Part", bound=ReducedArrays)


def write_part(path: Path | str, part: ReducedArrays) -> Path:
    """Write a part's arrays; mode shapes are stored in single precision."""
    arrays: dict[str, np.ndarray] = {}
    for item in fields(part):
        value = getattr(part, item.name)
        if isinstance(value, Material):
            for entry in _MATERIAL_ENTRIES:
                arrays[_entry_name(item.name, entry)] = np.array(getattr(value, entry))
        elif item.name != "metadata" and not (
            item.name in (*OPTIONAL, *STRETCHES, *WALLS) and len(value) == 0
        ):
            arrays[item.name] = np.asarray(value)
    arrays["modes"] = arrays["modes"].astype(np.float32)
    return save_artefact(path, "ReducedPart", FORMAT_VERSION, arrays, part.metadata)


def read_part(path: Path | str, kind: type[Part]) -> Part:
    """Read the arrays of a part, of either version.

    Args:
        path: The file.
        kind: What to make of them.

    Raises:
        ArtefactError: The file is truncated, of another kind or another format version, or its law
            is not known.
    """
    arrays, metadata = load_artefact(path, "ReducedPart", FORMAT_VERSION, _UNCHANGING_VERSION)
    with reading(path, "ReducedPart"):
        if metadata["format_version"] == _UNCHANGING_VERSION:
            _add_what_is_new(arrays)
        return _from_arrays(path, kind, arrays, metadata)


def _from_arrays(
    path: Path | str, kind: type[Part], arrays: dict[str, np.ndarray], metadata: dict[str, Any]
) -> Part:
    materials = {item.name for item in fields(kind) if item.name.endswith("_material")}
    names = {item.name for item in fields(kind)} - {"metadata"} - materials
    names |= {_entry_name(name, entry) for name in materials for entry in _MATERIAL_ENTRIES}
    lacking = names - set(arrays) - {*OPTIONAL, *STRETCHES, *WALLS}
    if lacking or set(arrays) - names:
        raise ArtefactError(
            f"{path} lacks {sorted(lacking)} and has unknown "
            f"{sorted(set(arrays) - names)}; it was written by a different pneumorph"
        )
    content: dict[str, Any] = {}
    for name in materials:
        entry = {each: arrays.pop(_entry_name(name, each)).item() for each in _MATERIAL_ENTRIES}
        if entry["law"] not in law_names():
            raise ArtefactError(
                f"{path} has the law {entry['law']!r}, expected {', '.join(law_names())}; a "
                "law of your own must be registered before its parts are read"
            )
        content[name] = Material(**entry)
    for name, value in arrays.items():
        content[name] = value.astype(np.float64) if value.dtype == np.float32 else value
    content["mass"] = float(content["mass"])
    return kind(**content, metadata=metadata)


def _add_what_is_new(arrays: dict[str, np.ndarray]) -> None:
    """Give the arrays of an older file those that it does not know, as they were before."""
    mode_count = len(arrays["linear_stiffness"])
    for power in (1, 2, 3):
        arrays[f"dilatation_{power}"] = np.zeros((0, *(mode_count,) * power))
    arrays["relaxation_weight"] = arrays["relaxation_time"] = np.zeros(0)
    for material in ("tetrahedron_material", "membrane_material"):
        for entry in ("yeoh_c2_over_c1", "yeoh_c3_over_c1", "dilatation"):
            arrays[_entry_name(material, entry)] = np.array(getattr(Material, entry))


def _entry_name(material: str, entry: str) -> str:
    # tetrahedron_material's law is saved as tetrahedron_law, and so on.
    return material.removesuffix("material") + entry
