"""Numbers of drawn worlds that change nothing of a robot: nobody needs to measure them."""

from __future__ import annotations

from pneumorph.catalogue.measured_worlds import UNCERTAINTIES
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.simulation.randomisation import Randomisation

_VALVES = ("filling_factor", "venting_factor")
_OF_SURFACE = "friction "


def idle_numbers(spec: RobotSpec, drawn: Randomisation) -> frozenset[str]:
    """Names of numbers, as `World.numbers` has them, that no design of a robot depends on.

    Friction does not count where each surface has a coefficient of its own, nor that of a surface
    that no contact point lies on, nor valves where the air has none.

    Args:
        spec: The robot.
        drawn: What worlds are drawn from.
    """
    idle = set() if spec.physics.air.law != "rate_limit" else set(_VALVES)
    surfaces, own = _surfaces(spec), dict(drawn.friction_by_surface)
    if surfaces <= own.keys() | dict(spec.physics.friction_by_surface).keys():
        idle.add("friction")
    return frozenset(idle | {_OF_SURFACE + name for name in own.keys() - surfaces})


def idle_notes(spec: RobotSpec, drawn: Randomisation) -> tuple[str, ...]:
    """What to tell of friction that was asked for and changes nothing.

    Args:
        spec: The robot.
        drawn: What worlds are drawn from.
    """
    usual = {Randomisation().friction, UNCERTAINTIES["friction"].distribution}
    if drawn.friction in usual or "friction" not in idle_numbers(spec, drawn):
        return ()
    names = ", ".join(sorted(_surfaces(spec)))
    return (
        f"randomisation.friction {drawn.friction} changes nothing: every surface ({names}) has a "
        "coefficient of its own; set randomisation.friction_by_surface",
    )


def _surfaces(spec: RobotSpec) -> set[str]:
    """Names of what contact points lie on, an empty one where nobody named it."""
    hub, found = spec.hub.rigid, set()
    bodies = [(hub.contact_points, hub.contact_surfaces)]
    for module in spec.modules:
        bodies.append((module.reduced.contact_points, module.reduced.contact_surfaces))
    for points, surfaces in bodies:
        if len(points):
            found |= {""} if surfaces is None else set(surfaces.names.tolist())
    return found
