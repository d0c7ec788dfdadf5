"""What a hub's points lie on decides how it slides, so robots of other surfaces are others."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_identity import full_identity, reduction_digest
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import FORWARD
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import World
from pneumorph.study.kept_walks import walks_identity

PLATE = Path(__file__).parents[2] / "examples" / "plate.toml"
DENSITY = "density_g_per_ml = 0.6"
Edited = Callable[[str, str], Path]


@pytest.fixture(scope="module")
def plate() -> RobotSpec:
    return RobotDescription.read(PLATE).spec()


def identities(spec: RobotSpec) -> tuple[str, str, str]:
    """By which reduced robots, their kept walks, and full-order robots are found again."""
    kept = walks_identity(
        spec,
        [Design.parse("b1.0.2.2.0.b1")],
        [ExpertGait(phase_deg=60, regulator_count=4, duration_s=1.0)],
        [World.nominal(spec.physics)],
        15,
        FORWARD,
    )
    return reduction_digest(spec), kept, full_identity(spec)["robot"]


def test_hubs_of_other_surfaces_are_told_apart(plate: RobotSpec, edited: Edited) -> None:
    """Friction is another on "sheet", and so are the walks."""
    file = edited(DENSITY, f'{DENSITY}\nsurface = "sheet"')
    others = [RobotDescription.read(file).spec(), plate_on(plate, "skin"), plate_on(plate, "")]
    assert others[0].physics == plate.physics
    for of_one_kind in zip(*map(identities, [plate, *others]), strict=True):
        assert len(set(of_one_kind)) == 4


def test_the_usual_surface_is_in_no_identity_so_that_what_was_kept_is_found(
    plate: RobotSpec, edited: Edited
) -> None:
    written_out = RobotDescription.read(edited(DENSITY, f'{DENSITY}\nsurface = "hub"')).spec()
    assert identities(written_out) == identities(plate)
    # As versions without surfaces in it made it.
    content = hashlib.sha256()
    for module in plate.modules:
        content.update(module.reduced.digest().encode())
    for number in plate.hub.mass_numbers():
        content.update(repr(number).encode())
    for array in (plate.hub.tracked_point, plate.hub.contact_points):
        content.update(np.ascontiguousarray(array, dtype=float).tobytes())
    for site in plate.sites:
        for module in site.modules:
            pose = site.pose_of(module)
            content.update(pose.rotation.tobytes() + pose.translation.tobytes())
            content.update(str(plate.modules.index(module)).encode())
    assert reduction_digest(plate) == content.hexdigest()


def plate_on(plate: RobotSpec, surface: str) -> RobotSpec:
    return replace(plate, hub=replace(plate.hub, surface=surface))
