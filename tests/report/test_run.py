"""A run's trajectories stand beside those they belong with."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.result import result_to_dict
from pneumorph.physics.air import Air
from pneumorph.physics.friction import FrictionPressure
from pneumorph.physics.physics import Physics
from pneumorph.report import page
from pneumorph.report.frames_figure import frames_figure
from pneumorph.report.run_page import _picture_sections, write_run_page
from pneumorph.report.scene import Actor
from pneumorph.report.sheet import Sheet
from pneumorph.report.walk_sections import replay_section
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.recorded_trajectories import recorded_trajectories
from pneumorph.study.simulated_walk import SimulatedWalk


def test_trajectories_are_grouped_by_what_they_are_compared_with(
    make_trajectory, tmp_path: Path
) -> None:
    for name in ("baseline_trajectory", "best_trajectory", "six_leg_full", "six_leg_reduced",
                 "trajectory_full_L1", "trajectory_full_L2"):  # fmt: skip
        make_trajectory().save(tmp_path / f"{name}.npz")
    np.savez(tmp_path / "phase_sweep.npz", a=1)  # no trajectory
    groups = recorded_trajectories(tmp_path)
    assert {group: list(robots) for group, robots in groups.items()} == {
        "": ["learned", "expert", "L1", "L2"],
        "six leg": ["full", "reduced"],
    }


def test_the_run_it_looks_at_is_read_where_it_still_is(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text(json.dumps({"baseline_best_distance_cm": 0.5}))
    (tmp_path / "settings.json").write_text("{}")
    here = FinishedRun(tmp_path, {"run": str(tmp_path)}, {})
    assert here.source is not None
    assert here.source.summary["baseline_best_distance_cm"] == 0.5
    assert FinishedRun(tmp_path, {"run": str(tmp_path / "gone")}, {}).source is None
    assert FinishedRun(tmp_path, {}, {}).source is None


def test_a_page_says_in_which_physics_its_distances_are(make_trajectory, tmp_path: Path) -> None:
    path = make_trajectory().save(tmp_path / "trajectory.npz")
    slippery = Physics(friction=0.7, friction_by_surface=(("hub", 0.3), ("sheet", 0.5)))
    walk = SimulatedWalk(
        status="completed",
        design="1.2",
        model="reduced",
        distance_cm=1.0,
        simulated_s=2.0,
        mean_contact_count=12.0,
        trajectory=str(path),
        damping="published",
        simulation_wall_s=1.0,
        wall_s=1.0,
        physics=slippery,
    )
    (tmp_path / "settings.json").write_text("{}")
    surfaces = "friction 0.7, of hub 0.3, of sheet 0.5"
    for physics, said in (
        (slippery, f"published damping, {surfaces}, pressures by 150 kPa/s."),
        (replace(slippery, air=Air("orifice")), f"{surfaces}, air through valves from 200 kPa."),
        (
            replace(slippery, floor_slope_deg=2.0, friction_pressure=FrictionPressure(-0.25)),
            f"{surfaces}, by contact pressure to the power -0.25, "
            "floor rising forward by 2 degrees, pressures",
        ),
        (None, f"Run folder {tmp_path}, published damping."),  # of an earlier version
    ):
        summary = {"verb": "simulate", **result_to_dict(replace(walk, physics=physics))}
        if physics is None:
            del summary["physics"]
        (tmp_path / "summary.json").write_text(json.dumps(summary))
        made = write_run_page(FinishedRun.read(tmp_path), tmp_path / "page.html", figure_files=())
        assert said in Path(made.page).read_text()


def figures_of(page: str) -> list[str]:
    """The figures of a page as text: they are images in base64, which hide what they say."""
    found = re.findall(r"data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)", page)
    return [base64.b64decode(each).decode() for each in found]


def test_a_robot_that_walked_has_its_distance_in_the_figures_of_a_page(
    make_trajectory, tmp_path: Path
) -> None:
    """So the figures are read where a robot has none."""
    actor = Actor.of(make_trajectory(speed_mm_per_s=64.5), "a")
    drawn = page.drawn(frames_figure([actor], [0.0, 2.0], 160), "")
    (text,) = figures_of(drawn)
    assert "+12.9 cm" in text
    for status, said in (("running", "+12.9 cm"), ("diverged", "diverged"), ("fell", "fell")):
        walk = replace(make_trajectory(speed_mm_per_s=64.5), status=status)
        assert Actor.of(walk, "a").travelled(20) == said


@pytest.mark.parametrize("highest_kPa", [60, 90, 120])
def test_a_replays_caption_says_at_which_pressure_colours_are_full(
    make_trajectory, tmp_path: Path, highest_kPa: int
) -> None:
    """At 90 kPa or the highest of the walks, as in the player, whose frames are fewer."""
    usual = make_trajectory()
    walk = replace(usual, regulated_kPa=usual.regulated_kPa * (highest_kPa / 90.0))
    section = replay_section("", {"a": usual, "b": walk}, Sheet(tmp_path, figure_files=()))
    assert f"full at {max(90, highest_kPa)} kPa" in section.body
    assert f'"full_kPa":{float(max(90, highest_kPa))}' in section.body.replace(": ", ":")


def test_a_fit_of_the_air_is_once_on_its_page(tmp_path: Path) -> None:
    """Beside what was fitted, not among the figures that no other section shows."""
    for name in ("air_fit", "path_fit", "calibration", "own"):
        (tmp_path / f"{name}.png").write_bytes(b"")
    (section,) = _picture_sections(FinishedRun(tmp_path, {}, {}))
    assert section.body.count("<img") == 1


def test_a_robot_that_diverged_has_no_distance_on_a_page(make_trajectory, tmp_path: Path) -> None:
    """Its last sound frame may be metres away: a number of the solver, not of a robot."""
    exploded = replace(make_trajectory(speed_mm_per_s=-2564.5), status="diverged")
    assert exploded.forward_distance_cm == pytest.approx(-512.9)
    assert exploded.distance_cm is None
    path = exploded.save(tmp_path / "trajectory.npz")
    found = SimulatedWalk(
        status="diverged",
        design=exploded.metadata["design"],
        model="reduced",
        distance_cm=exploded.distance_cm,
        simulated_s=2.0,
        mean_contact_count=12.0,
        trajectory=str(path),
        damping="published",
        simulation_wall_s=1.0,
        wall_s=1.0,
    )
    assert next(iter(result_to_dict(found))) == "status"
    (tmp_path / "settings.json").write_text("{}")
    for earlier in ({}, {"distance_cm": -512.9}):  # what an earlier version wrote
        summary = {"verb": "simulate", **result_to_dict(found), **earlier}
        (tmp_path / "summary.json").write_text(json.dumps(summary))
        made = write_run_page(FinishedRun.read(tmp_path), tmp_path / "page.html", figure_files=())
        text = Path(made.page).read_text()
        drawn = figures_of(text)
        assert len(drawn) == 1
        assert "512.9" not in text + drawn[0]
        assert drawn[0].count(">diverged<") == 5  # each of its stills
        assert "<h2>Robots without a distance" in text
        assert "diverged" in text
        assert "<h2>Distance and path" not in text
