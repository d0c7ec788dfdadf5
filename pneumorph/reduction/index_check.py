"""Whether the numbers by which a reduced part names nodes and sampled points are of its mesh."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pneumorph.base.numbering import check_within

POINT_COUNTS = "point_counts"
"""Entry of a part's metadata: how many points its mesh has, before some were sampled, by
``tetrahedron`` and ``membrane``; files of earlier versions lack it."""
_MOST_POINTS_PER_NODE = 50
"""More than any mesh has: quadratic tetrahedra have some three, linear ones six."""


def check_indices(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> None:
    """Refuse a number of a node, of a sampled point or of a gap that there is none of.

    Args:
        arrays: ``rest_nodes``, ``skin``, ``tetrahedron_index``, ``membrane_index``, ``wall_axis``
            and ``wall_pair_gap`` of a part.
        metadata: The part's.

    Raises:
        ValueError: There is one; names the array or the entry of the metadata.
    """
    node_count = len(arrays["rest_nodes"])
    check_within("skin", arrays["skin"], node_count, "nodes")
    check_within("wall_pair_gap", arrays["wall_pair_gap"], len(arrays["wall_axis"]), "gaps")
    tied = metadata.get("attachment_nodes", [])
    if not isinstance(tied, list):
        raise ValueError(f"attachment_nodes is {tied!r:.60}, expected a list of nodes")
    check_within("attachment_nodes", np.array(tied), node_count, "nodes")
    counts = metadata.get(POINT_COUNTS, {})
    for kind in ("tetrahedron", "membrane"):
        count = counts.get(kind) if isinstance(counts, Mapping) else counts
        if count is None:
            count = _MOST_POINTS_PER_NODE * node_count
        if not isinstance(count, int):
            raise ValueError(f"{POINT_COUNTS}.{kind} is {count!r:.60}, expected a whole number")
        name = f"{kind}_index"
        check_within(name, arrays[name], count, f"points of the {kind} elements")
