"""The air of robots whose modules say how their chambers grow."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.layers import layered
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.leg_kinds import leg_kind
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.mean_growth import mean_growth
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.physics.air import Air

MEASURED = leg_kind("measured").physics
USUAL = MEASURED.air.chamber_growth
GROWTH = (0.1, 0.0, 1e-5)
EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A leg whose chambers grow otherwise than the paper's."""
    part = module_of_leg("measured").reduced
    report = {**part.metadata["report"], "chamber_growth": list(GROWTH)}
    part = replace(part, metadata={**part.metadata, "report": report})
    return part.save(tmp_path_factory.mktemp("own") / "own.npz")


def grown(*layers: dict) -> tuple[float, ...]:
    return layered(RobotOptions(), layers).spec().physics.air.chamber_growth


def test_a_leg_of_ones_own_brings_its_growth(own: Path, tmp_path: Path) -> None:
    """To settings, which the run keeps, and to both models; one that does not know it keeps that of
    the physics."""
    options = layered(RobotOptions(), [{"part": str(own)}])
    assert options.physics == replace(MEASURED, air=replace(MEASURED.air, chamber_growth=GROWTH))
    spec = options.spec()
    assert spec.physics == options.physics
    assert spec.full("1.0.0.2.2.0.0.1").physics == spec.physics
    shipped = module_of_leg("measured").reduced.save(tmp_path / "shipped.npz")
    assert grown({"part": str(shipped)}) == USUAL
    assert grown({"part": str(own)}, {"based_on": "measured"}) == GROWTH
    assert grown({"part": str(own)}, {"part": str(shipped)}) == USUAL


def test_growth_that_is_asked_for_stays(own: Path) -> None:
    """Also if it is the usual one; and that of a run whose settings are laid over."""
    part = {"part": str(own)}
    for asked in ((0.02,), USUAL):
        said = {"physics": {"air": {"chamber_growth": list(asked)}}}
        assert grown({**part, **said}) == asked
        assert grown(part, said) == asked
    kept = settings_to_dict(layered(RobotOptions(), [part]))
    kept["physics"]["air"]["chamber_growth"] = [0.03]
    assert grown(kept) == (0.03,)


def test_a_part_in_a_robots_file_brings_it_too(own: Path) -> None:
    """With the plate's other leg, which ships, it has the mean; unless the file says it."""
    text = (EXAMPLES / "plate.toml").read_text()
    own_part = text.replace('leg = "measured"\n\n', 'part = "own.npz"\n\n')
    path = own.parent / "plate.toml"
    path.write_text(own_part)
    described = RobotDescription.read(path)
    size = described.modules["short"].size_factor
    expected = mean_growth((1.0, size**3), (GROWTH, USUAL))
    assert described.spec().physics.air.chamber_growth == expected != GROWTH
    assert grown({"described": str(path)}) == expected
    said = 'based_on = "measured"\nair.chamber_growth = [0.02]\n'
    path.write_text(own_part.replace('based_on = "measured"\n', said))
    assert RobotDescription.read(path).spec().physics.air.chamber_growth == (0.02,)


def test_modules_that_differ_have_their_mean_by_volume() -> None:
    """Together all chambers then have the sum of their volumes, to the three digits of the mean."""
    volumes, growths = (1000.0, 3000.0), (USUAL, GROWTH)
    pressure = np.linspace(0.0, 100.0, 11)
    each = [
        Air(tube_mm3=1e-3, chamber_growth=growth).volume_mm3(pressure, volume)
        for volume, growth in zip(volumes, growths, strict=True)
    ]
    mean = Air(tube_mm3=2e-3, chamber_growth=mean_growth(volumes, growths))
    np.testing.assert_allclose(mean.volume_mm3(pressure, 4000.0), sum(each), rtol=5e-3)
    assert mean_growth((1.0, 0.3), (GROWTH, GROWTH)) == GROWTH


def test_two_chambers_grow_less_than_one_of_the_papers() -> None:
    """The catalogue's leg, which with both chambers at 100 kPa has 2.62 times the volume at rest
    where the paper's has 3.63 (equilibria of the reduced legs)."""
    air = RobotDescription.read(EXAMPLES / "two_chambers.toml").spec().physics.air
    volume = replace(air, tube_mm3=1e-3).volume_mm3(np.array(100.0), 1000.0)
    assert volume == pytest.approx(2620.0, rel=0.01)


def test_a_damaged_part_is_named_with_its_module(tmp_path: Path) -> None:
    text = (EXAMPLES / "plate.toml").read_text()
    (tmp_path / "own.npz").write_text("no part")
    path = tmp_path / "plate.toml"
    path.write_text(text.replace('leg = "measured"\n\n', 'part = "own.npz"\n\n'))
    with pytest.raises(ValueError, match=r"robot file .*plate\.toml: modules\.long: .*own\.npz"):
        RobotDescription.read(path)
