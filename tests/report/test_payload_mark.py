"""What a hub carries is recorded, told and drawn wherever the hub is: one mark for all pictures."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from test_recorded_shape import COMMANDS, DESIGN, SPEC

from pneumorph.base.artefact import ArtefactError
from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.catalogue.robot_identity import full_identity, reduction_digest
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.geometry.simple_solids import box_solid
from pneumorph.geometry.surface import boundary_triangles
from pneumorph.report.explorer.page import explorer_data, write_explorer
from pneumorph.report.explorer.scored_designs import ScoredDesigns
from pneumorph.report.frame_painter import FilmSettings, FramePainter
from pneumorph.report.payload_mark import PayloadMark, payload_mark
from pneumorph.report.plan import plan_of_walk, plans_of_spec
from pneumorph.report.plan_view import plan_view_figure
from pneumorph.report.replay.page import write_replay
from pneumorph.report.replay.replay_data import ReplaySettings, live_data, replay_data
from pneumorph.report.scene import Actor
from pneumorph.report.style import INK_COLOUR
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.rollout import rollout
from pneumorph.trajectory import Trajectory

PLACE = (12.0, -6.0, 40.0)
BOX = box_solid(60.0, 60.0, 10.0, 0.0)
SKIN = boundary_triangles(BOX.tetrahedra)


def carrying(payload_g: float) -> RobotSpec:
    """The robot of three boxes, whose hub carries something on a pole."""
    hub = HubDescription(
        "box", length_mm=60.0, width_mm=60.0, height_mm=10.0, bottom_mm=0.0, density_g_per_ml=1.0,
        payload_g=payload_g, payload_mm=PLACE if payload_g else None,
    )  # fmt: skip
    return replace(SPEC, hub=hub.spec(Path()))


LOADED, EMPTY = carrying(20.0), carrying(0.0)


@pytest.fixture(scope="module", params=["reduced", "full"])
def walk(request: pytest.FixtureRequest) -> Trajectory:
    robot = LOADED.reduced(DESIGN) if request.param == "reduced" else LOADED.full(DESIGN)
    return rollout(robot, COMMANDS, settling_steps=2, record_every=2)[1]  # type: ignore[arg-type]


def mark_of(place: tuple[float, float, float]) -> PayloadMark:
    mark = payload_mark(np.array(place), BOX.nodes, SKIN)
    assert mark is not None
    return mark


def test_the_mark_is_a_closed_ball_at_the_place_and_a_line_from_the_hub() -> None:
    mark = mark_of(PLACE)
    np.testing.assert_allclose(mark.foot_mm, [12.0, -6.0, 10.0], atol=1e-9)
    ball = mark.corners_mm[-128:]
    np.testing.assert_allclose(np.linalg.norm(ball - PLACE, axis=2), mark.radius_mm)
    normal = np.cross(ball[:, 1] - ball[:, 0], ball[:, 2] - ball[:, 0])
    assert (np.einsum("ti,ti->t", normal, ball.mean(axis=1) - PLACE) > 0.0).all()
    line = mark.corners_mm[:-128]
    assert line[..., 2].min() == pytest.approx(10.0)
    assert line[..., 2].max() == pytest.approx(40.0)
    outward = np.cross(line[:, 1] - line[:, 0], line[:, 2] - line[:, 0])
    away = line.mean(axis=1) - PLACE
    assert (np.einsum("ti,ti->t", outward[:, :2], away[:, :2]) > 0.0).all()


@pytest.mark.parametrize(
    ("place", "foot"),
    [
        ((80.0, 50.0, 30.0), (30.0, 30.0, 10.0)),  # a corner
        ((80.0, 5.0, 30.0), (30.0, 5.0, 10.0)),  # an edge
        ((4.0, 3.0, -20.0), (4.0, 3.0, 0.0)),  # beneath
        ((4.0, 3.0, 8.0), (4.0, 3.0, 10.0)),  # inside
    ],
)
def test_the_line_begins_where_the_hub_is_nearest(
    place: tuple[float, float, float], foot: tuple[float, float, float]
) -> None:
    np.testing.assert_allclose(mark_of(place).foot_mm, foot, atol=1e-9)


def test_a_hub_that_carries_nothing_has_no_mark_and_one_of_unknown_shape_a_ball() -> None:
    assert payload_mark(None, BOX.nodes, SKIN) is None
    mark = payload_mark(np.array(PLACE), np.zeros((0, 3)), np.zeros((0, 3), int))
    assert mark is not None
    assert len(mark.corners_mm) == 128


def test_a_recording_carries_the_place_and_one_without_payload_is_as_it_was(
    walk: Trajectory, tmp_path: Path
) -> None:
    again = Trajectory.load(walk.with_skin_only().save(tmp_path / "walk.npz"))
    assert again.shape is not None
    np.testing.assert_array_equal(again.shape.payload_mm, PLACE)
    empty = rollout(EMPTY.reduced(DESIGN), COMMANDS, settling_steps=2, record_every=2)[1]
    path = empty.save(tmp_path / "empty.npz")
    with np.load(path) as archive:
        assert "shape:payload_mm" not in archive.files
    read = Trajectory.load(path)
    assert read.shape is not None
    assert read.shape.payload_mm is None


@pytest.mark.parametrize("wrong", [[0.0, 1.0], [0.0, np.nan, 0.0]])
def test_a_place_that_is_none_is_refused(
    walk: Trajectory, wrong: list[float], tmp_path: Path
) -> None:
    path = walk.save(tmp_path / "walk.npz")
    with np.load(path) as archive:
        arrays = {each: archive[each] for each in archive.files}
    np.savez(path, **{**arrays, "shape:payload_mm": np.array(wrong)})
    with pytest.raises(ArtefactError, match=r"walk.npz cannot be read .*payload_mm"):
        Trajectory.load(path)


def test_identities_of_walks_know_no_payload_beside_the_mass() -> None:
    """What earlier versions kept is found again: mass and inertia tell robots apart, as before."""
    unsaid = replace(LOADED, hub=replace(LOADED.hub, payload=None))
    assert reduction_digest(unsaid) == reduction_digest(LOADED)
    named = [replace(each, name="carrying") for each in (unsaid, LOADED)]
    assert full_identity(named[0]) == full_identity(named[1])
    for one, other in zip(
        *(each.full(DESIGN).hub.identity() for each in (unsaid, LOADED)), strict=True
    ):
        np.testing.assert_array_equal(one, other)


def test_films_show_it_where_the_hub_takes_it(walk: Trajectory) -> None:
    actor = replace(Actor.of(walk, "a"), lane_mm=100.0)
    last = len(walk.time_s) - 1
    place = walk.hub_rotation[last] @ PLACE + walk.hub_position_mm[last] + [0.0, 100.0, 0.0]
    ball = actor.mark_corners(last)[-128:]
    np.testing.assert_allclose(ball.reshape(-1, 3).mean(axis=0), place, atol=1e-6)
    assert len(actor.mark_colours(last)) == len(actor.mark_corners(last))
    assert actor.mark is not None
    assert actor.extent_mm()[:, 2].max() >= place[2] + actor.mark.radius_mm - 1e-9
    painter = FramePainter([Actor.of(walk, "a")], FilmSettings(480), captions=False)
    assert walk.shape is not None
    bare = replace(walk, shape=replace(walk.shape, payload_mm=None))
    other = FramePainter([Actor.of(bare, "a")], FilmSettings(480), captions=False)
    dark = [np.asarray(each.paint(0.0)).max(axis=2) < 60 for each in (painter, other)]
    assert dark[0].sum() > dark[1].sum() + 20


def test_a_payload_inside_the_hub_is_seen_through_it(walk: Trajectory) -> None:
    assert walk.shape is not None
    inside = replace(walk, shape=replace(walk.shape, payload_mm=np.array([5.0, 5.0, 5.0])))
    painted = FramePainter([Actor.of(inside, "a")], FilmSettings(480), captions=False).paint(0.0)
    assert (np.asarray(painted).max(axis=2) < 60).sum() > 20


def test_replays_and_live_pages_are_told_of_it(walk: Trajectory) -> None:
    actor = Actor.of(walk, "a")
    for data in (replay_data([actor]), live_data(actor)):
        told = data["robots"][0]["payload"]
        assert told["place_mm"] == pytest.approx(list(PLACE))
        assert told["radius_mm"] > 0.0
    assert walk.shape is not None
    bare = Actor.of(replace(walk, shape=replace(walk.shape, payload_mm=None)), "a")
    assert "payload" not in replay_data([bare])["robots"][0]


def test_plans_of_walks_and_robots_have_it(walk: Trajectory) -> None:
    from_spec = plans_of_spec(LOADED)(LOADED.assembly(DESIGN).design)  # type: ignore[arg-type]
    for plan in (plan_of_walk(walk), from_spec):
        assert plan.payload is not None
        np.testing.assert_allclose(plan.payload.outline_mm.mean(axis=0), PLACE[:2], atol=1e-6)
    far = replace(from_spec, payload=mark_of((300.0, 0.0, 5.0)))
    assert far.half_width_mm > 300.0
    assert far.reach_mm > 300.0
    drawn, bare = (
        plan_view_figure(each).axes[0].patches for each in (far, replace(far, payload=None))
    )
    assert len(drawn) == len(bare) + 1


def unscored() -> ScoredDesigns:
    space = DesignSpace(location_count=3, regulator_count=2, minimum_legs=1, maximum_legs=3)
    none = np.full(len(space), np.nan)
    return ScoredDesigns(space, none, None, {}, {}, "Designs without scores.")


def test_the_explorer_is_told_of_it() -> None:
    for spec, expected in ((LOADED, 24), (EMPTY, None)):
        carried = explorer_data(unscored(), "walk", ReplaySettings(), plans_of_spec(spec))["plan"][
            "payload"
        ]
        assert (None if carried is None else len(carried["ball"])) == expected


def test_the_explorer_draws_it(tmp_path: Path, open_page: Callable[[Path | str], Any]) -> None:
    path = write_explorer(
        tmp_path / "e.html", unscored(), "Three", "walk", ReplaySettings(), plans_of_spec(LOADED)
    )
    page = open_page(path)
    page.evaluate("pneumorphExplorer.select('1.2.1')")
    ball = page.locator(".details svg polygon.payload")
    assert ball.count() == 1
    assert ball.get_attribute("fill") == INK_COLOUR


def test_replay_pages_draw_it(tmp_path: Path, open_page: Callable[[Path | str], Any]) -> None:
    """Dark pixels of the same robot at the same instant, with and without it."""
    walk = rollout(LOADED.reduced(DESIGN), COMMANDS, settling_steps=2, record_every=2)[1]
    assert walk.shape is not None
    dark = []
    for name, place in (("with", walk.shape.payload_mm), ("without", None)):
        shown = replace(walk, shape=replace(walk.shape, payload_mm=place))
        path = write_replay(tmp_path / f"{name}.html", [Actor.of(shown, "a")])
        page = open_page(path)
        page.wait_for_function("pneumorphReplay.players.length > 0")
        picture = Image.open(io.BytesIO(page.locator("canvas").first.screenshot())).convert("RGB")
        dark.append(int((np.asarray(picture).max(axis=2) < 60).sum()))
    assert dark[0] > dark[1] + 20


def test_summaries_tell_masses_and_their_centres() -> None:
    """By hand: the box weighs 36 g with its centre at (0, 0, 5), the payload 20 g."""
    alone, whole = LOADED.mass_of(), LOADED.mass_of(DESIGN)
    assert alone.hub_kg == pytest.approx(0.056)
    assert alone.payload_kg == pytest.approx(0.020)
    assert alone.payload_mm == PLACE
    centre = (36.0 * np.array([0.0, 0.0, 5.0]) + 20.0 * np.array(PLACE)) / 56.0
    assert alone.hub_centre_mm == pytest.approx(centre, abs=1e-5)
    assert alone.robot_kg is None
    assert whole.robot_kg == pytest.approx(
        LOADED.weight_mN(DESIGN) / LOADED.physics.gravity_mm_per_s2
    )
    full = LOADED.mass_of(DESIGN, reduced=False)
    assert full.robot_kg == pytest.approx(whole.robot_kg)
    assert full.robot_centre_mm == pytest.approx(whole.robot_centre_mm, abs=1e-3)
    assert "hub 36 g and on it payload 20 g at (12, -6, 40) mm, centre of mass (" in whole.words
    assert whole.words.startswith(f"{whole.robot_kg:.3g} kg, of it hub 36 g")
    assert alone.words.endswith("centre of mass (4.3, -2.1, 17.5) mm")
    assert EMPTY.mass_of().words == "hub 36 g, centre of mass (0, 0, 5) mm"
    heavier = LOADED.scaled(mass_factor=1.5).mass_of()
    assert heavier.payload_kg == pytest.approx(0.030)
    assert heavier.hub_kg == pytest.approx(0.084)
