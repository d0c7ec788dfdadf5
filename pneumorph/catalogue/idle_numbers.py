"""Numbers of drawn worlds that change nothing of a robot: nobody needs to measure them."""

from __future__ import annotations

from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.part_physics import PhysicsName
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.physics import Physics
from pneumorph.simulation.distribution import Distribution
from pneumorph.simulation.randomisation import Randomisation

_VALVES = ("filling_factor", "venting_factor")
_OF_SURFACE = "friction "


def idle_numbers(spec: RobotSpec, drawn: Randomisation) -> frozenset[str]:
    """Names of numbers, as `World.numbers` has them, that no design of a robot depends on.

    Friction does not count where each surface has a coefficient of its own, nor that of a surface
    that no contact point lies on, nor valves where the air has none. Where worlds have other
    reductions of the leg, friction is taken to count.

    Args:
        spec: The robot.
        drawn: What worlds are drawn from.
    """
    idle = set() if spec.physics.air.law != "rate_limit" else set(_VALVES)
    surfaces, own = _surfaces(spec), dict(drawn.friction_by_surface)
    if drawn.reductions:
        return frozenset(idle)
    if surfaces <= own.keys() | dict(spec.physics.friction_by_surface).keys():
        idle.add("friction")
    return frozenset(idle | {_OF_SURFACE + name for name in own.keys() - surfaces})


def reasons_of_idle(spec: RobotSpec, drawn: Randomisation) -> dict[str, str]:
    """Why each of `idle_numbers` changes nothing, by its name; arguments as there."""
    names = ", ".join(sorted(_surfaces(spec)))
    why = {"friction": f"every surface ({names}) has a coefficient of its own"}
    why |= dict.fromkeys(_VALVES, "the robot's air has no valves")
    idle = sorted(idle_numbers(spec, drawn))
    return {name: why.get(name, "no contact point lies on it") for name in idle}


def idle_notes(spec: RobotSpec, drawn: Randomisation) -> tuple[str, ...]:
    """What to tell of numbers that were asked for or measured and change nothing, or nothing in
    drawn worlds.

    Args:
        spec: The robot.
        drawn: What worlds are drawn from.
    """
    laws = drawn.distributions
    usual = [each.distributions for each in (Randomisation(), measured_worlds())]
    idle = reasons_of_idle(spec, drawn)
    surfaces = _surfaces(spec)
    nothing = tuple(
        f"randomisation.{name} changes nothing: {why}"
        for name, why in idle.items()
        if all(laws[name] != each.get(name) for each in usual)
    )
    tested = tuple(
        f"the test of {name} changes nothing: {idle[name]}"
        for name, _, _ in drawn.measured
        if name in idle
    )
    usual_physics = leg_kind(_kind(spec.physics)).physics
    named = dict(spec.physics.friction_by_surface)
    constant = tuple(
        f"friction {name} is {named[name]:g} in all worlds: physics.friction_by_surface names it, "
        "and randomisation.friction_by_surface does not"
        for name in sorted(surfaces & named.keys())
        if _OF_SURFACE + name not in laws and "friction" in laws
        if named[name] != _frictions(usual_physics).get(_OF_SURFACE + name)
    )
    felt = {_OF_SURFACE + name for name in surfaces}
    if not surfaces <= named.keys():
        felt.add("friction")
    undrawn = tuple(
        f"{name} {value:g} of the physics holds in the world as it stands alone: drawn worlds have "
        "the frictions of [randomisation]"
        for name, value in _frictions(spec.physics).items()
        if name in laws and name in felt and laws[name] != Distribution.parse(repr(value))
        if value != _frictions(usual_physics).get(name)
    )
    return (*nothing, *tested, *constant, *undrawn)


def _kind(physics: Physics) -> PhysicsName:
    """The physics that one is a change of."""
    return "published" if physics.damping == "published" else "measured"


def _frictions(physics: Physics) -> dict[str, float]:
    """Coefficients by the names that numbers of worlds have."""
    named = {_OF_SURFACE + name: value for name, value in physics.friction_by_surface}
    return {"friction": physics.friction} | named


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
