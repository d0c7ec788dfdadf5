"""The paper's robot learns to cross rough ground, in a training of a minute's hundredth."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.base.settings import settings_from_dict
from pneumorph.cli import run
from pneumorph.physics.ground import Ground, RoughGround, Steps
from pneumorph.report.frame_painter import FramePainter
from pneumorph.report.ground_surface import SPACING_MM
from pneumorph.report.replay.replay_data import replay_data
from pneumorph.report.scene import Actor
from pneumorph.trajectory import Trajectory

SETTINGS = Path(__file__).parent.parent.parent / "examples" / "rough_ground.toml"
SMALL = (
    "--restarts 1 "
    "--total-timesteps 24 --environment-count 4 --task.action-count 3 --task.action-step-count 10 "
    "--learning-start-timestep 8 --updates 1 --sac.batch-size 8 --sac.hidden-sizes 8 8 "
    "--schedule.decay-start-timestep 8 --schedule.decay-end-timestep 20 --kept-pair-count 1 "
    "--evaluated-design-count 1 --finetuning.timesteps 0 --objective.worlds-per-design 1 "
    "--baseline.phase-step-deg 180 --baseline.gait.duration-s 4 "
    "--objective.kind mean"
)


def test_a_training_on_rough_ground_ends_with_a_walk_that_shows_it(tmp_path: Path) -> None:
    leg = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)).save(tmp_path / "leg.npz")
    out = tmp_path / "run"
    settings = tmp_path / "settings.toml"
    settings.write_text('based_on = "published"\n' + SETTINGS.read_text())  # as the leg is
    asked = f"coopt --preset fast --settings {settings} --part {leg}"
    assert run(f"{asked} --randomize --out {out} {SMALL}".split()) == 0
    settings = json.loads((out / "settings.json").read_text())
    assert settings["randomisation"]["ground_roughness_mm"] == "U(1, 5)"
    walk = Trajectory.load(out / "best_trajectory.npz")
    told = json.loads((out / "summary.json").read_text())["physics"]["ground"]
    ground = Ground(rough=RoughGround(3.0, 60.0, 1), steps=Steps(8.0, 250.0, 20.0))
    assert settings_from_dict(Ground, told) == ground
    # The picture has the ground where the robot's legs lie on it: 10 mm of slopes of 0.07 apart.
    actor = Actor.of(walk, "it")
    shown = actor.ground
    assert shown is not None
    for leg in actor.legs:
        nodes = leg.nodes[-1]
        column, row = (
            np.clip(np.rint((at - places[0]) / SPACING_MM).astype(int), 0, len(places) - 1)
            for at, places in zip(nodes.T, (shown.x_mm, shown.y_mm), strict=False)
        )
        assert abs(np.min(nodes[:, 2] - shown.height_mm[column, row])) < 1.5
    data = replay_data([actor])["robots"][0]["ground"]
    assert data["columns"] * data["rows"] == shown.height_mm.size
    level = np.asarray(FramePainter([replace(actor, trajectory=without_ground(walk))]).paint(1.0))
    assert (np.asarray(FramePainter([actor]).paint(1.0)) != level).any(axis=2).mean() > 0.3


def without_ground(walk: Trajectory) -> Trajectory:
    """A walk that says nothing of what it was on."""
    rest = {name: value for name, value in walk.metadata.items() if name != "ground_base_mm"}
    return replace(walk, metadata=rest)
