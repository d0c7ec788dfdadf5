"""The air of robots whose modules say how their chambers grow."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from pneumorph.catalogue.grown_chambers import with_growth_of
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.paper_leg import leg_kind, paper_leg
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.physics.air import Air
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.reduced_part import ReducedPart

MEASURED = leg_kind("measured").physics
GROWTH = (0.1, 0.0, 1e-5)


@pytest.fixture(scope="module")
def own() -> ReducedPart:
    """A leg whose chambers grow otherwise than the paper's."""
    part = paper_leg("measured").reduced
    report = {**part.metadata["report"], "chamber_growth": list(GROWTH)}
    return replace(part, metadata={**part.metadata, "report": report})


def module_of(part: ReducedPart) -> Module:
    return replace(paper_leg("measured"), make_reduced=partial(lambda each: each, part))


def test_a_leg_of_ones_own_brings_its_growth(own: ReducedPart, tmp_path: Path) -> None:
    """As an option, and in a robot's file; one that does not know it keeps that of the physics."""
    path = own.save(tmp_path / "own.npz")
    spec = RobotOptions.of("measured", part=path).spec()
    assert spec.physics.air.chamber_growth == GROWTH
    assert spec.physics == replace(MEASURED, air=replace(MEASURED.air, chamber_growth=GROWTH))
    assert RobotOptions.of("measured").spec().physics == MEASURED
    shipped = paper_leg("measured").reduced.save(tmp_path / "shipped.npz")
    assert RobotOptions.of("measured", part=shipped).spec().physics == MEASURED


def test_growth_that_was_asked_for_stays(own: ReducedPart) -> None:
    modules = [module_of(own)]
    asked = replace(MEASURED, air=replace(MEASURED.air, chamber_growth=(0.02,)))
    assert with_growth_of(modules, asked, "measured") == asked
    limited = replace(MEASURED, air=Air())
    assert with_growth_of(modules, limited, "measured") == limited
    mapped = replace(MEASURED, pressure_map=PressureMap(1.2, 0.0))
    assert with_growth_of(modules, mapped, "measured") == mapped


def test_modules_that_differ_have_their_mean_by_volume(own: ReducedPart) -> None:
    """Together all chambers, one module of each kind, then have the sum of their volumes."""
    shipped = paper_leg("measured").reduced
    larger = replace(own, cavity_volume=3.0 * own.cavity_volume)
    physics = with_growth_of([module_of(shipped), module_of(larger)], MEASURED, "measured")
    pressure = np.linspace(0.0, 100.0, 11)
    rest = float(shipped.cavity_volume.sum())
    each = [
        replace(MEASURED.air, tube_mm3=1e-3, chamber_growth=growth).volume_mm3(pressure, volume)
        for growth, volume in ((MEASURED.air.chamber_growth, rest), (GROWTH, 3.0 * rest))
    ]
    both = replace(physics.air, tube_mm3=2e-3).volume_mm3(pressure, 4.0 * rest)
    np.testing.assert_allclose(both, sum(each), rtol=1e-12)


def test_two_chambers_grow_less_than_one_of_the_papers() -> None:
    """The catalogue's leg, which with both chambers at 100 kPa has 2.62 times the volume at rest
    where the paper's has 3.63 (equilibria of the reduced legs)."""
    path = Path(__file__).parents[2] / "examples" / "two_chambers.toml"
    air = RobotDescription.read(path).spec().physics.air
    volume = replace(air, tube_mm3=1e-3).volume_mm3(np.array(100.0), 1000.0)
    assert volume == pytest.approx(2620.0, rel=0.01)
