"""Symmetries that every reduced robot of the paper must keep, whatever its parts."""

from __future__ import annotations

import numpy as np
import pytest

from pneumorph.catalogue.leg_kinds import (
    hyperelastic_leg_mesh,
    load_default_leg,
    measured_leg_mesh,
    paper_leg_mesh,
)
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.geometry.pose import rotation_about
from pneumorph.physics.physics import Physics
from pneumorph.reduction.blocked_force import blocked_forces
from pneumorph.reduction.held_bend import held_bends
from pneumorph.robot.design import Design
from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.stepper_settings import StepperSettings
from pneumorph.study.bend_error import compare_bend

BUILD = paper_robot("published").assembly
COMMANDS = np.array([[90.0, 0.0, 20.0], [60.0, 90.0, 0.0], [0.0, 70.0, 90.0], [0.0, 0.0, 0.0]])
TIGHT = StepperSettings(
    contact_tolerance_mm_per_s=1e-6, contact_sweeps=5000, element_precision="double"
)


def walk(simulator: BatchedSimulator, seconds_each: float = 0.6) -> np.ndarray:
    """Path of the tracked points [mm], (record, robot, 3)."""
    robots = len(simulator.robots)
    simulator.advance(np.zeros((robots, 3)), 15)
    path = [simulator.tracked_point_mm]
    for command in COMMANDS:
        simulator.advance(np.tile(command, (robots, 1)), round(seconds_each * 100))
        path.append(simulator.tracked_point_mm)
    assert np.all(simulator.status == RobotStatus.RUNNING)
    return np.array(path)


@pytest.mark.parametrize(
    ("name", "mesh"),
    [
        ("published", paper_leg_mesh),
        ("hyperelastic", hyperelastic_leg_mesh),
        ("measured", measured_leg_mesh),
    ],
)
def test_the_legs_that_ship_were_made_from_the_meshes_that_ship(name, mesh):
    load_default_leg(name).check_mesh(mesh())


@pytest.mark.parametrize("damping", ["published", "objective"])
def test_mirror_image_designs_walk_mirror_image_paths(damping):
    """The leg, its modes and its sampled elements are mirror symmetric, so only rounding and the
    order in which Gauss-Seidel visits the contacts differ."""
    designs = [Design.parse(text) for text in ("1.0.2.2.2.3.0.1", "1.0.0.2.3.0.0.0")]
    robots = [BUILD(each) for design in designs for each in (design, design.mirror())]
    path = walk(BatchedSimulator(robots, Physics(damping=damping), TIGHT))
    difference = path[:, ::2] - path[:, 1::2] * [1.0, -1.0, 1.0]
    travelled = np.abs(path - path[0]).max()
    assert travelled > 5.0
    # Contact solved to 1e-6 mm/s; 240 steps near the edge of slipping may amplify its slowest
    # error (some thousand sweeps long), but not to what a leg's deflection would be, a millimetre.
    assert np.abs(difference).max() < 0.05


def test_a_turned_robot_walks_the_turned_path():
    """Modes live in the hub's frame: a robot that starts turned by any yaw keeps its shape."""
    robot = BUILD(Design.parse("1.0.2.2.2.3.0.1"))
    straight = walk(BatchedSimulator([robot], stepper=TIGHT))[:, 0]
    for yaw in (90.0, 180.0, 211.0):
        turn = rotation_about("z", yaw)
        simulator = BatchedSimulator([robot], stepper=TIGHT)
        simulator.write(0, "rotation", turn)
        path = walk(simulator)[:, 0]
        # The friction cone is round, so only rounding and the solver's tolerance differ.
        assert np.abs(path @ turn - straight).max() < 0.05


def test_a_released_robot_comes_to_rest_and_to_its_shape():
    """No gravity, no floor, no pressure: damping takes all energy of deformation."""
    robot = BUILD(Design.parse("1.0.0.2.2.0.0.1"))
    physics = Physics(
        gravity_mm_per_s2=0.0, floor_height_mm=-1e6, damping="objective", mass_damping_per_s=0.0
    )
    simulator = BatchedSimulator([robot], physics)
    simulator.advance(np.array([[40.0, 40.0, 0.0]]), 100)
    assert np.abs(simulator.read("modes")).max() > 1.0
    simulator.advance(np.zeros((1, 3)), 400)
    scale = np.sqrt(robot.mounts[0].part.mass)  # mass-orthonormal: 1 mm of the whole leg
    # Stiffness damping of 0.1 s relaxes every mode within 0.1 s; 3.4 s after the pressure is gone
    # only single-precision forces are left.
    assert np.abs(simulator.read("modes")).max() < 1e-2 * scale
    assert np.abs(simulator.read("mode_rates")).max() < 1e-2 * scale


def test_no_point_of_a_walking_robot_sinks_into_the_floor():
    robots = [BUILD(Design.parse(text)) for text in ("1.0.2.2.2.3.0.1", "1.0.0.2.2.0.0.1")]
    simulator = BatchedSimulator(robots)
    simulator.advance(np.zeros((2, 3)), 15)
    simulator.clear_counters()
    walk(simulator)
    # Contact is solved on velocities linearised at the step's start: a point's curvature leaves
    # second-order errors of h v^2 / r, some hundredths of a millimetre.
    assert simulator.read("worst_penetration").max() < 0.1


def test_legs_that_land_flat_on_the_floor_obey_its_law():
    """Eight legs of up to 48 points each: some hundred points share impulses that only their sums
    determine."""
    spec = paper_robot("measured")
    robot = spec.assembly(Design.parse("1.2.1.2.1.2.1.2"))
    simulator = BatchedSimulator([robot], spec.physics, spec.stepper, 1)
    most = 0
    for command in (0.0, 90.0, 0.0):
        for _ in range(30):
            simulator.advance(np.full((1, 3), command), 1)
            most = max(most, int(simulator.read("active_contacts")[0]))
    assert most > 300
    assert simulator.read("unconverged_total")[0] == 0


def test_the_full_robot_stands_on_the_slope_of_the_reduced_one():
    spec = paper_robot(
        "published",
        physics=Physics(floor_slope_deg=10.0),
        hub_model="rigid",
        full_order=FullOrderSettings(friction_solver="gauss_seidel"),
    )
    full, reduced = spec.full("1.0.0.2.2.0.0.1"), spec.reduced("1.0.0.2.2.0.0.1")
    assert full.physics == reduced.physics == spec.physics
    assert full.numerics.friction_solver == "gauss_seidel"


def test_the_leg_that_ships_bends_like_its_full_model():
    """Both held at the attachment; the bend may differ by 3 % (the project's own mark)."""
    leg = load_default_leg("published")
    assert leg.metadata["report"]["bend_error_percent"] < 3.0
    measured = compare_bend(module_of_leg("published").full, leg, (80.0,))
    assert measured.error_percent < 3.0


def test_the_hyperelastic_leg_that_ships_bends_like_its_full_model():
    """Its report has 5.5 % at worst; 21.7 degrees here."""
    measured = compare_bend(
        module_of_leg("hyperelastic").full, load_default_leg("hyperelastic"), (19.0,)
    )
    assert measured.error_percent < 5.5


MEASURED_BEND_DEG = {
    5.0: 6.2918,
    10.0: 12.6560,
    15.0: 19.0781,
    20.0: 25.5509,
    25.0: 32.0725,
    30.0: 38.6428,
    40.0: 51.9274,
    50.0: 65.3976,
    60.0: 79.0546,
    70.0: 92.9260,
    80.0: 107.0785,
    90.0: 121.6338,
    100.0: 136.7977,
}
"""Of the measured leg's finite elements at pressures in kPa, as `held_bends` finds them."""
MEASURED_BLOCKED_MN = {
    10.0: 115.08587,
    20.0: 234.12150,
    30.0: 358.10768,
    40.0: 488.18079,
    60.0: 772.04186,
    75.0: 1012.61510,
    80.0: 1099.62766,
    90.0: 1286.32906,
    100.0: 1493.75673,
}
"""Force that keeps their tip down, as `blocked_forces` finds it."""


def test_the_finite_elements_of_the_measured_leg_are_those_that_were_kept():
    """To the digits that are kept."""
    full = module_of_leg("measured").full
    ((bend, _),) = held_bends(full, full.mesh, [10.0])
    assert bend == pytest.approx(MEASURED_BEND_DEG[10.0], abs=1e-4)
    (blocked,) = blocked_forces(full, full.mesh, [10.0])
    assert blocked.force_mN == pytest.approx(MEASURED_BLOCKED_MN[10.0], abs=1e-4)


def test_the_measured_leg_that_ships_bends_like_its_finite_elements():
    """The project's mark: 1 % from 5 to 100 kPa."""
    found = held_bends(load_default_leg("measured"), measured_leg_mesh(), MEASURED_BEND_DEG)
    np.testing.assert_allclose([bend for bend, _ in found], [*MEASURED_BEND_DEG.values()], 0.01)


def test_the_measured_leg_that_ships_pushes_like_its_finite_elements():
    """The project's mark: 3 % up to 100 kPa."""
    found = blocked_forces(load_default_leg("measured"), measured_leg_mesh(), MEASURED_BLOCKED_MN)
    forces = [each.force_mN for each in found]
    np.testing.assert_allclose(forces, [*MEASURED_BLOCKED_MN.values()], 0.03)


def test_the_measured_leg_that_ships_knows_how_far_its_snapshots_went():
    assert load_default_leg("measured").snapshot_range is not None
