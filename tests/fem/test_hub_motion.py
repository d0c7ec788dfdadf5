"""Hubs that move freely: what their steps add and take, and what a hub cannot be made of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.element_cases import box_part

from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub, SoftHubState
from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.physics.physics import Physics

FREE = Physics(damping="objective", mass_damping_per_s=0.0, gravity_mm_per_s2=0.0)
DISK = np.diag([31.0, 31.0, 60.0])
SPIN = np.array([3.0, 3.0, 5.0])


def spun(step_s: float) -> tuple[np.ndarray, float]:
    """Spin in the disk's axes and energy over that at the start, after a second."""
    mesh = box_mesh((60.0, 60.0, 4.0), (1, 1, 1))
    hub = RigidHub(mesh, MassProperties(0.075, np.zeros(3), DISK))
    state = replace(hub.initial_state(), velocity=np.concatenate([np.zeros(3), SPIN]))
    physics = replace(FREE, time_step_s=step_s)
    for _ in range(round(1.0 / step_s)):
        state = hub.advance(state, np.linalg.solve(*hub.system(state, physics)), step_s)
    spin = state.rotation.T @ state.velocity[3:]
    return spin, (spin @ DISK @ spin) / (SPIN @ DISK @ SPIN)


@pytest.mark.parametrize("step_s", [0.01, 0.0025])
def test_a_free_disk_gains_spin_across_its_axis_by_the_moment_of_its_start(step_s: float) -> None:
    """Seen from the disk, each step adds h nu times the spin across the axis at right angles to
    it, nu = (I_3 / I_1 - 1) w_3; to rounding."""
    spin, _ = spun(step_s)
    nu = (60.0 / 31.0 - 1.0) * SPIN[2]
    grown = (1.0 + (nu * step_s) ** 2) ** (0.5 / step_s)
    assert spin[2] == pytest.approx(SPIN[2], rel=1e-9)
    assert np.hypot(*spin[:2]) == pytest.approx(grown * np.hypot(*SPIN[:2]), rel=1e-9)


def test_the_energy_that_a_free_disk_gains_is_in_proportion_to_the_step() -> None:
    """(1 + nu^2 h^2)^(1 / h) - 1 is nu^2 h and more by nu^4 h^2 / 2: the gains of two steps, one
    half the other, are as 2 to 1 but for nu^2 h / 4 of that, 3 % at 5 ms."""
    gains = [spun(step_s)[1] - 1.0 for step_s in (0.005, 0.0025)]
    assert gains[1] > 0.01
    assert gains[0] / gains[1] == pytest.approx(2.0, rel=0.03)


@pytest.mark.parametrize("mass_damping_per_s", [0.0, 0.1])
def test_mass_damping_takes_momentum_whatever_the_stiffness_damping(
    mass_damping_per_s: float,
) -> None:
    """A free body that turns: each step divides what it has by 1 + alpha h, so that all falls as
    exp(-alpha t) but for alpha^2 h t / 2, 5e-5. Objective damping takes none."""
    part = box_part("stable_neo_hookean", "linear")
    physics = replace(FREE, mass_damping_per_s=mass_damping_per_s)
    hub, count = SoftHub(part), 100
    velocity = np.cross([1.0, -2.0, 4.0], part.rest_nodes) + np.array([50.0, 0.0, -20.0])
    state = SoftHubState(part.rest_nodes.copy(), velocity.ravel())

    def momenta(state: SoftHubState) -> np.ndarray:
        impulses = part.node_mass[:, None] * state.velocity.reshape(-1, 3)
        return np.array([impulses.sum(0), np.cross(state.positions, impulses).sum(0)])

    before = momenta(state)
    for _ in range(count):
        velocity = np.linalg.solve(*hub.system(state, physics))
        state = hub.advance(state, velocity, physics.time_step_s)
    left = momenta(state)
    fall = np.exp(-mass_damping_per_s * count * physics.time_step_s)
    largest = np.linalg.norm(before, axis=1)[:, None]
    np.testing.assert_allclose((left - fall * before) / largest, 0.0, atol=6e-5)


def test_a_soft_hub_of_a_part_that_relaxes_or_is_hollow_is_refused() -> None:
    """Neither would do anything."""
    material = Material(100.0, 0.3, "stable_neo_hookean")
    mesh = box_mesh((4.0, 2.0, 2.0), (2, 1, 1))
    SoftHub(PartModel(mesh, material, 0.001, relaxation=PronySeries()))
    relaxing = PartModel(mesh, material, 0.001, relaxation=PronySeries((0.5,), (0.05,)))
    with pytest.raises(ValueError, match="hub's part relaxes by PronySeries"):
        SoftHub(relaxing)
    shell = box_mesh((40.0, 12.0, 9.0), (6, 3, 3), hollow=True)
    hollow = PartModel(shell, material, 0.001, cavity="cavity")
    with pytest.raises(ValueError, match="has the cavities cavity, expected none"):
        SoftHub(hollow)
