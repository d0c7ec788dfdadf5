"""Where a simulation beside trials is of another robot than was deployed, its flags are told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers.run_folders import write_run
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.base.layers import layered
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.study.deployed_otherwise import deployed_otherwise

PLATE = Path(__file__).parent.parent.parent / "examples" / "plate.toml"
PUBLISHED, HEAVY = {"based_on": "published"}, {"masses": {"hub_mass_g": 40.0}}


def _robot(*layers: dict[str, Any]) -> RobotOptions:
    return layered(RobotOptions(), list(layers))


def _told(tmp_path: Path, deployed: RobotOptions, simulated: RobotOptions) -> list[str]:
    folder = write_run(tmp_path / "B", "deploy", {"robot": settings_to_dict(deployed)})
    return [note.replace(str(folder), "B") for note in deployed_otherwise(folder, simulated)]


def _other(physics: str) -> str:
    return "measured" if physics == "published" else "published"


def _flags(*flags: str) -> str:
    return (
        f"B was deployed with {' '.join(flags)} and is simulated otherwise; these flags simulate "
        "it as deployed"
    )


@pytest.mark.parametrize(
    ("deployed", "simulated", "flags"),
    [
        ([], [], None),
        ([HEAVY], [HEAVY], None),
        ([HEAVY], [], "--masses.hub-mass-g 40.0"),
        ([], [HEAVY], "no --masses.hub-mass-g"),
        ([{"leg": "hyperelastic"}], [PUBLISHED], "--leg hyperelastic"),
        ([PUBLISHED], [{"leg": "hyperelastic"}], "--leg published"),
        # Numbers of the physics may be its virtual rig's.
        ([{"physics": {"friction": 0.3}}], [], None),
    ],
)
def test_another_leg_or_mass_is_told_with_its_flags(
    tmp_path: Path, deployed: list[Any], simulated: list[Any], flags: str | None
) -> None:
    told = _told(tmp_path, _robot(*deployed), _robot(*simulated))
    assert told == ([] if flags is None else [_flags(flags)])


@pytest.mark.parametrize(
    ("more", "flags"),
    [
        ({}, ""),
        (HEAVY, " --masses.hub-mass-g 40.0"),
        ({"leg": "hyperelastic"}, " --leg hyperelastic"),
    ],
)
def test_what_another_physics_brings_with_it_needs_no_flag(
    tmp_path: Path, more: dict[str, Any], flags: str
) -> None:
    assert _told(tmp_path, _robot({**PUBLISHED, **more}), _robot()) == [
        "B was deployed in the published physics and is simulated in the measured one; --physics "
        f"published{flags} simulates it as deployed"
    ]


def test_another_reduced_leg_is_told_by_its_content(tmp_path: Path) -> None:
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    one, copy = (part.save(tmp_path / name) for name in ("one.npz", "copy.npz"))
    other = synthetic_reduced_part(mode_count=3, cells=(4, 4, 4)).save(tmp_path / "other.npz")
    plain = RobotOptions.of("published")
    deployed = replace(plain, part=one)
    copy.write_bytes(one.read_bytes())
    assert _told(tmp_path, deployed, replace(plain, part=copy)) == []
    for simulated in (plain, replace(plain, part=other)):
        assert _told(tmp_path, deployed, simulated) == [_flags(f"--part {one}")]
    assert _told(tmp_path, plain, deployed) == [_flags("no --part")]


def test_a_described_robot_is_told_by_its_file(tmp_path: Path) -> None:
    plate = _robot({"described": str(PLATE)})
    assert _told(tmp_path, plate, plate) == []
    like = _robot({"based_on": plate.physics_name})
    assert _told(tmp_path, plate, like) == [_flags(f"--robot {PLATE}")]
    assert _told(tmp_path, like, plate) == [_flags("no --robot")]
    (told,) = _told(tmp_path, plate, _robot({"based_on": _other(plate.physics_name)}))
    assert told.endswith(f"one; --robot {PLATE} simulates it as deployed")
    edited = replace(plate, file_text=f"{plate.file_text}\n# since")
    assert _told(tmp_path, plate, edited) == [_flags(f"--robot {PLATE} (as it was then)")]
    assert deployed_otherwise(tmp_path / "nothing", plate) == []
