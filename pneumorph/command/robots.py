"""Which leg the robots of a verb have, and how they are simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pneumorph.fem.full_order_settings import FrictionSolver, Integrator
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.height_map import HeightMap
from pneumorph.fem.material import LegMaterials
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.resumable_rollout import resumable_rollout
from pneumorph.gait.open_loop_gait import OpenLoopGait, sample_commands
from pneumorph.geometry.mesh import Mesh
from pneumorph.hardware.calibration import Calibration, describe_calibration
from pneumorph.presets import (
    LegName,
    full_leg,
    leg_materials,
    load_default_leg,
    paper_full_robot,
    paper_robot_builder,
    pressure_map,
)
from pneumorph.pressure import PressureMap
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design import Design
from pneumorph.robot.robot import Robot
from pneumorph.robot.scaled_part import scaled_part
from pneumorph.settings import settings_from_dict, settings_to_dict
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.randomised_simulator import RandomisedSimulator
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import rollout
from pneumorph.simulation.simulation_settings import SimulationSettings
from pneumorph.trajectory import Trajectory

Model = Literal["reduced", "full"]


@dataclass(frozen=True)
class FullOptions:
    """Robots of finite elements."""

    hub: Literal["soft", "rigid"] = "soft"
    """Disk as finite elements, or a rigid one."""
    integrator: Integrator = "linearly_implicit"
    """One linear solve a step as published, or implicit Euler converged by Newton's method."""
    friction_solver: FrictionSolver = "newton"
    """Newton's method to the tolerance, or Gauss-Seidel sweeps alone."""
    contact_sweeps: int = 2000
    """Most Gauss-Seidel sweeps of a contact solve; the published experiment made 250."""
    height_map: HeightMap = field(default_factory=HeightMap)
    """Floor that is no plane."""
    mesh: Path | None = None
    """Mesh of the legs, as `pneumorph mesh` writes it; by default the one that ships."""


@dataclass(frozen=True)
class RobotOptions:
    """The leg and the physics."""

    leg: LegName = "paper"
    """`paper`: the published material, linear elements. `hyperelastic`: the silicone's own
    stiffness, quadratic neo-Hookean elements; in place of the published pressure map it has its
    own."""
    part: Path | None = None
    """Reduced leg, as `pneumorph reduce` writes it; by default the one that ships."""
    threads: int = 0
    """Threads of the engine; 0 takes every processor."""
    full: FullOptions = field(default_factory=FullOptions)
    calibration: Path | None = None
    """Calibration file, as `pneumorph calibrate` writes it; by default the paper's line."""
    simulation: SimulationSettings = field(default_factory=SimulationSettings)


class Workshop:
    """Builds the robots of a verb and simulates them; the leg is read once."""

    def __init__(self, options: RobotOptions) -> None:
        self.options = options
        self.calibration = (
            None if options.calibration is None else Calibration.load(options.calibration)
        )
        self.simulation = self._with_pressure_map(options.simulation)
        self.modulus_factor = (self.calibration and self.calibration.modulus_factor) or 1.0

    @cached_property
    def leg(self) -> ReducedPart:
        """The reduced leg."""
        part = self.options.part
        leg = load_default_leg(self.options.leg) if part is None else ReducedPart.load(part)
        return leg if self.modulus_factor == 1.0 else scaled_part(leg, self.modulus_factor)

    @cached_property
    def _build(self) -> Callable[[Design], Robot]:
        return paper_robot_builder(self.leg)

    def _with_pressure_map(self, settings: SimulationSettings) -> SimulationSettings:
        if self.calibration is None:
            own = settings.pressure_map != PressureMap()
            return (
                settings if own else replace(settings, pressure_map=pressure_map(self.options.leg))
            )
        if settings.pressure_map != PressureMap():
            raise ValueError(
                f"both a calibration file ({self.options.calibration}) and simulation.pressure_map "
                "were given, expected one of them"
            )
        return self.calibration.applied_to(settings)

    def robot(self, design: Design) -> Robot:
        """Return the robot of a design."""
        return self._build(design)

    def simulator(self, robots: Sequence[Robot]) -> BatchedSimulator:
        """Return a simulator of robots."""
        return BatchedSimulator(robots, self.simulation, self.options.threads)

    def randomised_simulator(
        self, robots: Sequence[Robot], randomisation: Randomisation, seed: int, world_count: int
    ) -> RandomisedSimulator:
        """Return a simulator of robots in worlds drawn at random."""
        return RandomisedSimulator(
            robots, self.simulation, randomisation, seed, world_count, self.options.threads
        )

    def commands(self, gait: OpenLoopGait) -> np.ndarray:
        """Return the command of every step of a gait [real kPa], (step, regulator).

        Regulators beyond those of the gait stay empty.
        """
        step_s = self.simulation.time_step_s
        commands = sample_commands(gait, step_s, round(gait.duration_s / step_s))
        beyond = self.simulation.regulator_count - commands.shape[1]
        return np.pad(commands, ((0, 0), (0, max(beyond, 0))))

    def recorded(
        self,
        design: Design,
        gait: OpenLoopGait,
        record_every: int = 10,
        settling_steps: int = 15,
        description: dict[str, Any] | None = None,
        watch: Callable[[Trajectory], None] | None = None,
    ) -> Trajectory:
        """Return the trajectory of one reduced robot with its nodes.

        Args:
            design: Its design.
            gait: What it walks.
            record_every: Time steps between frames.
            settling_steps: Time steps at zero pressure before the gait.
            description: What else to note in the trajectory's metadata.
            watch: Told every frame as it is simulated.
        """
        _, trajectory = rollout(
            self.reduced(design, watch),
            self.commands(gait),
            record_every=record_every,
            settling_steps=settling_steps,
            description={"design": str(design), **(description or {})},
        )
        return trajectory

    def recorded_full(
        self,
        design: Design,
        gait: OpenLoopGait,
        checkpoint: Path,
        record_every: int = 10,
        settling_steps: int = 15,
        progress: Callable[[int, int, str], None] | None = None,
        watch: Callable[[Trajectory], None] | None = None,
    ) -> Trajectory:
        """Return the trajectory of one full robot; interrupted, it goes on from its checkpoint.

        Args:
            design: Its design.
            gait: What it walks.
            checkpoint: File for the way so far.
            record_every: Time steps between frames.
            settling_steps: Time steps at zero pressure before the gait.
            progress: Told the steps made and those to make.
            watch: Told every piece of the way as it is simulated.
        """
        return resumable_rollout(
            self.full(design),
            self.commands(gait),
            checkpoint,
            settling_steps=settling_steps,
            record_every=record_every,
            description={"design": str(design)},
            progress=progress,
            watch=watch,
        )

    def reduced(
        self, design: Design, watch: Callable[[Trajectory], None] | None = None
    ) -> ReducedRobot:
        """Return one reduced robot to roll out."""
        return ReducedRobot(self.robot(design), self.simulation, watch)

    def full(self, design: Design) -> FullRobot:
        """Return the finite elements of a whole robot."""
        full = self.options.full
        return paper_full_robot(
            design,
            self.simulation,
            full.hub,
            self.full_leg,
            integrator=full.integrator,
            friction_solver=full.friction_solver,
            contact_sweeps=full.contact_sweeps,
            height_map=full.height_map,
        )

    @cached_property
    def full_leg(self) -> PartModel:
        """The finite elements of a leg."""
        path = self.options.full.mesh
        mesh = None if path is None else Mesh.load(path)
        materials = scaled_materials(self._leg_materials, self.modulus_factor)
        return full_leg(self.options.leg, mesh, materials)

    @cached_property
    def _leg_materials(self) -> LegMaterials:
        """What the reduced leg says it is made of, or else what the options' name stands for."""
        usual, part = leg_materials(self.options.leg), self.options.part
        if part is None or self.options.leg != "paper":
            return usual
        recorded = ReducedPart.load(part).metadata.get("materials")
        return usual if recorded is None else settings_from_dict(LegMaterials, recorded)

    def refuse_full_options(self) -> None:
        """Refuse options of finite elements where reduced robots walk.

        Raises:
            ValueError: One of them is not the usual one.
        """
        usual, asked = (settings_to_dict(each) for each in (FullOptions(), self.options.full))
        changed = [name for name in usual if usual[name] != asked[name]]
        if changed:
            raise ValueError(
                f"full.{changed[0]} is {asked[changed[0]]!r}, expected {usual[changed[0]]!r} with "
                "--model reduced: it is an option of finite elements"
            )

    def check_reduction(self) -> None:
        """Refuse a reduced leg that does not stand for the full one.

        Raises:
            ArtefactError: It was made from another mesh or material.
        """
        self.leg.check_model(self.full_leg)

    @property
    def calibration_description(self) -> dict[str, Any]:
        """Which calibration the robots have, for a summary."""
        return describe_calibration(
            self.calibration, self.options.calibration, self.simulation.pressure_map
        )

    @property
    def leg_description(self) -> dict[str, Any]:
        """What the leg is and how well it stands for the full model, for a summary."""
        shipped = f"the {self.options.leg} leg that ships"
        return part_description(self.leg, str(self.options.part or shipped))

    def leg_used(self, model: Model) -> dict[str, Any]:
        """The leg's description under `leg`; empty for finite elements, which use none."""
        return {"leg": self.leg_description} if model == "reduced" else {}


def scaled_materials(
    usual: LegMaterials, modulus_factor: float = 1.0, mass_factor: float = 1.0
) -> LegMaterials:
    """A leg of a stiffer or heavier material."""
    return replace(
        usual,
        silicone=usual.silicone.stiffer(modulus_factor),
        paper=usual.paper.stiffer(modulus_factor),
        mass_kg=usual.mass_kg * mass_factor,
    )


def part_description(part: ReducedPart, name: str) -> dict[str, Any]:
    """Return size, provenance and measured errors of a reduced part, for a summary."""
    report = part.metadata.get("report", {})
    return {
        "part": name,
        "mode_count": part.mode_count,
        "tetrahedron_count": len(part.tetrahedron_rest),
        "membrane_count": len(part.membrane_rest),
        "mesh_digest": part.metadata["mesh_digest"],
        "errors": {key: report[key] for key in report if "error" in key},
        "bend": report.get("bend"),
    }
