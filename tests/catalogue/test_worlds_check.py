"""Worlds that a robot cannot be in are refused before anything walks in them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.catalogue.leg_kinds import LegName
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.shipped_data import data_file
from pneumorph.catalogue.worlds_check import check_worlds
from pneumorph.cli import run
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.simulation.distribution import MOST_REJECTIONS, Distribution
from pneumorph.simulation.randomisation import Randomisation


def test_the_usual_worlds_are_those_of_the_robots_that_ship() -> None:
    for leg in ("measured", "published", "hyperelastic"):
        check_worlds(paper_robot(leg), measured_worlds())  # type: ignore[arg-type]


def test_a_surface_that_the_robot_has_not_is_refused() -> None:
    worlds = Randomisation(friction_by_surface=(("hub", "U(0.1,0.3)"), ("carpet", "U(0.3,1)")))
    with pytest.raises(ValueError, match=r"surface has 'carpet' .U\(0\.3,1\).*hub, sheet, skin"):
        check_worlds(paper_robot(), worlds)


@pytest.mark.parametrize(
    ("leg", "other", "why"),
    [
        ("measured", "published", "is of the published physics, and the measured leg .* is not"),
        ("measured", "hyperelastic", "is of the published physics, and"),
        ("published", "measured", "is not of the published physics, and"),
    ],
)
def test_a_reduction_of_another_physics_is_refused(leg: LegName, other: LegName, why: str) -> None:
    """Half of the worlds would have it."""
    worlds = Randomisation(reductions=(data_file(f"leg_{other}.npz"),))
    with pytest.raises(ValueError, match=rf"leg_{other}\.npz of randomisation\.reductions {why}"):
        check_worlds(paper_robot(leg), worlds)
    check_worlds(paper_robot(leg), replace(worlds, reductions=(data_file(f"leg_{leg}.npz"),)))


def test_a_reduction_with_other_cavities_is_refused() -> None:
    files = sorted(data_file("catalogue").glob("*/leg.npz"))
    (two,) = [each for each in files if ReducedPart.load(each).cavity_count == 2]
    with pytest.raises(ValueError, match="has 2 cavities, expected 1 as the measured leg"):
        check_worlds(paper_robot(), Randomisation(reductions=(two,)))


def test_a_reduction_of_a_leg_of_another_size_is_refused() -> None:
    """It took the mass of the robot's own and was mounted in its place. The paper's leg is one of
    the catalogue's too, and stands for itself."""
    sizes = {}
    for each in sorted(data_file("catalogue").glob("*/leg.npz")):
        part = ReducedPart.load(each)
        if part.cavity_count == 1:
            sizes[each] = np.ptp(part.rest_nodes, axis=0)
    own = np.ptp(ReducedPart.load(data_file("leg_measured.npz")).rest_nodes, axis=0)
    alike = [each for each, size in sizes.items() if np.allclose(size, own, atol=0.5)]
    others = [each for each in sizes if each not in alike]
    assert len(others) == 3
    for each in others:
        with pytest.raises(ValueError, match=r"mm large, expected 115\.\d x .* measured leg"):
            check_worlds(paper_robot(), Randomisation(reductions=(each,)))
    for each in alike:
        check_worlds(paper_robot(), Randomisation(reductions=(each,)))


def test_a_training_refuses_them_before_anything_walks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = "coopt --preset quick --randomisation.friction-by-surface carpet U(0.3,1)"
    assert run([*asked.split(), "--out", str(tmp_path / "run")]) == 1
    said = capsys.readouterr().err
    assert "randomisation.friction_by_surface has 'carpet'" in said
    assert "walking" not in said


def test_what_no_draw_agrees_with_is_refused() -> None:
    """A thousandth of a thousandth: of 100 000 draws one or two would agree."""
    with pytest.raises(ValueError, match=r"factor is 1 with .* 1e-06, expected a wider one"):
        replace(measured_worlds(), measured=(("modulus_factor", 1.0, 1e-6),))
    replace(measured_worlds(), measured=(("modulus_factor", 1.0, 1e-3),))


@pytest.mark.parametrize(
    ("law", "value"), [("U(0,1)", 0.5), ("U(0,1)", 1.0), ("LogU(0.01,10)", 8.0), ("N(0,0.5)", 1.4)]
)
def test_what_may_be_measured_can_be_drawn(law: str, value: float) -> None:
    """As many draws agree as are foreseen, and at the narrowest that is accepted some twenty of
    all that are tried: within four standard deviations of such a count."""
    chosen = Distribution.parse(law)
    narrowest = 1.0
    while MOST_REJECTIONS * chosen._agreeing(value, 0.9 * narrowest) >= 20.0:
        narrowest *= 0.9
    chosen.check_measured("it", value, narrowest)
    with pytest.raises(ValueError, match="expected a wider one"):
        chosen.check_measured("it", value, 0.9 * narrowest)
    foreseen = MOST_REJECTIONS * chosen._agreeing(value, narrowest)
    rng = np.random.default_rng(5)
    drawn = np.array([chosen.draw(rng) for _ in range(MOST_REJECTIONS)])
    agreeing = np.exp(-0.5 * ((drawn - value) / narrowest) ** 2).sum()
    assert abs(agreeing - foreseen) < 4.0 * foreseen**0.5
