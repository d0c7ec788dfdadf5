"""What the files of a design's solids are called."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import count

OF_A_MOULD = ("mould_upper", "mould_lower", "core")
"""What the names of solids of a leg's mould end with."""


def file_names(names: Sequence[str]) -> dict[str, str]:
    """What the files of each kind of leg begin with, by its name.

    Only Latin letters, digits and hyphens are left, others are a hyphen. Names that are one then,
    small or capital letters, are numbered in their order, so that no file is another's:
    ``long leg`` and ``long_leg`` are ``long-leg-1`` and ``long-leg-2``, names in other scripts
    ``leg-1``, ``leg-2``.

    Args:
        names: Of the kinds, each once; an empty one begins nothing.
    """
    plain = {name: _plain(name) for name in names}
    alike = Counter(each.lower() for each in plain.values())
    taken = set(alike)
    found = {}
    for name, usual in plain.items():
        found[name] = usual
        if alike[usual.lower()] > 1:
            stem = usual.strip("-") or "leg"
            number = next(n for n in count(1) if f"{stem}-{n}".lower() not in taken)
            found[name] = f"{stem}-{number}"
            taken.add(found[name].lower())
    return found


def _plain(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9-]+", "-", name)


def file_name(kind: str, solid: str) -> str:
    """What a solid of a kind of leg is called, whose files begin so."""
    return f"{kind}_{solid}" if kind else solid


def on_paper(solid: str, names: Mapping[str, str]) -> str:
    """What a solid is called in the parts list: as its files, with the name of its leg where that
    is numbered there.

    Args:
        solid: What its files are called.
        names: What the files of each kind of leg begin with.
    """
    kind = solid.partition("_")[0]
    numbered = [name for name, own in names.items() if own == kind != _plain(name)]
    return f"{solid} ({numbered[0]})" if numbered else solid
