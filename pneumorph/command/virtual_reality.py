"""The virtual rig of a verb: the true robot behind it, reduced or full."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from pneumorph.command.robots import Model, Workshop, scaled_materials
from pneumorph.fem.material import DiskMaterials, LegMaterials
from pneumorph.fem.part_model import leg_model
from pneumorph.hardware.bend_test import BendCurve, simulated_bend_curve
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.virtual_rig import (
    Reality,
    VirtualRig,
    VirtualRigSettings,
    draw_reality,
    trial_reality,
)
from pneumorph.presets import paper_full_robot, paper_leg_mesh
from pneumorph.robot.design import Design
from pneumorph.robot.scaled_part import scaled_part, scaled_robot
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import RobotModel


class VirtualReality:
    """Builds virtual rigs of one seed.

    Args:
        workshop: The simulation that the reality is off from; its calibration takes no part.
        settings: What is off.
        model: The true robot's model.
    """

    def __init__(self, workshop: Workshop, settings: VirtualRigSettings, model: Model) -> None:
        # The truth must not follow what a calibration believes of it.
        plain = replace(workshop.options, calibration=None)
        self._workshop = Workshop(plain) if workshop.calibration is not None else workshop
        self._settings, self._model = settings, model
        self.reality: Reality = draw_reality(settings)

    def rig(self, design: Design, rig: RigSettings, trial: int) -> VirtualRig:
        """The rig of one trial with a design."""
        reality = trial_reality(self.reality, self._settings, trial)
        simulation = self._workshop.simulation
        return VirtualRig(
            self._robot(design, reality),
            rig,
            self._settings,
            reality.world.regulator_lag_s,
            simulation.time_step_s,
            trial,
        )

    def bend_test(self, pressure_kPa: np.ndarray) -> np.ndarray:
        """Measure the bend of the true leg at real pressures [degrees], (measurement,)."""
        simulated = self.reality.pressure_map.simulated(pressure_kPa)
        bend = self._bend_curve(float(simulated.max())).bend(simulated)
        rng = np.random.default_rng([self._settings.seed, 4])
        noise = self._settings.bend_noise_deg * rng.standard_normal(bend.shape)
        measured: np.ndarray = bend + noise
        return measured[np.isfinite(measured)]

    def _bend_curve(self, largest_kPa: float) -> BendCurve:
        factor = self.reality.world.modulus_factor
        published = self._workshop.simulation.damping == "published"
        mesh = paper_leg_mesh()
        if self._model == "reduced":
            leg: Any = scaled_part(self._workshop.leg, factor)
        else:
            leg = leg_model(mesh, scaled_materials(LegMaterials(), factor))
        return simulated_bend_curve(
            leg, mesh, largest_kPa + 10.0, rotation="edge" if published else "polar"
        )

    def _robot(self, design: Design, reality: Reality) -> RobotModel[Any]:
        world = reality.world
        settings = reality.settings(self._workshop.simulation)
        if self._model == "reduced":
            robot = scaled_robot(
                self._workshop.robot(design), world.modulus_factor, world.mass_factor
            )
            return ReducedRobot(robot, settings)
        disk = DiskMaterials(mass_kg=DiskMaterials().mass_kg * world.mass_factor)
        return paper_full_robot(
            design,
            settings,
            self._workshop.options.full.hub,
            leg_model(
                self._workshop.full_leg.mesh,
                scaled_materials(LegMaterials(), world.modulus_factor, world.mass_factor),
            ),
            disk_materials=disk,
        )
