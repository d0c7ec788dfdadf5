"""Of which physics a reduced part is: by whether it relaxes, and by its law."""

from __future__ import annotations

from pneumorph.catalogue.paper_leg import PhysicsName
from pneumorph.reduction.reduced_part import ReducedPart

PUBLISHED_LAWS = ("corotational", "st_venant_kirchhoff", "stable_neo_hookean")
"""Laws of a solid that are none of a silicone as it was measured."""


def physics_of_part(part: ReducedPart) -> PhysicsName:
    """The physics that a reduced part is of, by whether it relaxes."""
    return "published" if part.relaxation is None else "measured"


def refuse_published_part(part: ReducedPart, what: str, remedy: str) -> None:
    """Refuse, where the measured physics acts, a part that does not relax, of a law of the
    published one: nothing would damp it, at pressures that are not its own.

    The reverse, a part that relaxes in the published physics, its simulator refuses.

    Args:
        part: The part.
        what: What it is, for the error.
        remedy: What else the error says to do.

    Raises:
        ValueError: It is such a part.
    """
    law = part.tetrahedron_material.law
    if part.relaxation is None and law in PUBLISHED_LAWS:
        raise ValueError(
            f"{what} is of the published physics (its law is {law!r} and nothing in it relaxes), "
            f"and the measured leg or physics was asked for, expected one of that: {remedy}, or "
            "reduce it again with pneumorph reduce --preset measured"
        )
