"""The virtual rig of a verb: the true robot behind it, reduced or full."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from pneumorph.base.progress import ProgressReport
from pneumorph.catalogue.bench_tests import BEND_TEST_KPA, BenchTest
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.worlds_check import check_worlds
from pneumorph.fem.resumable_rollout import resumable_rollout
from pneumorph.fem.time_integration import StepError
from pneumorph.hardware.bend_test import MonotoneBend, simulated_bend_curve
from pneumorph.hardware.driver import DriverError
from pneumorph.hardware.rig import RigSettings
from pneumorph.hardware.virtual_rig import (
    Reality,
    VirtualRig,
    VirtualRigSettings,
    draw_reality,
    trial_reality,
    true_air,
    true_surfaces,
)
from pneumorph.physics.regulators import AirRegulators, air_regulators
from pneumorph.robot.design import Design
from pneumorph.simulation.distribution import Distribution
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.rollout import rollout
from pneumorph.study.bench_readings import bench_test
from pneumorph.study.recorded_walk import Model
from pneumorph.trajectory import Trajectory

_VALVES = {
    "filling_factor": "filling_mm3_per_s_kPa",
    "venting_factor": "venting_mm3_per_s_kPa",
}
"""Conductances of the air by the world's factor of them."""

_USUAL = VirtualRigSettings().reality


class VirtualReality:
    """Builds virtual rigs of one seed: the robot that was asked for, but for what is off.

    Args:
        spec: The simulation that the reality is off from, as nobody has calibrated it: the truth
            must not follow what a calibration believes of it.
        settings: What is off.
        model: The true robot's model.

    Raises:
        ValueError: What is off would be ignored: friction of a surface that the robot has not,
            other reductions of its legs, or a lag where air flows through valves.
    """

    def __init__(self, spec: RobotSpec, settings: VirtualRigSettings, model: Model) -> None:
        _refuse_ignored(spec, settings.reality)
        self._spec, self._settings, self._model = spec, settings, model
        drawn = draw_reality(settings, spec.physics.pressure_map)
        named = true_surfaces(settings, drawn.world, spec.physics)
        world = replace(drawn.world, friction_by_surface=named)
        self.reality: Reality = replace(drawn, world=world)

    def robot(self, trial: int) -> RobotSpec:
        """The true robot, on the floor of one trial."""
        reality = trial_reality(self.reality, self._settings, trial)
        world = self._spec.in_world(reality.world)
        return replace(world, physics=reality.physics(self._spec.physics))

    def rig(
        self,
        design: Design,
        rig: RigSettings,
        trial: int,
        checkpoint: Path | None = None,
        progress: ProgressReport | None = None,
    ) -> VirtualRig:
        """The rig of one trial with a design.

        Args:
            design: Of its robot.
            rig: Channels and rate.
            trial: Number of the trial.
            checkpoint: File for the way so far of finite elements; stopped, they go on from it. It
                stays at the end, some steps before it.
            progress: Told the steps made and those to make, of finite elements.

        Raises:
            ValueError: Finite elements without a checkpoint.
        """
        if self._model == "full" and checkpoint is None:
            raise ValueError("checkpoint is None, expected a file: finite elements take minutes")
        air = self._air(design)
        return VirtualRig(
            partial(self._walk, self.robot(trial), design, checkpoint, progress),
            rig,
            self._settings,
            self.reality.world.regulator_lag_s if air is None else 0.0,
            self._spec.physics.time_step_s,
            trial,
            air,
        )

    def bend_test(self, pressure_kPa: np.ndarray) -> np.ndarray:
        """Measure the bend of the true leg at real pressures [degrees], (measurement,).

        Raises:
            ValueError: The leg finds no equilibrium at the highest of them.
        """
        simulated = self.reality.pressure_map.simulated(pressure_kPa)
        curve = self._bend_curve(float(simulated.max()))
        if simulated.max() > curve.pressure_kPa[-1]:
            reached = float(self.reality.pressure_map.real(curve.pressure_kPa[-1]))
            raise ValueError(
                f"the virtual rig's leg finds no equilibrium above {reached:.1f} real kPa, the "
                f"bend test goes to {pressure_kPa.max():g} kPa; lower bends.highest-kPa"
            )
        bend = curve.bend(simulated)
        rng = np.random.default_rng([self._settings.seed, 4])
        noise = self._settings.bend_noise_deg * rng.standard_normal(bend.shape)
        measured: np.ndarray = bend + noise
        return measured

    def bench_readings(self, names: Sequence[str], repeats: int) -> dict[str, np.ndarray]:
        """What tests on a bench read of the true robot, each (repeat,).

        A test errs as much as its `BenchTest.deviation` says, some of it in all its readings alike,
        the bend as much as in a bend test.

        Args:
            names: The tests.
            repeats: Readings of each.

        Raises:
            ValueError: No such test, or one of a number that realities do not differ in.
        """
        rng = np.random.default_rng([self._settings.seed, 6])
        return {name: self._readings(bench_test(name), repeats, rng) for name in names}

    def _readings(self, test: BenchTest, repeats: int, rng: np.random.Generator) -> np.ndarray:
        if test.reading == "bend_deg":
            return self.bend_test(np.full(repeats, BEND_TEST_KPA))
        numbers = self.reality.world.numbers | self._of_valves()
        if test.number not in numbers:
            raise ValueError(
                f"the test {test.name!r} is of {test.number}, expected a number of the virtual "
                f"rig's world: {', '.join(numbers)}"
            )
        if test.number == "regulator_lag_s" and self._spec.physics.air.law != "rate_limit":
            raise ValueError(
                f"the test {test.name!r} is of {test.number}, expected another: where air flows "
                "through valves, the virtual rig's regulators have no lag"
            )
        true = numbers[test.number]
        common, own = test.parts_at(true)
        found = true + common * rng.standard_normal() + own * rng.standard_normal(repeats)
        if test.reading == "tilt_deg":
            return np.degrees(np.arctan(found))
        return found * (1e3 * self._spec.module.reduced.mass if test.reading == "leg_mass_g" else 1)

    def _of_valves(self) -> dict[str, float]:
        """What the true valves let through relative to the simulation's, in the mean; nothing where
        regulators have none."""
        physics = self._spec.physics
        if physics.air.law == "rate_limit":
            return {}
        count = physics.regulator_count
        true = true_air(self._settings, self.reality.world, physics.air, count)
        return {
            factor: float(
                np.mean(np.divide(true.of_each(name, count), physics.air.of_each(name, count)))
            )
            for factor, name in _VALVES.items()
        }

    def _air(self, design: Design) -> AirRegulators | None:
        """The true regulators; None where the simulation's air has no law."""
        physics = self._spec.physics
        if physics.air.law == "rate_limit":
            return None
        air = true_air(self._settings, self.reality.world, physics.air, physics.regulator_count)
        return air_regulators(air, self._spec.chambers_mm3(design))

    def _bend_curve(self, largest_kPa: float) -> MonotoneBend:
        module = self._spec.module.scaled(self.reality.world.modulus_factor)
        if self._model == "reduced":
            module.reduced.check_mesh(module.full.mesh)
        return simulated_bend_curve(
            module.reduced if self._model == "reduced" else module.full,
            module.full.mesh,
            largest_kPa + 10.0,
            rotation=self._spec.physics.rotation,
        )

    def _walk(
        self,
        true: RobotSpec,
        design: Design,
        checkpoint: Path | None,
        progress: ProgressReport | None,
        pressure_kPa: np.ndarray,
    ) -> Trajectory:
        """`pneumorph.hardware.virtual_rig.Walk` of a true robot."""
        settling_steps = max(self._settings.settling_steps, 1)
        if self._model == "reduced":
            _, trajectory = rollout(
                true.reduced(design),
                pressure_kPa,
                settling_steps=settling_steps,
                record_every=1,
                record_nodes=False,
                highest_kPa=np.inf,
            )
            return trajectory
        assert checkpoint is not None
        try:
            return resumable_rollout(
                true.walking_alone().full(design),
                pressure_kPa,
                checkpoint,
                settling_steps=settling_steps,
                record_every=1,
                record_nodes=False,
                progress=progress,
                highest_kPa=np.inf,
                keep_checkpoint=True,
            )
        except StepError as error:
            raise DriverError(f"the virtual robot's simulation diverged: {error}") from error


def _refuse_ignored(spec: RobotSpec, drawn: Randomisation) -> None:
    """Refuse a reality of which the virtual rig's robot would not have all.

    Raises:
        ValueError: It would not.
    """
    if drawn.reductions:
        files = ", ".join(map(str, drawn.reductions))
        raise ValueError(
            f"virtual.reality.reductions is {files}, expected none: the virtual rig has one leg, "
            "that of the robot; give another one by --part"
        )
    if drawn.friction_by_surface:
        check_worlds(spec, drawn, "virtual.reality")
    if spec.physics.air.law == "rate_limit":
        return
    # Worlds that a robot was trained or certified in come as a whole, with their lag.
    usual = [each.regulator_lag_s for each in (_USUAL, Randomisation(), measured_worlds())]
    lag, known = drawn.regulator_lag_s, [Distribution.parse(each) for each in usual]
    if Distribution.parse(lag) not in known and Distribution.parse(lag).highest > 0.0:
        raise ValueError(
            f"virtual.reality.regulator_lag_s is {lag!r}, expected {usual[0]!r}, the usual, or 0: "
            f"where air flows through valves (physics.air.law {spec.physics.air.law}), the virtual "
            "rig's regulators have no lag; how slow its valves are is virtual.filling_factor and "
            "virtual.venting_factor"
        )
