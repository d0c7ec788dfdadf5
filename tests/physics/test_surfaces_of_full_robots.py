"""Robots of finite elements on two surfaces: closed forms, and the reduced robot beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.site import Site
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.full_robot_state import FullRobotState
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.physics.friction import FrictionPressure
from pneumorph.physics.physics import Physics
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.simulation.stepper_settings import StepperSettings

GRAVITY, HUB_KG, END_KG = 9800.0, 0.03, 0.02
MASS = HUB_KG + 2.0 * END_KG
SIZE = (20.0, 12.0, 9.0)
DESIGN = "1.1"


def end(sole: str) -> Module:
    """A stiff elastic box of eight free nodes, and its reduction to all of their freedoms."""
    mesh = box_mesh(SIZE, (2, 1, 1))
    bottom = mesh.nodes[mesh.nodes[:, 2] < 1e-9]
    mesh = replace(
        mesh,
        surfaces={"skin": mesh.surface("skin"), sole: mesh.surface("bottom")},
        node_sets={"attachment": mesh.node_sets["left"]},
        contact_points=bottom[bottom[:, 0] > 19.0],
    )
    part = PartModel(mesh, Material(3e4, 0.3), END_KG)
    basis = np.zeros((len(mesh.nodes), 3, 3 * 8))
    free = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.node_set("attachment"))
    for number, (node, axis) in enumerate((n, a) for n in free for a in range(3)):
        basis[node, axis, number] = 1.0 / np.sqrt(part.node_mass[node])
    return Module(sole, lambda: assemble_reduced_part(part, basis), lambda *_: part)


def block(**changes: object) -> RobotSpec:
    """A rigid box that rests on the far edges of two ends, each with a sole of its own."""
    middle = box_mesh((16.0, 12.0, 9.0), (1, 1, 1))
    middle = replace(middle, nodes=middle.nodes - [8.0, 6.0, 0.0])
    above = middle.nodes[middle.nodes[:, 2] > 8.0]
    hub = HubSpec(middle, Material(500.0, 0.3), HUB_KG, np.zeros(3), above, "lid")
    place = Pose(np.eye(3), np.array([8.0, -6.0, 0.0]))
    sites = tuple(
        Site(Pose(rotation_about("z", angle)).compose(place), end(sole))
        for angle, sole in ((0.0, "felt"), (180.0, "rubber"))
    )
    fields = {"floor_height_mm": 0.0, "regulator_count": 1, "mass_damping_per_s": 0.0}
    stepper = StepperSettings(
        element_precision="double",
        contact_tolerance_mm_per_s=1e-7,
        contact_sweeps=2000,
        tangent_tolerance_mm_per_s=0.0,
    )
    physics = Physics(**(fields | changes))
    return RobotSpec(hub, sites, physics, stepper, hub_model="rigid", thread_count=1)


def walked(robot: FullRobot, steps: int) -> list[FullRobotState]:
    """States after each step without pressure."""
    states: list[FullRobotState] = []
    _, trajectory = robot.rollout(
        robot.initial_state(), np.zeros((steps, 1)), steps, False, observe=states.append
    )
    assert trajectory.status == "completed"
    assert max(state.contact_residual for state in states) < 1e-6
    return states


def test_two_ends_brake_each_by_its_own():
    """On a slope, forward up: W (mu_lower + mu_upper) / (2 - (mu_lower - mu_upper) h / L), with the
    centre h over the floor and L from both ends, as of a rigid block. The rougher end trails."""
    slope, upper, lower = np.arctan(0.8), 0.6, 0.2
    named = (("rubber", lower), ("felt", upper))
    spec = block(floor_slope_deg=float(np.degrees(slope)), friction_by_surface=named)
    speed = [state.hub.velocity[0] for state in walked(spec.full(DESIGN), 100)[59:]]
    load = MASS * GRAVITY * np.cos(slope)
    pull = load * (lower + upper) / (2.0 - (lower - upper) * 4.5 / 28.0)
    expected = pull / MASS - GRAVITY * np.sin(slope)
    # As of a block on one surface: elastic transients are gone after 60 steps.
    assert (speed[-1] - speed[0]) / 0.4 == pytest.approx(expected, rel=1e-4)


def test_what_a_hub_and_its_legs_stand_on_has_names():
    robot = block().assembly(DESIGN)
    assert robot.contact_surfaces.known_names() == ["felt", "lid", "rubber"]
    # Two points of each sole share its area; the lid has the hub's.
    area = dict(zip(robot.contact_surfaces.names, robot.contact_surfaces.area_mm2, strict=True))
    assert area["felt"] == pytest.approx(20.0 * 12.0 / 2.0)
    assert area["lid"] == pytest.approx(2.0 * (16.0 * 12.0 + 16.0 * 9.0 + 12.0 * 9.0) / 4.0)
    full = block(friction_by_surface=(("lid", 0.1),)).full(DESIGN)
    order = [*range(4, 8), *range(4)]  # full robots have the hub's points last
    np.testing.assert_array_equal(full.contact_surfaces.names[order], robot.contact_surfaces.names)
    np.testing.assert_allclose(
        full.contact_surfaces.area_mm2[order], robot.contact_surfaces.area_mm2
    )
    with pytest.raises(ValueError, match=r"names 'sole', expected .*: felt, lid, rubber"):
        block(friction_by_surface=(("sole", 0.1),)).full(DESIGN)


def test_friction_of_a_leg_that_a_design_has_not_is_no_mistake():
    """Neither in the physics nor in a world; what no leg of the robot has is."""
    spec = block(friction_by_surface=(("felt", 0.1), ("rubber", 0.2), ("lid", 0.3)))
    for design, own in (("1.0", {"lid", "felt"}), ("0.1", {"lid", "rubber"})):
        robot = spec.assembly(design)
        assert set(robot.contact_surfaces.known_names()) == own
        spec.simulator([robot, spec.assembly(DESIGN)])
        assert set(spec.full(design).contact_surfaces.known_names()) == own
    strange = block(friction_by_surface=(("sole", 0.1),))
    for make in (strange.full, lambda design: strange.simulator([design])):
        with pytest.raises(ValueError, match="names 'sole', expected"):
            make("1.0")


@pytest.mark.parametrize("exponent", [0.0, -0.3])
def test_both_models_slide_alike_on_two_surfaces(exponent):
    """The reduced ends have every freedom of their elements, so both are the same robot."""
    changes = {
        "floor_slope_deg": 30.0,
        "damping": "objective",
        "friction_pressure": FrictionPressure(exponent, pressure_kPa=1.0),
    }

    def speeds(**named: float) -> tuple[np.ndarray, np.ndarray]:
        spec = block(friction_by_surface=tuple(named.items()), **changes)
        states = walked(spec.full(DESIGN), 30)
        simulator = spec.simulator([DESIGN])
        reduced = []
        for _ in range(30):
            simulator.advance(np.zeros((1, 1)), 1)
            reduced.append(simulator.read("velocity")[0, 0])
        return np.array([state.hub.velocity[0] for state in states]), np.array(reduced)

    full, reduced = speeds(felt=0.5, rubber=0.1)
    other, _ = speeds(felt=0.1, rubber=0.5)
    # Modes are stored in single precision, 6e-8 of elastic forces that are some hundred times the
    # weight; the speed is some 500 mm/s at the end.
    assert np.abs(full - reduced).max() < 1e-3
    assert abs(full[-1] - other[-1]) > 5.0


def test_pressure_is_read_from_steps_of_one_length():
    """A step that is halved has the impulses of half a step."""
    law = FrictionPressure(-0.3, pressure_kPa=1.0)
    spec = block(floor_slope_deg=30.0, friction=0.3, friction_pressure=law)
    whole = spec.full(DESIGN)
    state = walked(whole, 60)[-1]
    plain = whole.step(state, np.zeros(1))
    tried = []

    class Halving(FullRobot):
        def _undivided(self, state, command_kPa, physics):
            tried.append(physics.time_step_s)
            if len(tried) == 1:
                raise np.linalg.LinAlgError("made to fail")
            return super()._undivided(state, command_kPa, physics)

    mounts = [(leg.part, leg.pose, leg.regulators) for leg in whole.legs]
    halved = Halving(whole.hub, mounts, spec.physics, numerics=spec.full_order)
    divided = halved.step(state, np.zeros(1))
    assert tried == [0.01, 0.005, 0.005]
    change = plain.hub.velocity[0] - state.hub.velocity[0]
    # A steady slide: either way gravity and friction act for the whole step.
    assert divided.hub.velocity[0] - state.hub.velocity[0] == pytest.approx(change, rel=1e-3)
    assert change < -1.0
