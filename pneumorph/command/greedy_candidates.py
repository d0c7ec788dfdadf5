"""Motions among which the greedy reduction searches: random designs under random pressures."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.fem.full_robot import FullRobot
from pneumorph.fem.part_model import PartModel
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.open_loop_gait import sample_commands
from pneumorph.presets import paper_full_robot, paper_robot_builder
from pneumorph.reduction.compressed_snapshots import CompressedSnapshots
from pneumorph.reduction.error_indicator import ErrorIndicator, Imbalance, relative_imbalance
from pneumorph.reduction.leg_recorder import record_walk
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.reduction.snapshots import Snapshots
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.reduced_robot import ReducedRobot, ReducedState
from pneumorph.simulation.simulation_settings import Damping, SimulationSettings


@dataclass(frozen=True)
class CandidateSettings:
    """Which motions are drawn."""

    training_count: int = 24
    """Motions that may be simulated in full."""
    heldout_count: int = 8
    """Motions that only check the reduction."""
    duration_s: float = 4.0
    """Length of each; every action lasts one second [s]."""
    state_count: int = 8
    """Steps of each at which the error indicator looks, evenly spaced."""
    compression: float = 3e-4
    """As of `WalkSnapshotSettings`."""
    damping: Damping = "published"
    """Damping of the robots."""
    seed: int = 0
    """Seed of designs and pressures."""


@dataclass(frozen=True)
class Candidate:
    """A design and the real pressures of its actions [kPa], (action, regulator)."""

    design: str
    pressures_kPa: tuple[tuple[float, ...], ...]

    def __str__(self) -> str:
        actions = " ".join("/".join(f"{p:g}" for p in action) for action in self.pressures_kPa)
        return f"{self.design} {actions}"

    @property
    def gait(self) -> HeldGait:
        """The pressures as a gait."""
        return HeldGait.evenly(np.array(self.pressures_kPa))


def draw_candidates(settings: CandidateSettings) -> tuple[list[Candidate], list[Candidate]]:
    """Training and held-out motions: designs and pressures are uniform, in whole kPa."""
    rng = np.random.default_rng(settings.seed)
    space, task = DesignSpace(), CrawlingTask()
    actions = max(round(settings.duration_s), 1)
    drawn = []
    for _ in range(settings.training_count + settings.heldout_count):
        design = space[int(rng.integers(space.size))]
        pressures = rng.integers(
            round(task.minimum_pressure_kPa),
            round(task.maximum_pressure_kPa) + 1,
            (actions, space.regulator_count),
        )
        drawn.append(Candidate(str(design), tuple(tuple(map(float, row)) for row in pressures)))
    return drawn[settings.heldout_count :], drawn[: settings.heldout_count]


@dataclass(frozen=True, eq=False)
class CandidateModels:
    """What candidates are simulated with."""

    leg: PartModel
    settings: CandidateSettings
    hub: Literal["soft", "rigid"] = "soft"
    """What carries the legs of full robots."""

    @property
    def simulation(self) -> SimulationSettings:
        """Physics of full and reduced robots."""
        return SimulationSettings(damping=self.settings.damping)

    def identity(self) -> dict[str, Any]:
        """What a full simulation depends on beside its candidate."""
        return {
            **self.leg.ingredients(),
            "hub": self.hub,
            "simulation": asdict(self.simulation),
            "compression": self.settings.compression,
        }

    def full_robot(self, candidate: Candidate) -> FullRobot:
        """The full robot."""
        design = Design.parse(candidate.design)
        return paper_full_robot(design, self.simulation, hub=self.hub, leg=self.leg)

    def commands(self, candidate: Candidate) -> np.ndarray:
        """Real pressures of every step [kPa], (step, regulator)."""
        step = self.simulation.time_step_s
        return sample_commands(candidate.gait, step, round(candidate.gait.duration_s / step))


def candidate_snapshots(
    models: CandidateModels, candidate: Candidate
) -> Snapshots | CompressedSnapshots:
    """Simulate a candidate in full and record its legs."""
    return record_walk(
        models.full_robot(candidate),
        models.commands(candidate),
        f"greedy {candidate}",
        compression=models.settings.compression,
    )


def candidate_indicator(
    models_and_part: tuple[CandidateModels, ReducedPart], candidate: Candidate
) -> float:
    """Error indicator of a candidate's motion with a reduced leg; infinite where it diverges."""
    models, part = models_and_part
    reduced = ReducedRobot(
        paper_robot_builder(part)(Design.parse(candidate.design)), models.simulation
    )
    full = models.full_robot(candidate)
    indicator = ErrorIndicator(models.leg)
    commands = models.commands(candidate)
    rest = np.zeros((15, commands.shape[1]))
    state, _ = reduced.rollout(reduced.initial_state(), rest, len(rest), record_nodes=False)
    steps = np.linspace(0, len(commands) - 1, models.settings.state_count + 1)[1:].astype(int)
    done, imbalances = 0, list[Imbalance]()
    for step in steps:
        state, trajectory = reduced.rollout(
            state, commands[done:step], max(step - done, 1), record_nodes=False
        )
        following, _ = reduced.rollout(state, commands[step : step + 1], 1, record_nodes=False)
        if trajectory.status != "completed":
            return float("inf")
        imbalances += step_imbalances(indicator, full, reduced, state, following)
        state, done = following, step + 1
    return relative_imbalance(imbalances)


def step_imbalances(
    indicator: ErrorIndicator,
    full: FullRobot,
    reduced: ReducedRobot,
    state: ReducedState,
    following: ReducedState,
) -> list[Imbalance]:
    """What one step of a reduced robot leaves unbalanced in each leg of the full one."""
    hub_points = len(reduced.robot.hub.contact_points)
    simulated = full.settings.pressure_map.simulated(following.regulated)
    imbalances, first = [], hub_points
    for number, (mount, leg) in enumerate(zip(reduced.robot.mounts, full.legs, strict=True)):
        part, frame = mount.part, state.rotation @ mount.pose.rotation
        count = len(part.contact_points)
        # Impulses are along z, x, y.
        impulse = following.impulses[first : first + count][:, [1, 2, 0]]
        first += count
        x, v = _world(state, state, mount.pose.apply, frame, part, number)
        _, v_new = _world(state, following, mount.pose.apply, frame, part, number)
        imbalances.append(
            indicator.of_step(
                x,
                v,
                v_new,
                float(simulated[leg.regulator]),
                leg.contact_weights.T @ impulse,
                frame,
                full.settings,
            )
        )
    return imbalances


def _world(
    place: ReducedState,
    motion: ReducedState,
    to_hub: Any,
    frame: np.ndarray,
    part: ReducedPart,
    mount: int,
) -> tuple[np.ndarray, np.ndarray]:
    """World positions of a leg's nodes at a state, and the velocities there of a motion's rates."""
    arm = to_hub(part.positions(place.modes[mount, : part.mode_count])) @ place.rotation.T
    deforming = part.modes @ motion.mode_rates[mount, : part.mode_count]
    turning = np.cross(motion.angular_velocity, arm)
    return place.position + arm, motion.velocity + turning + deforming @ frame.T
