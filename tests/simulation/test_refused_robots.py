"""Robots, settings and pressures that the stepper refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.crawlers import PART, PHYSICS, STEPPER, crawlers, march
from helpers.one_leg import HUB, POSE
from helpers.synthetic_part import rubber_reduced_part, synthetic_reduced_part

from pneumorph.fem.material import Material
from pneumorph.physics.physics import Physics
from pneumorph.robot.robot import Mount, Robot
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.stepper_settings import StepperSettings


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_bad_pressures_are_refused(bad):
    simulator = BatchedSimulator(crawlers()[:1], PHYSICS, STEPPER, 1)
    with pytest.raises(ValueError, match="finite and not negative"):
        simulator.advance(np.array([[1.0, bad]]), 1)


def test_a_law_that_the_engine_does_not_know_is_refused():
    other = replace(PART, tetrahedron_material=Material(1160.0, 0.2, "isochoric_neo_hookean"))
    with pytest.raises(ValueError, match="to be stepped, got 'isochoric_neo_hookean'"):
        BatchedSimulator([Robot(HUB, (Mount(other, POSE, (1,)),))], PHYSICS, STEPPER, 1)


def test_constants_whose_stress_falls_are_refused():
    rubber = rubber_reduced_part()
    falling = replace(rubber.tetrahedron_material, yeoh_c2_over_c1=-0.5)
    part = replace(rubber, tetrahedron_material=falling)
    with pytest.raises(ValueError, match="make a stress that falls from"):
        BatchedSimulator(
            [Robot(HUB, (Mount(part, POSE, (0,)),))],
            replace(PHYSICS, damping="objective"),
            STEPPER,
            1,
        )


def test_refused_robots_leave_the_old_ones_running():
    simulator = BatchedSimulator(crawlers(), PHYSICS, STEPPER, 1)
    with pytest.raises(ValueError, match="unknown regulator 3, expected 1 to 2"):
        simulator.set_robots([*crawlers()[:2], Robot(HUB, (Mount(PART, POSE, (2,)),))])
    assert len(march(simulator)["position"]) == 3


def test_bad_robots_and_settings_are_refused():
    with pytest.raises(ValueError, match="unknown regulator 3, expected 1 to 2"):
        BatchedSimulator([Robot(HUB, (Mount(PART, POSE, (2,)),))], PHYSICS, STEPPER, 1)
    with pytest.raises(ValueError, match="one regulator for each cavity"):
        Mount(PART, POSE, (0, 1))
    with pytest.raises(ValueError, match="expected at least one robot"):
        BatchedSimulator([], PHYSICS, STEPPER, 1)
    with pytest.raises(ValueError, match="damping must be one of published, objective"):
        Physics(damping="publishd")
    with pytest.raises(ValueError, match=r"time_step_s must be above 0 and at most 0\.1, got 0\.0"):
        Physics(time_step_s=0.0)
    with pytest.raises(ValueError, match=r"at most 0\.1, got 1\.0; .* cannot resolve how a leg"):
        Physics(time_step_s=1.0)
    with pytest.raises(ValueError, match=r"below 90, got 95\.0; .* a ceiling"):
        Physics(floor_slope_deg=95.0)
    with pytest.raises(ValueError, match="friction must be finite"):
        Physics(friction=float("nan"))
    with pytest.raises(ValueError, match="element_precision must be one of single, double"):
        StepperSettings(element_precision="half")
    with pytest.raises(ValueError, match="contact_sweeps must be at least 1"):
        StepperSettings(contact_sweeps=0)
    for small in (0.0, 0.05):
        with pytest.raises(ValueError, match=f"margin_mm must be at least 0.1, got {small}; less"):
            StepperSettings(contact_margin_mm=small)
    assert StepperSettings(contact_margin_mm=0.1).contact_margin_mm == 0.1


def test_a_part_of_more_modes_than_there_are_kernels_for_is_refused():
    part = synthetic_reduced_part(41, (4, 4, 4))
    with pytest.raises(ValueError, match="a part has 41 modes, at most 40 are supported"):
        BatchedSimulator([Robot(HUB, (Mount(part, POSE, (1,)),))], PHYSICS, STEPPER, 1)


def test_parts_that_relax_are_refused_where_nothing_is_known_of_them():
    part = rubber_reduced_part(3, order="linear", pressures=2)
    published = replace(PHYSICS, damping="published")
    with pytest.raises(ValueError, match="expected 'objective' for a part that"):
        BatchedSimulator([Robot(HUB, (Mount(part, POSE, (1,)),))], published, STEPPER, 1)
    series = {"relaxation_weight": np.array([0.1]), "relaxation_time": np.array([0.5])}
    other = replace(PART, **series)
    objective = replace(PHYSICS, damping="objective")
    with pytest.raises(
        ValueError, match="the solid's law is 'corotational', expected one of large"
    ):
        BatchedSimulator([Robot(HUB, (Mount(other, POSE, (1,)),))], objective, STEPPER, 1)
    nine = {name: np.full(9, value[0] / 9.0) for name, value in series.items()}
    many = replace(part, **nine)
    with pytest.raises(ValueError, match="a part has 9 branches, at most 8 are supported"):
        BatchedSimulator([Robot(HUB, (Mount(many, POSE, (1,)),))], objective, STEPPER, 1)
