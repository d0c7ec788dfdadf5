"""What tells robots apart beside their settings and their legs, for what is resumed or kept."""

from __future__ import annotations

import hashlib
from typing import get_args

from pneumorph.catalogue.paper_leg import LegName, masses_of, pressure_map
from pneumorph.catalogue.paper_robot import paper_hub
from pneumorph.catalogue.robot_spec import RobotSpec


def resume_identity(spec: RobotSpec) -> dict[str, str]:
    """The hub's mass, the heights of a map and legs that go outwards by their own x axes, which
    `RobotSpec.reduction_digest` and `RobotSpec.settings` do not say of the paper's robot.

    Nothing of the mass that the legs' robot usually has, and of ground without a map: what earlier
    versions kept of those does not say them. A described robot's hub is in its digest.

    Raises:
        FileNotFoundError: No such map.
        ValueError: It is no grid of heights.
    """
    ground = spec.physics.ground.file_identity() | spec.turning_outwards
    if spec.name is not None or len(spec.modules) > 1:
        return ground
    numbers = spec.hub.mass_numbers()
    if numbers == _usual_numbers(spec):
        return ground
    content = hashlib.sha256(repr(numbers).encode()).hexdigest()[:12]
    return {"hub_mass": f"{1e3 * spec.hub.mass_kg:.6g} g ({content})", **ground}


def _usual_numbers(spec: RobotSpec) -> list[float]:
    """Of the hub that goes with the legs, as `paper_robot` has it."""
    own = spec.module.pressure_map
    names = [each for each in get_args(LegName) if pressure_map(each) == own]
    return paper_hub(masses_of(names[0] if names else "published")).mass_numbers()
