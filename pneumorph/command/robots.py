"""Which leg the robots of a verb have, and how they are simulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pneumorph.fem.material import LegMaterials, Material
from pneumorph.fem.part_model import PartModel, leg_model
from pneumorph.gait.open_loop_gait import OpenLoopGait, sample_commands
from pneumorph.geometry.mesh import Mesh
from pneumorph.hardware.calibration import Calibration, describe_calibration
from pneumorph.presets import (
    load_default_leg,
    paper_full_robot,
    paper_leg_mesh,
    paper_robot_builder,
)
from pneumorph.pressure import PressureMap
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design import Design
from pneumorph.robot.robot import Robot
from pneumorph.robot.scaled_part import scaled_part
from pneumorph.simulation.batched_simulator import BatchedSimulator
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.randomised_simulator import RandomisedSimulator
from pneumorph.simulation.reduced_robot import ReducedRobot
from pneumorph.simulation.rollout import RobotModel, rollout
from pneumorph.simulation.simulation_settings import SimulationSettings
from pneumorph.trajectory import Trajectory

Model = Literal["reduced", "full"]


@dataclass(frozen=True)
class RobotOptions:
    """The leg and the physics."""

    part: Path | None = None
    """Reduced leg, as `pneumorph reduce` writes it; by default the one that ships."""
    threads: int = 0
    """Threads of the engine; 0 takes every processor."""
    mesh: Path | None = None
    """Mesh of full models' legs, as `pneumorph mesh` writes it; by default the shipped one."""
    full_hub: Literal["soft", "rigid"] = "soft"
    """Disk of full models: finite elements, or rigid as in the reduced robots."""
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
        self.simulation = self._calibrated(options.simulation)
        leg = load_default_leg() if options.part is None else ReducedPart.load(options.part)
        self.modulus_factor = (self.calibration and self.calibration.modulus_factor) or 1.0
        self.leg = leg if self.modulus_factor == 1.0 else scaled_part(leg, self.modulus_factor)
        self._build = paper_robot_builder(self.leg)

    def _calibrated(self, settings: SimulationSettings) -> SimulationSettings:
        if self.calibration is None:
            return settings
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
        """Return the command of every step of a gait [real kPa], (step, regulator)."""
        step_s = self.simulation.time_step_s
        return sample_commands(gait, step_s, round(gait.duration_s / step_s))

    def recorded(
        self,
        design: Design,
        gait: OpenLoopGait,
        model: Model = "reduced",
        record_every: int = 10,
        settling_steps: int = 15,
        description: dict[str, Any] | None = None,
    ) -> Trajectory:
        """Return the trajectory of one robot with its nodes.

        Args:
            design: Its design.
            gait: What it walks.
            model: The reduced robot, or the finite elements it stands for.
            record_every: Time steps between frames.
            settling_steps: Time steps at zero pressure before the gait.
            description: What else to note in the trajectory's metadata.
        """
        simulated: RobotModel[Any] = (
            self.reduced(design) if model == "reduced" else self.full(design)
        )
        _, trajectory = rollout(
            simulated,
            self.commands(gait),
            record_every=record_every,
            settling_steps=settling_steps,
            progress=model == "full",
            description={"design": str(design), **(description or {})},
        )
        return trajectory

    def reduced(self, design: Design) -> ReducedRobot:
        """Return one reduced robot to roll out."""
        return ReducedRobot(self.robot(design), self.simulation)

    def full(self, design: Design) -> RobotModel[Any]:
        """Return the finite elements of a whole robot to roll out."""
        return paper_full_robot(design, self.simulation, self.options.full_hub, self.full_leg())

    def full_leg(self) -> PartModel:
        """Return the finite elements of a leg.

        Raises:
            ArtefactError: The reduced leg was made from another mesh.
        """
        mesh = self.options.mesh
        shape = paper_leg_mesh() if mesh is None else Mesh.load(mesh)
        leg = leg_model(shape, scaled_materials(self.modulus_factor))
        self.leg.check_mesh(leg.mesh)
        return leg

    @property
    def calibration_description(self) -> dict[str, Any]:
        """Which calibration the robots have, for a summary."""
        return describe_calibration(
            self.calibration, self.options.calibration, self.simulation.pressure_map
        )

    @property
    def leg_description(self) -> dict[str, Any]:
        """What the leg is and how well it stands for the full model, for a summary."""
        return part_description(self.leg, str(self.options.part or "the leg that ships"))


def scaled_materials(modulus_factor: float = 1.0, mass_factor: float = 1.0) -> LegMaterials:
    """The paper's leg of a stiffer or heavier material."""
    usual = LegMaterials()

    def stiffer(material: Material) -> Material:
        return replace(material, young_modulus_kPa=material.young_modulus_kPa * modulus_factor)

    return replace(
        usual,
        silicone=stiffer(usual.silicone),
        paper=stiffer(usual.paper),
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
