"""What tells that a hub's places or its inertia are in another unit than mm and kg mm^2."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.geometry.mesh import Mesh

Vector = tuple[float, float, float]

_FURTHEST_MM = 500.0
"""How far from the hub what it carries, or what is looked at, may be [mm]."""
_FURTHEST_SIZES = 3.0
"""How far from the hub what it carries may be, relative to its longest side: masts of two and a
half are built, and what is on a higher one tips the robot over."""
_NO_PLACE_MM = 1.0
"""A place whose coordinates are all below is at the frame's origin, or in metres [mm]."""
_LEAST_GYRATION, _MOST_GYRATION = 0.05, 2.0
"""Radius of gyration of a hub that is all in its middle, relative to its longest side, and of one
with a mast on it, relative to the distance of its furthest corner. Of another unit it is 30 times
more, or a thousandth."""


def refuse_distant(
    payload_mm: Vector | None,
    tracked_point_mm: Vector | None,
    centre_mm: Vector | None,
    mesh: Mesh,
) -> None:
    """Refuse points that can be none of a hub's.

    Args:
        payload_mm: Where what it carries lies [mm]; None for nowhere of its own, as the others.
        tracked_point_mm: The point whose travel counts [mm].
        centre_mm: Its centre of mass [mm].
        mesh: The hub's.

    Raises:
        ValueError: One is too far away, or the payload is outside of the hub and in metres.
    """
    named = {
        "payload_mm": payload_mm,
        "tracked_point_mm": tracked_point_mm,
        "centre_mm": centre_mm,
    }
    for name, place in named.items():
        if place is None:
            continue
        away, most = _away_mm(place, mesh), _FURTHEST_MM
        reason = "it is in mm"
        if name == "payload_mm":
            most = _furthest_payload_mm(mesh)
            reason = (
                f"{_FURTHEST_SIZES:g} times the longest side of the hub, "
                f"{mesh.longest_side_mm:.4g} mm, are enough for a mast; it is in mm"
            )
        if away > most:
            raise ValueError(
                f"[hub]: {name} is {_told(place)} mm, {away:.0f} mm away from the hub, "
                f"expected at most {most:.4g}: {reason}"
            )
    if payload_mm is None or not _is_in_metres(payload_mm, mesh):
        return
    if _away_mm(payload_mm, mesh) > 0.0:
        raise ValueError(
            f"[hub]: payload_mm is {_told(payload_mm)}, outside of the hub and less than "
            f"{_NO_PLACE_MM:g} mm from the origin along every axis, expected a place in mm: in "
            f"metres it would be {_told(payload_mm, 1e3)} mm"
        )


def payload_unit_note(place: Vector, mesh: Mesh) -> str | None:
    """What to say of a payload's place that looks like one in another unit and need not be one;
    None of any other.

    Args:
        place: The place [mm].
        mesh: The hub's.
    """
    if _is_in_metres(place, mesh):
        return (
            f"payload_mm of [hub] is {_told(place)}: its origin, or metres for "
            f"{_told(place, 1e3)} mm?"
        )
    if _is_in_cm(place, mesh):
        return (
            f"payload_mm of [hub] is {_told(place)}, {_away_mm(place, mesh):.3g} mm away from "
            f"the hub and lower than it: is that meant, or are these cm for "
            f"{_told(place, 10.0)} mm?"
        )
    return None


def refuse_inertia(given: MassProperties, mesh: Mesh) -> None:
    """Refuse an inertia in another unit, by its radius of gyration: the root of the largest
    principal moment over the mass.

    Of mass in the box around the hub none is further from the centre than the furthest corner, so
    neither is the radius; what the hub carries may stick out of the box.

    Args:
        given: Mass, centre and inertia.
        mesh: The hub's.

    Raises:
        ValueError: The radius is beyond what a hub of this size may have.
    """
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    corner_mm = np.linalg.norm(np.maximum(high - given.centre_mm, given.centre_mm - low))
    least_mm, most_mm = _LEAST_GYRATION * mesh.longest_side_mm, _MOST_GYRATION * float(corner_mm)
    moment = float(np.linalg.eigvalsh(given.inertia)[-1])
    radius_mm = float(np.sqrt(max(moment, 0.0) / given.mass_kg))
    if not least_mm <= radius_mm <= most_mm:
        smallest, largest = (given.mass_kg * each**2 for each in (least_mm, most_mm))
        raise ValueError(
            f"[hub]: the largest principal moment of inertia_kg_mm2 is {moment:.4g} at a mass of "
            f"{given.mass_kg:g} kg, a radius of gyration of {radius_mm:.3g} mm, expected "
            f"{smallest:.2g} to {largest:.4g} ({least_mm:.3g} to {most_mm:.3g} mm) of a hub of "
            f"{' x '.join(f'{each:.4g}' for each in high - low)} mm: it is in kg mm^2; g mm^2 are "
            "1000 times more, kg m^2 a millionth"
        )


def _away_mm(place: Vector, mesh: Mesh) -> float:
    """Distance of a place from the box around a hub [mm]."""
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    return float(np.linalg.norm(np.maximum(np.maximum(low - place, place - high), 0.0)))


def _furthest_payload_mm(mesh: Mesh) -> float:
    return min(_FURTHEST_MM, _FURTHEST_SIZES * mesh.longest_side_mm)


def _is_in_metres(place: Vector, mesh: Mesh) -> bool:
    """Whether a place is next to the origin, and a thousand times it near a hub."""
    if not 0.0 < max(map(abs, place)) < _NO_PLACE_MM:
        return False
    x, y, z = place
    return _away_mm((1e3 * x, 1e3 * y, 1e3 * z), mesh) <= _furthest_payload_mm(mesh)


def _is_in_cm(place: Vector, mesh: Mesh) -> bool:
    """Whether a place is lower than a hub, and ten times it in or above it."""
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    x, y, z = (10.0 * each for each in place)
    above = bool((low[:2] <= (x, y)).all() and ((x, y) <= high[:2]).all() and z >= low[2])
    return place[2] < low[2] and above and _away_mm((x, y, z), mesh) <= _furthest_payload_mm(mesh)


def _told(place: Vector, factor: float = 1.0) -> str:
    return f"({', '.join(f'{factor * each:g}' for each in place)})"
