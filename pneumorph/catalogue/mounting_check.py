"""Refuse modules that are not where a robot has its sites, that weigh what nothing weighs or that
are inflated otherwise than the real ones."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np

from pneumorph.catalogue.density_check import CAST_G_PER_ML, check_density, material_volume
from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.site import Site
from pneumorph.geometry.overlap import deepest_inside
from pneumorph.geometry.pose import Pose
from pneumorph.geometry.surface import boundary_triangles, winding_number
from pneumorph.geometry.triangle_distance import distance_to
from pneumorph.physics.physics import Physics
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design import Fitting
from pneumorph.robot.design_space import DesignSpace

USUAL_TOLERANCE_MM = 3.0
"""Widest gap between hub and attachment face, and deepest overlap, where none is asked for [mm]."""
_WAY_OUT = 1.5
"""Length of an oblique way out of the hub, at most 48 degrees off, over the depth it begins in."""
_BESIDE_MM = 1e-3
"""Faces that are so much further away than the nearest are as near [mm]."""
_SMALLEST_HUB_MM = 2.0
"""A hub that is smaller was probably given in metres [mm]."""
_SHIFT_MM = 0.1
"""What shifts that an error tells are rounded to [mm]."""
ALLOWED_BY = "allow it by mounting_tolerance_mm"


def check_cast_mass(part: ReducedPart, what: str, setting: str) -> None:
    """Refuse a part that was not weighed and whose mass does not go with its volume.

    Args:
        part: The part.
        what: What it is, for the error.
        setting: By which its mass is given where it was weighed.

    Raises:
        ValueError: No leg that is cast has such a density.
    """
    if not len(part.skin):  # of another program, without its volume
        return
    cause = f"its mass may be that of another leg; weigh it and give {setting}"
    check_density(what, part.mass, material_volume(part), CAST_G_PER_ML, cause)


def check_inflation(module: Module, name: str, physics: Physics) -> None:
    """Refuse a module that the physics would inflate otherwise than the real one.

    Args:
        module: The module.
        name: What its description calls it.
        physics: What acts on the robot.

    Raises:
        ValueError: Its map of pressures is another one.
    """
    own = module.pressure_map
    if own is not None and own != physics.pressure_map:
        raise ValueError(
            f"modules.{name} bends as the real leg does with a pressure map of slope "
            f"{own.slope:g} and intercept {own.intercept_kPa:g} kPa, the physics has "
            f"{physics.pressure_map.slope:g} and {physics.pressure_map.intercept_kPa:g}: expected "
            "one map for all modules; choose legs of one kind, or physics.pressure_map"
        )


def check_mounted(
    hub: HubSpec,
    sites: Sequence[Site],
    space: DesignSpace,
    tolerance_mm: float,
    allowed_by: str = ALLOWED_BY,
) -> None:
    """Refuse a gap between the hub and a module's attachment face, and a module inside the hub,
    where a design has it.

    Args:
        hub: The hub.
        sites: The sites with their modules.
        space: The robot's designs.
        tolerance_mm: Widest gap and deepest overlap [mm].
        allowed_by: What else an error says to do.

    Raises:
        ValueError: A module's attachment face is not known, or it is too far away or too deep, or
            the hub is too small for any.
    """
    nodes, skin = hub.mesh.nodes, boundary_triangles(hub.mesh.tetrahedra)
    across_mm = hub.mesh.longest_side_mm
    if across_mm < _SMALLEST_HUB_MM:
        raise ValueError(
            f"the hub is {across_mm:g} mm across, expected {_SMALLEST_HUB_MM:g} at least: lengths "
            "are in mm, not in metres"
        )
    wrong: dict[str, str] = {}
    for number, site in enumerate(sites):
        where = _where(sites, number)
        placed = [
            (module, site.pose_of(module))
            for kind, module in enumerate(site.modules)
            if space.allows_together({number: _fittings(space, number, kind)})
        ]
        for module, pose in placed:
            if module.face is None:
                raise ValueError(
                    f"module {module.name} at {where} does not say what of it is attached, "
                    "expected the mesh that it was made from: give its mesh, or reduce it again"
                )
            if where in wrong:
                continue
            # What would mend it takes seconds to find, and is told of the first alone.
            shifted = [] if wrong else [each for each in placed if each[0].face is not None]
            said = _misplaced(module, pose, (nodes, skin), tolerance_mm, allowed_by, shifted)
            if said is not None:
                wrong[where] = f"module {module.name} at {where} {said}"
    if wrong:
        first, *others = wrong
        raise ValueError(
            f"{wrong[first]}" + (f"; misplaced too: {', '.join(others)}" if others else "")
        )


def _misplaced(
    module: Module,
    pose: Pose,
    hub: tuple[np.ndarray, np.ndarray],
    tolerance_mm: float,
    allowed_by: str,
    placed: Sequence[tuple[Module, Pose]],
) -> str | None:
    """What is wrong with where a module is on a hub of these nodes and skin; None for nothing. A
    shift of the site that mends it is looked for with all of its modules, as they are placed."""
    assert module.face is not None
    nodes, skin = hub
    face = pose.apply(module.face.translation)
    gap = distance_to(face, nodes[skin])
    if gap > tolerance_mm and winding_number(face[None], nodes, skin)[0] < 0.5:
        return (
            f"has its attachment face {gap:.1f} mm away from the hub, its middle at "
            f"{np.round(face, 1).tolist()} mm, expected at most {tolerance_mm:g}: move the site "
            f"to the hub's surface, or {allowed_by}"
        )
    outwards = pose.rotation @ module.face.rotation[:, 0]
    own = pose.apply(module.reduced.rest_nodes)
    depth, place = deepest_inside(own, nodes, skin)
    if depth <= tolerance_mm:
        # In a hub that is thin beside what is allowed nothing is deep.
        length_mm = float(((own - face) @ outwards).max())
        through = _way_through(face, outwards, length_mm, tolerance_mm, hub)
        if through <= _WAY_OUT * tolerance_mm + 1.0:
            return None
        return (
            f"goes {through} mm through the hub: does the site's x axis point away from it, with "
            "angles in degrees? Turn or move the site"
        )
    bottom, top = nodes[:, 2].min(), nodes[:, 2].max()
    behind = float((face - place) @ outwards)
    way_out = _nearest_normal(place, outwards, nodes[skin])
    if gap > tolerance_mm or behind < tolerance_mm:
        normal = _nearest_normal(face, outwards, nodes[skin])
        askew = float(np.degrees(np.arccos(np.clip(normal @ outwards, -1.0, 1.0))))
        cause = (
            "does the site's x axis point away from the hub, whose height is from "
            f"{bottom:g} to {top:g} mm? It is {askew:.3g} degrees off the normal of the nearest "
            "face; turn or move the site"
        )
    else:
        furthest_mm = depth + tolerance_mm
        shift = _shift_out(placed, (way_out, outwards), furthest_mm, hub, tolerance_mm)
        cause = f"that is {behind:.1f} mm behind its attachment face, where base plates reach; " + (
            f"no shift that way or along the site's x axis by up to {furthest_mm:.1f} mm mends "
            "it: roll or pitch the site less"
            if shift is None
            else f"move the site by {shift.tolist()} mm, or roll or pitch it less"
        )
    return (
        f"is up to {depth:.1f} mm inside the hub, at {_tidy(place).tolist()} mm, from where "
        f"the hub's nearest face is towards {_tidy(way_out).tolist()}, expected at most "
        f"{tolerance_mm:g}: {cause}, or {allowed_by}"
    )


def _shift_out(
    placed: Sequence[tuple[Module, Pose]],
    directions: Sequence[np.ndarray],
    furthest_mm: float,
    hub: tuple[np.ndarray, np.ndarray],
    tolerance_mm: float,
) -> np.ndarray | None:
    """Shortest shift of a site along one of some directions, so far at most, after which none of
    its modules is misplaced [mm], (3,); None if there is none."""
    furthest = len(np.arange(0.0, furthest_mm, _SHIFT_MM))
    shortest = None
    for direction in directions:
        steps = 1
        while steps <= furthest:
            shift = _tidy(steps * _SHIFT_MM * direction)
            moved = [
                (module, Pose(pose.rotation, pose.translation + shift)) for module, pose in placed
            ]
            depth = max(
                (
                    deepest_inside(pose.apply(module.reduced.rest_nodes), *hub)[0]
                    for module, pose in moved
                ),
                default=0.0,
            )
            if depth > tolerance_mm:
                # No point comes out faster than the site moves.
                steps += max(1, int((depth - tolerance_mm) / _SHIFT_MM))
                continue
            if all(_misplaced(*each, hub, tolerance_mm, "", moved) is None for each in moved):
                shortest, furthest = shift, steps - 1
                break
            steps += 1
    return shortest


def _tidy(vector: np.ndarray) -> np.ndarray:
    """A vector for an error: to 0.1, without negative zeros."""
    rounded: np.ndarray = np.round(vector, 1) + 0.0
    return rounded


def _nearest_normal(place: np.ndarray, outwards: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Outward normal of the nearest of a hub's triangles, a unit vector (3,); of those that are as
    near, such as beside an edge, the one that is most along a direction.

    Args:
        place: From where [mm], (3,).
        outwards: The direction, a unit vector (3,).
        triangles: (triangle, 3, 3) [mm].
    """
    far = np.array([distance_to(place, each[None]) for each in triangles])
    near = triangles[far <= far.min() + _BESIDE_MM]
    normals = np.cross(near[:, 1] - near[:, 0], near[:, 2] - near[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    nearest: np.ndarray = normals[np.argmax(normals @ outwards)]
    return nearest


def _way_through(
    face: np.ndarray,
    outwards: np.ndarray,
    length_mm: float,
    gap_mm: float,
    hub: tuple[np.ndarray, np.ndarray],
) -> int:
    """How far a module of a length goes through what it is attached to [mm], from at most so far
    ahead of its face: beyond free space is another part of the hub."""
    ahead_mm = np.arange(0.5, length_mm)
    inside = winding_number(face + ahead_mm[:, None] * outwards, *hub) > 0.5
    (within,) = np.nonzero(inside)
    if len(within) == 0 or ahead_mm[within[0]] > gap_mm:
        return 0
    (free,) = np.nonzero(~inside[within[0] :])
    return int(free[0]) if len(free) else len(inside) - int(within[0])


def check_apart(
    sites: Sequence[Site], space: DesignSpace, tolerance_mm: float, allowed_by: str = ALLOWED_BY
) -> None:
    """Refuse modules that reach into each other at two sites of one design, at rest.

    Args:
        sites: The sites with their modules.
        space: The robot's designs.
        tolerance_mm: Deepest overlap [mm].
        allowed_by: What else an error says to do.

    Raises:
        ValueError: Two do.
    """
    placed = [
        [(module, site.pose_of(module).apply(module.reduced.rest_nodes)) for module in site.modules]
        for site in sites
    ]
    for first, second in combinations(range(len(sites)), 2):
        for (kind, (module, mine)), (other_kind, (neighbour, theirs)) in product(
            enumerate(placed[first]), enumerate(placed[second])
        ):
            low = np.maximum(mine.min(axis=0), theirs.min(axis=0))
            if (low >= np.minimum(mine.max(axis=0), theirs.max(axis=0))).any():
                continue
            legs = {
                first: _fittings(space, first, kind),
                second: _fittings(space, second, other_kind),
            }
            if not space.allows_together(legs):
                continue
            depth, place = max(
                deepest_inside(mine, theirs, neighbour.reduced.skin),
                deepest_inside(theirs, mine, module.reduced.skin),
                key=lambda found: found[0],
            )
            if depth > tolerance_mm:
                raise ValueError(
                    f"module {module.name} at {_where(sites, first)} and {neighbour.name} at "
                    f"{_where(sites, second)} are up to {depth:.1f} mm inside each other, at "
                    f"{np.round(place, 1).tolist()} mm, expected at most {tolerance_mm:g}: move "
                    f"the sites apart, forbid both at once by designs.exclusions, or {allowed_by}"
                )


def _fittings(space: DesignSpace, site: int, kind: int) -> list[Fitting]:
    """How a site's module of a kind may be driven, of the designs' rules for that site."""
    return [leg for leg in space.fittings[site] if leg.module == kind]


def _where(sites: Sequence[Site], number: int) -> str:
    name = sites[number].name
    return f"sites[{number}]" + (f" ({name})" if name else "")
