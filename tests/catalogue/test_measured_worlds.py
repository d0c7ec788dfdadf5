"""What nobody has measured, as ranges with their sources."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.catalogue.measured_worlds import UNCERTAINTIES, measured_worlds
from pneumorph.physics.ground import Ground, RoughGround, Steps
from pneumorph.physics.physics import Physics
from pneumorph.simulation.distribution import Distribution
from pneumorph.simulation.randomisation import Randomisation


def test_every_number_of_a_world_has_a_range_and_a_source() -> None:
    rng = np.random.default_rng(0)
    worlds = [measured_worlds().draw(rng).numbers for _ in range(50)]
    assert set(worlds[0]) == set(UNCERTAINTIES)
    for name, each in UNCERTAINTIES.items():
        assert each.source
        drawn = [world[name] for world in worlds]
        assert len(set(drawn)) == 50
        law = Distribution.parse(each.distribution)
        assert law.lowest <= min(drawn) < max(drawn) <= law.highest


def test_the_distribution_is_kept_with_a_run_and_read_back() -> None:
    drawn = measured_worlds()
    assert settings_from_dict(Randomisation, settings_to_dict(drawn)) == drawn
    assert drawn.described()["damping_factor"] == "LogU(0.67, 1.5)"


def test_what_is_new_shifts_no_earlier_draw() -> None:
    usual = Randomisation().draw(np.random.default_rng(4))
    new = Randomisation(
        damping_factor="U(0.5, 2)", mounting_angle_deg="N(0, 1)", ground_roughness_mm="U(1, 5)"
    )
    world = new.draw(np.random.default_rng(4))
    assert world.damping_factor != 1.0
    assert world.ground_roughness_mm > 1.0
    assert world.ground_seed != new.draw(np.random.default_rng(5)).ground_seed
    usual_legs = {"damping_factor": 1.0, "mounting_angle_deg": 0.0}
    assert replace(world, **usual_legs, ground_roughness_mm=0.0, ground_seed=0) == usual


def test_a_ground_of_its_own_is_the_worlds_and_tells_walks_apart() -> None:
    """Kept walks of worlds without one are found by what they were always found by."""
    plain = Randomisation().draw(np.random.default_rng(4))
    assert not [name for name in plain.of_full_order() if "ground" in name]
    assert "ground_roughness_mm" not in plain.numbers
    assert plain.applied_to(Physics()).ground == Ground()
    own = replace(plain, ground_roughness_mm=2.0, ground_seed=9)
    assert own.of_full_order()["ground_seed"] == 9
    assert own.numbers["ground_roughness_mm"] == 2.0
    bumps = Ground(rough=RoughGround(5.0, 50.0, 1), steps=Steps(8.0))
    expected = replace(bumps, rough=RoughGround(2.0, 50.0, 9))
    assert own.applied_to(Physics(ground=bumps)).ground == expected
    assert plain.applied_to(Physics(ground=bumps)).ground == bumps
