"""Of which physics a reduced part is: by whether it relaxes, and by its law."""

from __future__ import annotations

from typing import Literal

from pneumorph.reduction.reduced_part import ReducedPart

PhysicsName = Literal["published", "measured"]
"""As the paper simulated its robots, or as their materials were measured; each has its leg."""

_PUBLISHED_LAWS = ("corotational", "st_venant_kirchhoff", "stable_neo_hookean")
"""Laws of a solid that are none of a silicone as it was measured."""


def physics_of_part(part: ReducedPart) -> PhysicsName:
    """The physics that a reduced part is of, by whether it relaxes."""
    return "published" if part.relaxation is None else "measured"


def may_be_measured(part: ReducedPart) -> bool:
    """Whether a part may walk in the measured physics, whose pressures are real ones."""
    return part.relaxation is not None or part.tetrahedron_material.law not in _PUBLISHED_LAWS


def refuse_other_physics(part: ReducedPart, physics: PhysicsName, what: str, remedy: str) -> None:
    """Refuse a part of the other physics: in the measured one nothing would damp a part that does
    not relax, of a law of the published one; in either the pressures would not be its own.

    Args:
        part: The part.
        physics: What acts on it.
        what: What it is, for the error.
        remedy: What else the error says to do.

    Raises:
        ValueError: It is such a part.
    """
    law = part.tetrahedron_material.law
    if physics == "published" and part.relaxation is not None:
        raise ValueError(
            f"{what} is of the measured physics (it relaxes), and the published one was asked for: "
            f"{remedy}, or reduce it again with pneumorph reduce --preset paper"
        )
    if physics == "measured" and not may_be_measured(part):
        raise ValueError(
            f"{what} is of the published physics (its law is {law!r} and nothing in it relaxes), "
            f"and the measured leg or physics was asked for, expected one of that: {remedy}, or "
            "reduce it again with pneumorph reduce --preset measured"
        )
