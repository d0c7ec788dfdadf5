"""The physics of a robot as its file has it, `[physics]`: one by name, and what differs from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pneumorph.base.checked import Checked
from pneumorph.base.plain_values import plain
from pneumorph.base.settings import SettingsError, laid_over, settings_from_dict, settings_to_dict
from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.catalogue.part_physics import PhysicsName
from pneumorph.physics.physics import Physics


@dataclass(frozen=True)
class ActingDescription(Checked):
    """The physics by name; all else of the table are fields of `Physics` that differ from it."""

    based_on: PhysicsName = "measured"
    """Whose physics, and whose finite elements."""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """Fields of `Physics`, as nested tables."""

    @property
    def said(self) -> dict[str, Any]:
        """The changes, as a file would have them.

        Raises:
            ValueError: No file can hold a value; names its field.
        """
        try:
            return {name: plain(each, name) for name, each in self.changes.items()}
        except ValueError as error:
            raise ValueError(f"[physics]: {error}") from error

    @property
    def physics(self) -> Physics:
        """What acts on the robot.

        Raises:
            ValueError: No such field, or a value out of range.
        """
        named, said = settings_to_dict(leg_kind(self.based_on).physics), self.said
        try:
            return settings_from_dict(Physics, laid_over(named, said))
        except ValueError as error:
            told = error.reasons if isinstance(error, SettingsError) else error
            raise ValueError(f"[physics]: {told}") from error
