"""Free bends and blocked tips among snapshots, for a reduced part to be measured against."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import MeshError
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.blocked_force import even_load
from pneumorph.reduction.errors import (
    ReducedBend,
    ReducedBlockedForce,
    ReducedCompliance,
    reduced_bend,
    reduced_blocked_force,
    reduced_compliance,
)
from pneumorph.reduction.learned_fields import evenly
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.snapshots import BEND, SnapshotSet
from pneumorph.reduction.tip_answers import TipAnswers, tip_answers

ANSWERED_BENDS = 7
"""Free bends, beside rest, at which the tip's answers to small forces are found."""


class SnapshotCurves:
    """Free bends in each direction, the force of a blocked tip and how the tip gives way.

    Args:
        part: The full-order part.
        snapshots: States of it.
        rotation: Where its elements take their rotation from.
        pressure_limit_kPa: Free bends up to this pressure count.
    """

    def __init__(
        self,
        part: PartModel,
        snapshots: SnapshotSet,
        rotation: Rotation,
        pressure_limit_kPa: float,
    ) -> None:
        self._part, self._snapshots, self._rotation = part, snapshots, rotation
        bend = snapshots.of(BEND)
        bend = bend[snapshots.pressure_kPa[bend] <= pressure_limit_kPa]
        self._directions = _directions(part, snapshots, bend)

    def bends(self, reduced: ReducedPart) -> dict[str, ReducedBend]:
        """Free bends by source: those of all cavities, and of each alone; none of a part without
        cavities."""
        return {
            source: reduced_bend(
                reduced,
                self._part.mesh,
                self._snapshots.states(numbers),
                self._snapshots.pressure_kPa[numbers],
                self._rotation,
                cavities=cavities,
            )
            for source, (numbers, cavities) in self._directions.items()
        }

    def blocked(self, reduced: ReducedPart) -> ReducedBlockedForce | None:
        """Blocked force; None where no snapshot has a blocked tip."""
        there = self._snapshots.of("blocked")
        if len(there) == 0:
            return None
        sources = self._snapshots.sources
        details = self._snapshots.metadata["details"][sources.index("blocked")]
        return reduced_blocked_force(
            reduced,
            self._part.mesh,
            np.array(details["force_mN"]),
            self._snapshots.pressure_kPa[there],
            self._rotation,
            details["face"],
        )

    def compliance(
        self, reduced: ReducedPart, bends: Mapping[str, ReducedBend]
    ) -> ReducedCompliance | None:
        """How the tip gives way at some of the bends of all cavities; None of a part without such
        bends, or whose outer end is no face that forces can be spread over."""
        if BEND not in bends:
            return None
        try:
            even_load(self._part.mesh, "outer_end_face")
        except MeshError:
            return None
        bent = self._snapshots.states(self._directions[BEND][0])
        return reduced_compliance(reduced, self._part, bent, bends[BEND], self._rotation)

    def answers(self) -> TipAnswers:
        """How the tip of the part answers forces, at rest and at some of the free bends in every
        direction."""
        part, snapshots = self._part, self._snapshots
        states = [np.zeros((1, *part.rest_nodes.shape))]
        pressures = [np.zeros((1, len(part.cavities)))]
        for numbers, cavities in self._directions.values():
            few = evenly(numbers, ANSWERED_BENDS)
            inflated = np.isin(part.cavity_names, cavities)
            states.append(snapshots.states(few))
            pressures.append(snapshots.pressure_kPa[few, None] * inflated)
        return tip_answers(part, np.concatenate(states), np.concatenate(pressures), self._rotation)


def _directions(
    part: PartModel, snapshots: SnapshotSet, bend: np.ndarray
) -> dict[str, tuple[np.ndarray, Sequence[str]]]:
    """Numbers of free bends by source, and which cavities are inflated in them; none of a part
    without cavities."""
    found: dict[str, tuple[np.ndarray, Sequence[str]]] = {}
    for place, source in enumerate(snapshots.sources if part.cavities else ()):
        alone = [name for name in part.cavity_names if source == f"{BEND} of {name}"]
        name = source if alone else BEND
        before, _ = found.get(name, (bend[:0], ()))
        numbers = np.concatenate([before, bend[snapshots.source[bend] == place]])
        if len(numbers):
            found[name] = (numbers, alone or part.cavity_names)
    return found
