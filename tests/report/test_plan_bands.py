"""A leg of two chambers has each regulator's colour where that chamber is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.geometry.robot_shape import RobotShape
from pneumorph.geometry.surface import enclosed_centre
from pneumorph.report.explorer.page import _plan
from pneumorph.report.plan import paper_plan, plan_of_walk, plans_of_spec
from pneumorph.report.plan_bands import chamber_bands
from pneumorph.robot.design import Design
from pneumorph.simulation.rollout import rollout

TWO_CHAMBERS = Path(__file__).parent.parent.parent / "examples" / "two_chambers.toml"
RECTANGLE = np.array([[10.0, -4.0], [30.0, -4.0], [30.0, 4.0], [10.0, 4.0]])


def turn(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]


def middles(bands: Sequence[np.ndarray]) -> np.ndarray:
    """Of the areas, (band, 2)."""
    found = []
    for band in bands:
        after = np.roll(band, -1, axis=0)
        found.append(turn(band, after) @ (band + after) / (3.0 * turn(band, after).sum()))
    return np.array(found)


def test_parts_lie_as_the_chambers_do_and_make_up_the_whole() -> None:
    for second, side in ((-1.0, 1.0), (7.0, -1.0)):
        bands = chamber_bands(RECTANGLE, 2, np.array([[19.0, 3.0], [21.0, second]]))
        assert middles(bands) == pytest.approx(np.array([[20.0, 2.0 * side], [20.0, -2.0 * side]]))
    three = chamber_bands(RECTANGLE, 3, np.array([[25.0, 0.0], [15.0, 0.0], [19.0, 0.0]]))
    assert middles(three)[:, 0] == pytest.approx([10.0 + 50.0 / 3, 10.0 + 10.0 / 3, 20.0])


@pytest.mark.parametrize("centres", [None, np.array([[20.0, 0.0], [20.5, 0.0]])])
def test_where_chambers_are_not_known_or_one_above_the_other_the_first_is_nearest(centres) -> None:
    bands = chamber_bands(RECTANGLE - [60.0, 0.0], 2, centres)
    assert middles(bands)[:, 0] == pytest.approx([-35.0, -45.0])


def test_the_middle_of_a_volume_is_where_it_is_by_closed_form() -> None:
    """A tetrahedron's is the mean of its corners, wherever it stands, and whichever way normals
    point."""
    corners = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    away = np.array([5.0, -7.0, 11.0])
    for each in (faces, faces[:, ::-1]):
        middle = enclosed_centre(corners + away, each)
        assert middle == pytest.approx(corners.mean(axis=0) + away, abs=1e-12)


def test_a_design_and_its_walk_are_coloured_alike() -> None:
    """Front leg rolled by its design, chambers to its left and right; also for the explorer."""
    description = RobotDescription.read(TWO_CHAMBERS)
    spec = description.spec()
    design = Design.parse("0.1+2.0.1+1.0.2+2.0.1+2")
    plan = plans_of_spec(spec)(design)
    for leg, (outline, regulators) in enumerate(zip(plan.legs_mm, plan.regulators, strict=True)):
        parts = plan.coloured(leg)
        assert [regulator for _, regulator in parts] == list(regulators)
        if len(regulators) == 1:
            continue
        first, second = middles([band for band, _ in parts])
        (middle,) = middles([outline])
        out = middle / np.linalg.norm(middle)
        # The first is to the left of the way out, seen from above, and not much nearer or further.
        assert turn(out, first - second) > 2.0
        assert abs(out @ (first - second)) < 0.3 * turn(out, first - second)
    _, walked = rollout(spec.reduced(design), np.zeros((5, 4)))
    seen = plan_of_walk(walked)
    assert seen.regulators == plan.regulators
    for ours, theirs in zip(seen.bands_mm, plan.bands_mm, strict=True):
        # The skin alone was recorded, settled for as long as a gait begins.
        assert middles(ours) == pytest.approx(middles(theirs), abs=6.0)
    drawn = _plan(description.space, plans_of_spec(spec))["legs"][1]
    assert all(len(each["bands"]) == 2 for each in drawn.values())


def test_one_regulator_of_both_chambers_is_one_colour_in_both_models() -> None:
    spec = RobotDescription.read(TWO_CHAMBERS).spec()
    design = Design.parse("0.1.0.1.0.2.0.1")
    full, _ = spec.full(design).shape
    for shape in (full, spec.assembly(design).shape[0]):
        for leg in range(4):
            centres = shape.cavities_of(leg)
            assert centres is not None
            assert centres.shape == (2, 3)
    assert full.leg_cavity_mm == pytest.approx(spec.assembly(design).shape[0].leg_cavity_mm)
    _, walked = rollout(spec.reduced(design), np.zeros((5, 4)))
    for plan in (plans_of_spec(spec)(design), plan_of_walk(walked)):
        for leg, outline in enumerate(plan.legs_mm):
            ((band, regulator),) = plan.coloured(leg)
            assert np.array_equal(band, outline)
            assert regulator == (1, 1, 2, 1)[leg]
        assert plan.entries == ("1", "1", "2", "1")


def test_recordings_of_before_say_nothing_of_chambers() -> None:
    shape, _ = RobotDescription.read(TWO_CHAMBERS).spec().assembly("0.1+2.0.1.0.2.0.1").shape
    arrays = {name: each for name, each in shape.arrays().items() if "leg_cavity" not in name}
    before = RobotShape.taken_from(arrays)
    assert before is not None
    assert before.cavities_of(0) is None
    now = RobotShape.taken_from(shape.arrays())
    assert now is not None
    assert np.array_equal(now.cavities_of(0), shape.cavities_of(0))


def test_chambers_of_another_number_of_centres_follow_each_other_outwards() -> None:
    known = np.array([[20.0, 3.0], [20.0, -3.0]])
    assert middles(chamber_bands(RECTANGLE, 4, known))[:, 0] == pytest.approx(
        [12.5, 17.5, 22.5, 27.5]
    )


def test_the_papers_legs_are_of_one_colour() -> None:
    plan = paper_plan(Design.parse("1.0.0.2.2.0.0.1"))
    for leg, outline in enumerate(plan.legs_mm):
        ((band, _),) = plan.coloured(leg)
        assert np.array_equal(band, outline)
