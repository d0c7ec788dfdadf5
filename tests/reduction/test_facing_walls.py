"""Walls that may not pass through each other: an energy whose force and stiffness are its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.one_leg import COMMAND, motion_of, thrown
from helpers.steps_with_contact import step
from helpers.synthetic_part import rubber_reduced_part

from pneumorph.catalogue.leg_kinds import load_default_leg, measured_leg_mesh
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.tooth_gap import least_tooth_gap_mm, tooth_gaps
from pneumorph.reduction.blocked_force import blocked_forces
from pneumorph.reduction.facing_walls import FacingWalls, with_facing_walls
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.resized_part import resized_part
from pneumorph.robot.scaled_part import scaled_part
from pneumorph.simulation.reference_step import unknowns_of

SHAPE = PneuNetShape()


def walls_of(mode_count: int, seed: int = 3) -> FacingWalls:
    """Two gaps with five pairs, of which some overlap at the states of `states`."""
    rng = np.random.default_rng(seed)
    pair = rng.normal(scale=0.3, size=(5, 3))
    return FacingWalls(
        np.array([[9.0, 0.0, 1.0], [8.0, 1.0, 0.0]]),
        rng.normal(scale=0.5, size=(2, 3, mode_count)),
        np.array([0, 0, 0, 1, 1]),
        pair,
        rng.normal(scale=0.5, size=(5, 3, mode_count)),
        rng.uniform(100.0, 300.0, size=5),
    )


def energy(walls: FacingWalls, alpha: np.ndarray) -> float:
    return float(0.5 * (walls.pair_stiffness * np.minimum(walls.gaps(alpha), 0.0) ** 2).sum())


def test_force_is_that_of_the_energy_and_stiffness_is_its_leading_part():
    """Central differences of an energy of some 100 mJ: rounded by 1e-14 over steps of 1e-5, and
    off by their square. What stiffness leaves out is the gradient's change times the overlap."""
    walls, rng = walls_of(4), np.random.default_rng(5)
    seen = 0
    for _ in range(10):
        alpha, step_length = rng.normal(scale=0.3, size=4), 1e-5
        offsets = step_length * np.eye(4)
        slope = [energy(walls, alpha + o) - energy(walls, alpha - o) for o in offsets]
        force = walls.force(alpha)
        assert force == pytest.approx(-np.array(slope) / (2 * step_length), abs=1e-6)
        overlap = walls.gaps(alpha) < 0.0
        seen += int(overlap.any() and not overlap.all())
        stiffness = walls.stiffness(alpha)
        assert np.linalg.eigvalsh(stiffness)[0] > -1e-9
        assert np.linalg.matrix_rank(stiffness, tol=1e-6) == min(4, overlap.sum())
    assert seen > 3
    together = rng.normal(scale=0.3, size=(3, 2, 4))
    assert walls.force(together)[2, 1] == pytest.approx(walls.force(together[2, 1]))


def test_a_turn_of_the_whole_costs_nothing():
    walls, alpha = walls_of(4), np.full(4, 0.2)
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    turned = FacingWalls(
        walls.axis @ turn.T,
        np.einsum("ij,gjm->gim", turn, walls.axis_modes),
        walls.pair_gap,
        walls.pair @ turn.T,
        np.einsum("ij,gjm->gim", turn, walls.pair_modes),
        walls.pair_stiffness,
    )
    assert energy(walls, alpha) > 0.0
    assert turned.force(alpha) == pytest.approx(walls.force(alpha), rel=1e-12)


@pytest.mark.parametrize(("precision", "tolerance"), [("double", 1e-11), ("single", 1e-3)])
def test_the_engine_takes_the_steps_of_the_reference(precision: str, tolerance: float):
    """As `test_reference_step.py` has it; with overlaps whose push is a good part of the step."""
    part = rubber_reduced_part(8, pressures=6)
    walls = walls_of(part.mode_count)
    part = replace(
        part,
        wall_axis=walls.axis,
        wall_axis_modes=walls.axis_modes,
        wall_pair_gap=walls.pair_gap,
        wall_pair=walls.pair,
        wall_pair_modes=walls.pair_modes,
        wall_pair_stiffness=walls.pair_stiffness,
    )
    motion = motion_of(part, 0.1)
    settings = {"damping": "objective", "tangent_tolerance_mm_per_s": 0.0}
    simulator = thrown(part, motion, element_precision=precision, **settings)
    state = simulator.state(0)
    overlap = part.walls.gaps(state.modes[0, : part.mode_count]) < 0.0
    assert 0 < overlap.sum() < 5
    free_part = replace(part, wall_pair_stiffness=0.0 * walls.pair_stiffness)
    without = thrown(free_part, motion, **settings)
    expected, got = (unknowns_of(simulator.robots[0], each) for each in step(simulator, COMMAND))
    free, _ = (unknowns_of(simulator.robots[0], each) for each in step(without, COMMAND))
    assert np.abs(got - expected).max() < tolerance * np.abs(expected).max()
    assert np.abs(free - expected).max() > 0.01 * np.abs(expected).max()


@pytest.fixture(scope="module")
def leg() -> ReducedPart:
    mesh = measured_leg_mesh()
    return with_facing_walls(load_default_leg("measured"), mesh, tooth_gaps(SHAPE, mesh))


def test_teeth_of_a_leg_whose_tip_is_kept_down_push_each_other_apart(leg: ReducedPart):
    """At 50 kPa they would cross by half a millimetre. What overlap is left is what the contact's
    stiffness makes of the air's pressure, and what the leg's modes cannot give way in."""
    mesh = measured_leg_mesh()
    (*_, crossing), (*_, pushed) = (
        list(blocked_forces(each, mesh, (25.0, 50.0)))
        for each in (load_default_leg("measured"), leg)
    )
    before, after = (least_tooth_gap_mm(SHAPE, mesh, each.positions) for each in (crossing, pushed))
    assert before < -0.4
    assert after > 0.5 * before
    assert pushed.force_mN > crossing.force_mN


def test_walls_are_kept_in_the_file_and_scale_with_the_leg(leg: ReducedPart, tmp_path):
    kept = ReducedPart.load(leg.save(tmp_path / "leg.npz"))
    alpha = np.random.default_rng(0).normal(scale=1e-3, size=leg.mode_count)
    assert len(kept.wall_pair) > 100
    assert kept.walls.gaps(alpha) == pytest.approx(leg.walls.gaps(alpha), abs=1e-5)
    # Points that face each other are not quite opposite, which tilted directions see.
    assert kept.walls.gaps(0.0 * alpha) == pytest.approx(1.0, abs=0.01)
    # What is stiffer presses its walls together as much as its rubber resists.
    pressed = 50.0 * alpha
    stiffer = scaled_part(leg, modulus_factor=1.5)
    assert np.abs(leg.walls.force(pressed)).max() > 0.0
    assert stiffer.walls.force(pressed) == pytest.approx(1.5 * leg.walls.force(pressed))
    larger = resized_part(leg, 1.2)
    assert larger.walls.gaps(0.0 * alpha) == pytest.approx(1.2 * leg.walls.gaps(0.0 * alpha))


def test_a_pair_of_a_gap_that_there_is_none_of_is_refused(leg: ReducedPart):
    wrong = leg.wall_pair_gap.copy()
    wrong[-1] = len(leg.wall_axis)
    with pytest.raises(ValueError, match=r"wall_pair_gap"):
        replace(leg, wall_pair_gap=wrong)


def test_a_wall_without_triangles_is_refused():
    mesh = measured_leg_mesh()
    (gap, *_) = tooth_gaps(SHAPE, mesh)
    bare = replace(gap, first=gap.first[:1], facing=gap.facing[:1])
    with pytest.raises(ValueError, match="first wall of gap 0 has no triangle"):
        with_facing_walls(load_default_leg("measured"), mesh, [bare])


def test_a_stiffness_that_is_none_is_refused():
    mesh = measured_leg_mesh()
    with pytest.raises(ValueError, match=r"stiffness_kPa_per_mm is 0\.0, expected a positive"):
        with_facing_walls(load_default_leg("measured"), mesh, tooth_gaps(SHAPE, mesh), 0.0)
