"""Figures at print size: text can be read and is not cut off, colours are told apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.leg_kinds import paper_leg_mesh
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.hardware.deployment_log import LoggedPressures
from pneumorph.physics.ground import Ground, Steps
from pneumorph.physics.open_loop_gait import sample_commands
from pneumorph.physics.regulators import RateLimited
from pneumorph.report.frames_figure import frames_figure
from pneumorph.report.ground_surface import ground_surface
from pneumorph.report.learning_figures import phase_figure, reward_figure
from pneumorph.report.mesh_figure import mesh_figure
from pneumorph.report.pairs_figure import Pair, pairs_figure
from pneumorph.report.plan import paper_plan
from pneumorph.report.plan_view import plan_view_figure
from pneumorph.report.reduction_figures import bend_figure, stage_figure, tolerance_figure
from pneumorph.report.robustness_figures import robustness_figure
from pneumorph.report.scene import Actor
from pneumorph.report.style import (
    REGULATOR_COLOURS,
    figure_style,
    region_colours,
    save_figure,
)
from pneumorph.report.trial_figures import air_fit_figure
from pneumorph.report.walk_figures import (
    cycle_figure,
    distance_figure,
    path_figure,
    pressure_figure,
    step_figure,
)
from pneumorph.robot.design import Design
from pneumorph.simulation.rollout import rollout
from pneumorph.study.reduction_grid import GridPoint
from pneumorph.study.robustness import robustness
from pneumorph.study.training_result import LearnedPair
from pneumorph.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESIGN = Design.parse("1.0.0.2.2.0.0.1")
TEXT_WIDTH_INCH = 7.16
"""Two columns of an IEEE page; a wider figure would be scaled down."""
SMALLEST_POINTS = 6.0
"""The smallest type that journals accept."""


@pytest.fixture(scope="module")
def walked() -> Trajectory:
    """A cycle of the expert's gait by the reduced robot that ships."""
    commands = sample_commands(ExpertGait(phase_deg=60), 0.01, 400)
    robot = paper_robot("published").reduced(DESIGN)
    return rollout(robot, np.asarray(commands), record_every=20, settling_steps=15)[1]


def grid() -> list[GridPoint]:
    """Nine reductions, the robots of the first of which diverged."""
    found = []
    for mode in (0.01, 0.0032, 0.001):
        for element in (0.01, 0.0032, 0.001):
            found.append(
                GridPoint(
                    part=f"{mode}_{element}/leg.npz",
                    mode_tolerance=mode,
                    hyperreduction_tolerance=element,
                    mode_count=round(5 / mode**0.3),
                    element_count=round(20 / element**0.4),
                    mean_node_error_mm=100 * mode + 10 * element if found else float("nan"),
                    s_per_step=1e-5 / mode**0.4,
                )
            )
    return found


def metrics() -> list[dict[str, Any]]:
    return [
        {
            "timestep": 100 * n,
            "best_distance_cm": float(n),
            "return_mean_cm": 0.5 * n,
            "score_histogram": [0.25, 0.75],
        }
        for n in (1, 2, 3)
    ]


PAIRS = [LearnedPair(str(DESIGN), 3.0 - 0.4 * n, "policy", 100 * n) for n in range(3)]
WORLDS = robustness(
    ["L1", "L2"],
    np.array([2.5, 2.5]),
    np.array([[2.0 + 0.1 * n, np.nan if n == 2 else 1.0] for n in range(4)]),
)

LOG = LoggedPressures(
    np.arange(4.0), np.array([[0.0, 0.0], [80.0, 0.0], [80.0, 40.0], [0.0, 0.0]]),
    np.array([[0.0, 0.1], [0.2, 0.0], [78.0, 0.0], [79.0, 40.0]]), (),
)  # fmt: skip

FIGURES: dict[str, Callable[[Trajectory], Figure]] = {
    "air fit": lambda _: air_fit_figure(LOG, LOG.sensed_kPa + 1.0, 1.0),
    "bend": lambda _: bend_figure([0, 100], [0, 30], [0, 31]),
    "cycle": cycle_figure,
    "distance": lambda t: distance_figure({"learned": t, "expert": t}),
    "frames": lambda t: frames_figure([Actor.of(t, "expert")] * 2, [0.0, 2.0, 4.0], 160),
    "mesh": lambda _: mesh_figure(paper_leg_mesh()),
    "pairs": lambda _: pairs_figure(
        [Pair(f"L{n}", DESIGN, ExpertGait(phase_deg=20 * n), 3.0) for n in range(1, 6)],
        lambda _: RateLimited(150.0),
    ),
    "path": lambda t: path_figure({"a": t, "b": t}),
    "phase": lambda _: phase_figure([0, 90, 180], [0.5, 2.0, 1.0], 6.0),
    "plan view": lambda _: plan_view_figure(paper_plan(DESIGN), str(DESIGN)),
    "pressure": lambda t: pressure_figure(t, 2),
    "reward": lambda _: reward_figure(metrics(), [-1.0, 0.0, 4.0], 1.5, 3.0, PAIRS),
    "robustness": lambda _: robustness_figure(WORLDS),
    "stage": lambda _: stage_figure({"assembly": 1.5, "contact_setup": 0.25}),
    "step": lambda t: step_figure(dict.fromkeys(("learned", "expert"), (t.time_s, t.forward_cm))),
    "tolerance": lambda _: tolerance_figure(grid(), (0.0032, 0.001)),
}


@pytest.mark.parametrize("name", FIGURES)
def test_text_is_large_enough_and_inside(name: str, walked: Trajectory, tmp_path: Path) -> None:
    """At the width of a page, of every text that is drawn."""
    figure = FIGURES[name](walked)
    png, pdf = save_figure(figure, tmp_path / "figure")
    assert png.stat().st_size > 2000
    assert b"/FontFile2" in pdf.read_bytes()  # TrueType, so that text stays text
    with figure_style():
        figure.draw_without_rendering()
    scale = min(1.0, TEXT_WIDTH_INCH / figure.get_figwidth())
    canvas = figure.bbox
    for text in _texts(figure):
        assert text.get_fontsize() * scale >= SMALLEST_POINTS, text.get_text()
        box = text.get_window_extent()
        # Half a pixel for the rounding of glyphs to pixels.
        inside = canvas.x0 - 0.5 <= box.x0 and box.x1 <= canvas.x1 + 0.5
        inside &= canvas.y0 - 0.5 <= box.y0 and box.y1 <= canvas.y1 + 0.5
        assert inside, f"{text.get_text()!r} of {name} is cut off"


def _texts(figure: Figure) -> list[Any]:
    from matplotlib.axis import Axis
    from matplotlib.text import Text

    # Labels of ticks beyond an axis' limits exist but are not drawn.
    drawn = []
    for axis in figure.findobj(Axis):
        low, high = sorted(axis.get_view_interval())
        for tick in axis.get_major_ticks():
            if not low <= tick.get_loc() <= high:
                drawn += [tick.label1, tick.label2]
    hidden = {id(text) for text in drawn}
    off = {id(t) for axes in figure.axes if not axes.axison for t in axes.findobj(Text)
           if t not in axes.texts and t is not axes.title}  # fmt: skip
    return [
        text
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and id(text) not in hidden | off
    ]


# Brettel-type matrices of Vienot, Brettel and Mollon (1999) for linear RGB.
_PROTAN = np.array([[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]])
_DEUTAN = np.array([[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]])


@pytest.mark.parametrize("seen", [np.eye(3), _PROTAN, _DEUTAN], ids=["all", "protan", "deutan"])
def test_regulators_are_told_apart_with_colour_blindness(seen: np.ndarray) -> None:
    """By CIELAB distance: 2.3 is a just noticeable difference, a tenfold is told at a glance."""
    from matplotlib.colors import to_rgb

    linear = np.array([to_rgb(colour) for colour in REGULATOR_COLOURS[:3]])
    linear = np.where(linear <= 0.04045, linear / 12.92, ((linear + 0.055) / 1.055) ** 2.4)
    lab = _cielab(np.clip(linear @ seen.T, 0.0, 1.0))
    for first in range(3):
        for second in range(first):
            assert np.linalg.norm(lab[first] - lab[second]) > 23.0


def test_each_of_many_regions_has_a_colour_of_its_own() -> None:
    """Ten, as of a robot's hub with its sites; also where there are more than colours by name."""
    from matplotlib.colors import to_hex
    from matplotlib.patches import Patch

    leg = paper_leg_mesh()
    regions = {f"cavity {number}": leg.surfaces["cavity"] for number in range(10)}
    (legend,) = mesh_figure(replace(leg, surfaces=regions)).legends
    keys = [key for key in legend.legend_handles if isinstance(key, Patch)]
    drawn = [to_hex(key.get_facecolor()) for key in keys]
    assert drawn == [each.lower() for each in region_colours(10)]
    assert region_colours(6) == list(REGULATOR_COLOURS)
    assert len(set(region_colours(24))) == 24
    # No two are nearer than some that regulators have always had.
    ten, six = (
        min(np.linalg.norm(one - other) for one, other in combinations(_lab_of(colours), 2))
        for colours in (drawn, REGULATOR_COLOURS)
    )
    assert ten == pytest.approx(six)


def _lab_of(colours: Sequence[str]) -> np.ndarray:
    """CIE 1976 L*a*b* of colours, (colour, 3)."""
    from matplotlib.colors import to_rgb

    linear = np.array([to_rgb(colour) for colour in colours])
    return _cielab(np.where(linear <= 0.04045, linear / 12.92, ((linear + 0.055) / 1.055) ** 2.4))


def _cielab(linear: np.ndarray) -> np.ndarray:
    """CIE 1976 L*a*b* under D65 of linear sRGB, (colour, 3)."""
    to_xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    ratio = linear @ to_xyz.T / np.array([0.9505, 1.0, 1.089])
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], 1)


def test_steps_add_up_to_the_distance_and_slides_are_below_zero(walked: Trajectory) -> None:
    time_s, forward_cm = walked.time_s, walked.forward_cm
    axes = step_figure({"expert": (time_s, forward_cm)}).axes[0]
    heights = [bar.get_height() for bar in axes.patches]
    assert len(heights) == 4
    assert sum(heights) == pytest.approx(walked.forward_distance_cm, abs=1e-12)
    slide = np.max(np.maximum.accumulate(forward_cm) - forward_cm)
    assert axes.lines[0].get_ydata() == pytest.approx([-slide, -slide])
    with pytest.raises(ValueError, match="expected at least one period of 9 s"):
        step_figure({"expert": (time_s, forward_cm)}, cycle_s=9.0)


def test_tilt_of_known_rotations(walked: Trajectory) -> None:
    roll, pitch, yaw = np.radians([20.0, 10.0, 70.0])
    about_x = np.array(
        [[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]]
    )
    about_y = np.array(
        [[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]]
    )
    about_z = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    turned = np.array(walked.hub_rotation)
    turned[:2] = about_z @ about_x, about_z @ about_y
    rolled, pitched = replace(walked, hub_rotation=turned).tilt_deg
    assert rolled[:2] == pytest.approx([20.0, 0.0], abs=1e-12)
    assert pitched[:2] == pytest.approx([0.0, 10.0], abs=1e-12)


def test_the_cycle_shows_what_the_floor_bears(walked: Trajectory) -> None:
    """Four panels and the load; together the legs bear what the contact forces say."""
    figure = cycle_figure(walked)
    assert len(figure.axes) == 5
    loads = np.sum([line.get_ydata() for line in figure.axes[3].lines], axis=0)
    assert walked.contact_force_mN is not None
    # Sums of tens of numbers in single precision, in another order.
    borne = walked.contact_force_mN[..., 2].sum(axis=(1, 2)) / 1e3
    np.testing.assert_allclose(loads, borne, rtol=1e-5)
    with pytest.raises(ValueError, match="expected at least one period of 9 s"):
        cycle_figure(walked, 9.0)


def test_the_cycle_shows_what_counts(walked: Trajectory) -> None:
    """Backward is the other way."""
    forward, backward = (
        cycle_figure(walked, goal=goal).axes[-1].lines[0].get_ydata()
        for goal in (FORWARD, Goal("heading", 180.0))
    )
    np.testing.assert_allclose(backward, -np.asarray(forward), atol=1e-9)
    assert np.abs(forward).max() > 1e-3
    for goal, said in (
        (FORWARD, "travel (cm)"),
        (Goal("heading", 180.0), "travel (cm)"),
        (Goal("turn_right"), "turn (°)"),
    ):
        assert cycle_figure(walked, goal=goal).axes[-1].get_ylabel() == said


def test_heights_of_legs_are_over_the_ground(walked: Trajectory) -> None:
    """A walk that is laid over a hill has the heights that it has on a plane, to the single
    precision of nodes some 100 mm high."""
    ground = Ground(steps=Steps(rise_mm=60.0, start_mm=-400.0, run_mm=800.0))
    assert walked.node_positions_mm is not None
    nodes = walked.node_positions_mm.astype(float)
    nodes[..., 2] += 5.0 + ground.grid().height(nodes[..., 0], nodes[..., 1])
    base_mm = 5.0 + walked.metadata["settings"]["floor_height_mm"]
    told = {"ground_base_mm": base_mm, "settings": {"ground": settings_to_dict(ground)}}
    hill = replace(
        walked,
        node_positions_mm=nodes.astype(np.float32),
        metadata={**walked.metadata, **told},
    )
    for mine, flat in zip(
        cycle_figure(hill).axes[2].lines, cycle_figure(walked).axes[2].lines, strict=True
    ):
        np.testing.assert_allclose(mine.get_ydata(), flat.get_ydata(), atol=1e-4)
    assert cycle_figure(hill).axes[2].get_ylabel() == "lowest node\nover floor (mm)"
    # Around a robot that has come to its end, and further around one that is still to go.
    done, going = ground_surface(hill), ground_surface(replace(hill, status="running"))
    assert done is not None
    assert going is not None
    way = hill.tracked_point_mm[:, 0]
    assert way.max() + 800.0 <= going.x_mm[-1] < way.max() + 850.0
    assert way.max() + 250.0 <= done.x_mm[-1] < way.max() + 300.0


def test_heights_of_legs_begin_at_the_floor_and_not_at_a_leg_that_sags(walked: Trajectory) -> None:
    """What one leg does changes no height of another."""
    assert walked.node_positions_mm is not None
    nodes = np.array(walked.node_positions_mm)
    nodes[:, 0, :, 2] -= 2.0
    sagging = cycle_figure(replace(walked, node_positions_mm=nodes)).axes[2]
    before = cycle_figure(walked).axes[2]
    floor_mm = walked.metadata["settings"]["floor_height_mm"]
    for leg in range(1, nodes.shape[1]):
        drawn = np.asarray(sagging.lines[leg].get_ydata())
        np.testing.assert_array_equal(drawn, before.lines[leg].get_ydata())
        lowest = nodes[-len(drawn) :, leg, :, 2].astype(float).min(axis=1) - floor_mm
        np.testing.assert_allclose(drawn, lowest, rtol=0, atol=1e-12)
    assert sagging.get_ylabel() == "lowest node\nover floor (mm)"
    # A floor that was given as a function is not known to a file.
    untold = replace(walked, metadata={**walked.metadata, "ground_base_mm": 0.0})
    assert cycle_figure(untold).axes[2].get_ylabel() == "lowest node\nover all (mm)"


def test_tolerances_stand_where_they_were_measured() -> None:
    figure = tolerance_figure(grid(), (0.0032, 0.001))
    axes = figure.axes[0]
    ring = [line for line in axes.lines if line.get_fillstyle() == "none"]
    assert len(ring) == 1
    assert ring[0].get_xydata()[0] == pytest.approx([1e3 * 1e-5 / 0.0032**0.4, 0.33])
    points = [line for line in axes.lines if len(line.get_xdata()) == 1]
    assert len(points) == 8 + 1  # one reduction diverged; the ring
    with pytest.raises(ValueError, match="none of the 1 reductions"):
        tolerance_figure(grid()[:1])


def test_smoothed_pressures_follow_at_the_limited_rate() -> None:
    gait = ExpertGait(phase_deg=0.0)
    figure = pairs_figure([Pair("L1", DESIGN, gait, None)], lambda _: RateLimited(10.0))
    commanded, smoothed = figure.axes[1].lines
    step_s = commanded.get_xdata()[1] - commanded.get_xdata()[0]
    rise = np.diff(smoothed.get_ydata()) / step_s
    assert np.abs(rise).max() == pytest.approx(10.0)
    assert np.abs(np.diff(commanded.get_ydata()) / step_s).max() > 20.0
    with pytest.raises(ValueError, match="pairs is empty"):
        pairs_figure([], lambda _: RateLimited(150.0))


@pytest.mark.parametrize(("highest_kPa", "top"), [(90.0, 90.0), (40.0, 90.0), (126.0, 126.0)])
def test_pressures_of_every_gait_are_inside_their_panels(highest_kPa: float, top: float) -> None:
    """All panels alike; a regulator that no leg has does not count."""
    held = np.array([[0.0, highest_kPa, 140.0], [highest_kPa, 0.0, 0.0]])
    gait = HeldGait(np.arange(2.0), held, 2.0, maximum_pressure_kPa=150.0)
    pairs = [Pair("L1", DESIGN, ExpertGait(), None), Pair("L2", DESIGN, gait, None)]
    figure = pairs_figure(pairs, lambda _: RateLimited(1000.0))
    for axes in figure.axes:
        for line in axes.lines:
            assert line.get_ydata().max() <= top
            assert axes.get_ylim() == pytest.approx((-4.0 * top / 90.0, top * (1.0 + 4.0 / 90.0)))
            assert axes.get_ylim()[1] > axes.get_yticks()[-1] > 0.9 * top
