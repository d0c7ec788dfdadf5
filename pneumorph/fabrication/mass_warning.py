"""What is said where a robot's built masses are not those that it was simulated with."""

from __future__ import annotations

from collections.abc import Mapping

from pneumorph.catalogue.leg_kinds import paper_leg_mesh
from pneumorph.catalogue.masses import PRINTED_HUB, cast_leg_mass_kg

LARGEST_MASS_DIFFERENCE = 0.1
"""Share by which a simulated mass may differ from the built one without a warning."""


def mass_warning(
    legs: Mapping[str, tuple[float, float]],
    hub: tuple[float, float],
    file: str | None = None,
    hollow: bool = False,
) -> str | None:
    """Say where built and simulated masses differ by more than a tenth, and what makes them agree.

    Args:
        legs: Mass of each kind of leg as it is built and in the simulation [g], by its name.
        hub: That of the hub.
        file: The robot's file; None for the paper's robot.
        hollow: Whether its hub has walls.
    """
    pairs = {f"leg {name}".rstrip(): pair for name, pair in legs.items()}
    pairs["hub"] = hub
    apart = {name: pair for name, pair in pairs.items() if _differ(*pair)}
    if not apart:
        return None
    masses = "; ".join(
        f"{name}: {built:.1f} g as built, {simulated:.1f} g in the simulation "
        f"({100.0 * (simulated / built - 1.0):+.0f} %)"
        for name, (built, simulated) in apart.items()
    )
    told = f"masses differ: {masses}; distances depend on them: "
    if file is not None:
        said = [
            f"mass_kg = {1e-3 * built:.4g} under [hub] (in place of a density)"
            if name == "hub"
            else f"mass_g = {built:.4g} under [modules.{name.removeprefix('leg ')}]"
            for name, (built, _) in apart.items()
        ]
        heavy = "hub" in apart and hub[0] > hub[1]
        thinner = "make its walls thinner" if hollow else "make the hub hollow"
        lighter = f", or {thinner} (wall_mm, with its density)" if heavy else ""
        return f"{told}simulate and learn with {', '.join(said)} of {file}{lighter}"
    usual = {"leg": 1e3 * cast_leg_mass_kg(paper_leg_mesh()), "hub": 1e3 * PRINTED_HUB.mass_kg}
    if not any(_differ(built, usual[name]) for name, (built, _) in pairs.items()):
        return f"{told}simulate and learn with --masses.model cast"
    flags = " ".join(f"--masses.{name}-mass-g {built:.1f}" for name, (built, _) in apart.items())
    return f"{told}simulate and learn with {flags}"


def _differ(built: float, simulated: float) -> bool:
    return abs(simulated / built - 1.0) > LARGEST_MASS_DIFFERENCE
