"""Robots are mirrored only where a module's left is like its right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pneumorph.catalogue.mirror_check import check_mirror, unlike_sides_note
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.space_check import check_space
from pneumorph.environment.equal_designs import check_equal_designs
from pneumorph.environment.goal import Goal
from pneumorph.robot.design_space import DesignSpace

EXAMPLES = Path(__file__).parents[2] / "examples"
TWIN = RobotDescription.read(EXAMPLES / "two_chambers.toml").spec().modules[0]


def changed(module: Any, **changes: Any) -> Any:
    part = replace(module.reduced, **changes)
    return cast(Any, SimpleNamespace(reduced=part, face=module.face, name="changed"))


def test_legs_that_ship_are_their_own_mirror_images() -> None:
    check_mirror(TWIN, apart=True)
    for leg in ("published", "hyperelastic", "measured"):
        check_mirror(paper_robot(leg).module, apart=True)


def test_a_leg_of_a_mesh_that_is_not_its_own_image_is_told_of() -> None:
    """Its modes are neither symmetric nor antisymmetric; legs that ship are."""
    report = {**TWIN.reduced.metadata["report"], "symmetric_mode_count": 0}
    apart = changed(TWIN, metadata={**TWIN.reduced.metadata, "report": report})
    note = unlike_sides_note([TWIN, apart])
    assert str(note).startswith("the modes of changed do not treat left and right alike (reduced")
    unsaid = changed(TWIN, metadata={})
    known = [paper_robot(leg).module for leg in ("published", "hyperelastic", "measured")]
    assert unlike_sides_note([TWIN, unsaid, *known]) is None


def test_unlike_chambers_are_refused() -> None:
    left, right = TWIN.reduced.cavity_volume
    wider = changed(TWIN, cavity_volume=np.array([left, 1.1 * right]))
    with pytest.raises(ValueError, match=r"changed is not its own.*mirror = false"):
        check_mirror(wider, apart=True)
    check_mirror(wider, apart=False)  # one regulator drives both


def test_equal_chambers_one_behind_the_other_are_refused() -> None:
    """The image of a robot drives them in the other order, and each is its own image."""
    first, last = TWIN.reduced.cavity_volume_1
    both, apart = 0.5 * (first + last), 0.5 * (first - last)
    symmetric = np.abs(apart) < 1e-3 * np.abs(apart).max()
    assert 4 < symmetric.sum() < len(both)
    behind = np.where(symmetric & (np.arange(len(both)) % 2 == 0), both, 0.0)
    fore_and_aft = changed(TWIN, cavity_volume_1=np.array([both + behind, both - behind]))
    with pytest.raises(ValueError, match="cavity 1 of changed changes places with cavity 2, and "):
        check_mirror(fore_and_aft, apart=True)
    check_mirror(fore_and_aft, apart=False)


@pytest.mark.parametrize(
    "deform",
    [
        lambda nodes: nodes + np.where(nodes > 10.0, 1.0, 0.0) * [0.0, 1.0, 0.0],  # one side wider
        lambda nodes: nodes + np.array([0.0, 3.0, 0.0]),  # attached aside
    ],
)
def test_a_leg_that_lies_aside_is_refused(deform: Any) -> None:
    module = paper_robot("measured").module
    leaning = changed(module, rest_nodes=deform(module.reduced.rest_nodes))
    with pytest.raises(ValueError, match="changed is not its own: it lies"):
        check_mirror(leaning, apart=False)


def test_robots_are_mirrored_only_where_their_modules_are() -> None:
    """They walk; what is learned of them does not hold for their images."""
    spec = RobotDescription.read(EXAMPLES / "two_chambers.toml")
    left, right = TWIN.reduced.cavity_volume
    part = replace(TWIN.reduced, cavity_volume=np.array([left, 1.1 * right]))
    unlike = replace(TWIN, make_reduced=lambda: part)
    robot = spec.spec()
    robot = replace(robot, sites=tuple(site.with_modules(lambda _: unlike) for site in robot.sites))
    robot.assembly(spec.usual_design)
    with pytest.raises(ValueError, match="the designs have mirror images, and twin is not its own"):
        check_space(robot, spec.space)
    check_space(robot, replace(spec.space, mirror="none"))


@pytest.mark.parametrize(
    ("symmetry", "goal", "refused"),
    [
        ("mirror", Goal(), False),
        ("mirror", Goal("heading", 180.0), False),
        ("mirror", Goal("heading", 90.0), True),
        ("mirror", Goal("turn_right"), True),
        ("1 2 3 0", Goal("turn_left"), False),
        ("1 2 3 0", Goal(), True),
        ("1 2 3 0", Goal("heading", 90.0), True),
    ],
)
def test_designs_are_one_only_where_the_goal_is(symmetry: str, goal: Goal, refused: bool) -> None:
    space = DesignSpace(location_count=4, maximum_legs=4, symmetries=(symmetry,))
    if not refused:
        check_equal_designs(space, goal)
        return
    with pytest.raises(ValueError, match=rf"count as one, and the goal '{goal.name}' tells them"):
        check_equal_designs(space, goal)
