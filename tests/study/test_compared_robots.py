"""What a comparison cannot animate is refused before its first walk."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.study.comparison import ComparisonSettings, compare

PLATE = Path(__file__).parent.parent.parent / "examples" / "plate.toml"


def test_robots_of_other_sites_or_several_kinds_are_refused_at_once(tmp_path: Path) -> None:
    spec = RobotDescription.read(PLATE).spec()
    long = spec.modules[0]
    alike = replace(spec, sites=tuple(site.with_modules(lambda _: long) for site in spec.sites))
    of_eight = RobotDescription.read(PLATE.with_name("large_plate.toml")).spec()
    settings = ComparisonSettings(animations=("two_leg",), heldout_count=0)
    for robot, why in (
        (spec, "the robot has 6 sites, expected 8: the animations"),
        (of_eight, "modules .* expected one kind"),
        (alike, "the robot has 6 sites, expected 8: the animations"),
    ):
        with pytest.raises(ValueError, match=why):
            compare(settings, robot, RunFolder(tmp_path / "compare", "compare"))
        assert not list(tmp_path.rglob("*.npz"))
