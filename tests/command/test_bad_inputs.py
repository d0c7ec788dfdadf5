"""What nobody can mean is refused on the command line, in one line that names it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.run_folders import write_run

from pneumorph.base.layers import layered
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.cli import run
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.study.training_options import TrainingOptions

Refusal = Callable[[str], str]


@pytest.fixture
def refusal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Refusal:
    """Return a function that gives what a command that is refused says; it writes nothing."""

    def refuse(command: str) -> str:
        out = tmp_path / "out"
        try:
            status = run([*command.split(), "--out", str(out)])
        except SystemExit as leave:
            status = int(leave.code or 0)
        assert status in (1, 2)
        assert not out.exists()
        return " ".join(capsys.readouterr().err.replace("│", " ").split())

    return refuse


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ("--expert.duration-s 0.001", "duration_s is 0.001, expected from one time step, 0.01 s"),
        ("--physics.time-step-s 1", "time_step_s must be above 0 and at most 0.1, got 1.0"),
        ("--simulation.time-step-s 1", "time_step_s must be above 0 and at most 0.1, got 1.0"),
        ("--physics.floor-slope-deg 95", "floor_slope_deg must be above -90 and below 90"),
        ("--physics.start.lift-mm -2", "lift_mm must be at least 0, got -2"),
        ("--threads -3", "threads must be at least 0, got -3"),
        ("--stepper.contact-sweeps 99999999999", "contact_sweeps must be at most 2147483647"),
    ],
)
def test_settings_beyond_sense_are_refused(flags: str, message: str, refusal: Refusal) -> None:
    assert message in refusal(f"simulate {flags}")


def test_a_walk_of_the_sweep_too_short_for_a_step_is_refused(refusal: Refusal) -> None:
    assert "expected from one time step" in refusal(
        "baseline --gait.duration-s 0.001 --gait.period-s 0.001"
    )


def test_a_leg_of_negative_mass_is_refused_with_its_file(
    leg: Path, tmp_path: Path, refusal: Refusal
) -> None:
    part, file = ReducedPart.load(leg), tmp_path / "light.npz"
    with pytest.raises(ValueError, match="mass must be positive"):
        replace(part, mass=-part.mass)
    with pytest.raises(ValueError, match="some of the mass would be negative"):
        replace(part, second_moment=-part.second_moment)
    with pytest.raises(ValueError, match="contact_modes must be finite"):
        replace(part, contact_modes=part.contact_modes * float("nan"))
    object.__setattr__(part, "mass", -0.1)
    part.save(file)
    said = refusal(f"simulate --part {file}")
    assert f"ReducedPart file {file} cannot be read (mass must be positive" in said


@pytest.mark.parametrize("asked", ["--physics measured", "--leg measured"])
def test_a_reduced_leg_of_another_physics_is_refused(asked: str, refusal: Refusal) -> None:
    """Both are named; alone it brings its own physics, and one that relaxes goes on."""
    part = data_file("leg_published.npz")
    said = refusal(f"simulate {asked} --part {part} --masses.leg-mass-g 42")
    assert f"the reduced leg {part} is of the published physics (its law is 'corotational'" in said
    assert "the measured leg or physics was asked for" in said
    for own in ("leg_published.npz", "leg_hyperelastic.npz"):
        layered(RobotOptions(), [{"part": str(data_file(own))}]).spec()
    relaxing = {"based_on": "measured", "part": str(data_file("leg_measured.npz"))}
    layered(RobotOptions(), [relaxing]).spec()


def test_files_that_are_damaged_are_named(tmp_path: Path, refusal: Refusal) -> None:
    noise = tmp_path / "noise.csv"
    noise.write_bytes(bytes(range(128, 256)))
    assert f"gait file {noise} is not text" in refusal(f"simulate --gait {noise}")
    settings = tmp_path / "settings.toml"
    settings.write_bytes(noise.read_bytes())
    assert f"settings file {settings} is not text" in refusal(f"simulate --settings {settings}")
    for verb in ("coopt", "search"):
        settings.write_text("[physics]\nstart = 5\n")
        said = refusal(f"{verb} --settings {settings}")
        assert "robot.physics.start: expected a table of x_mm, y_mm" in said
    folder = write_run(tmp_path / "run", "coopt", TrainingOptions())
    summary = folder / "summary.json"
    summary.write_text(summary.read_text()[:-20])
    said = refusal(f"evaluate {folder}")
    assert f"summary file {summary} is not valid JSON" in said


def test_flags_that_nothing_would_look_at_are_refused(tmp_path: Path, refusal: Refusal) -> None:
    rig = tmp_path / "rig.json"
    rig.write_text(json.dumps({"driver": "serial", "resource": "/dev/nowhere"}))
    for flag in ("--virtual.seed 3", "--model reduced"):
        said = refusal(f"deploy --rig {rig} {flag}")
        assert f"{flag.split()[0]} is given, expected it with a virtual rig only" in said
        assert "'serial'" in said
    assert "--bends.repeats is given, expected it with --bend" in refusal(
        "deploy --bends.repeats 2"
    )
    gait = write_run(tmp_path / "run", "coopt", TrainingOptions()) / "training/gaits/L1.csv"
    said = refusal(f"simulate --gait {gait} --expert.phase-deg 30")
    assert f"--expert.phase-deg is given, expected it without a gait of your own ({gait})" in said
