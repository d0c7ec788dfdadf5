"""The paper's phase sweep: what the expert's gait achieves with the baseline at each phase."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import load_artefact, reading, save_artefact
from pneumorph.base.checked import Checked, Count, CountOrNone, Positive
from pneumorph.base.progress import ProgressReport
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.environment.crawling_simulator import RobotBuilder, SimulatorFactory
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.walk import walk
from pneumorph.reduction.snapshot_range import furthest_ratio
from pneumorph.robot.design import Design

PHASE_SWEEP_VERSION = 1


@dataclass(frozen=True)
class PhaseSweepSettings(Checked):
    """Which phases of the expert's gait to try (paper, section IV)."""

    design: str = BASELINE_DESIGN
    """Design that walks."""
    first_phase_deg: float = 0.0
    """First phase [deg]."""
    last_phase_deg: float = 180.0
    """Last phase, included [deg]; robots of a file and goals other than forward bring 359."""
    phase_step_deg: Positive = 10.0
    """Step from one phase to the next [deg]."""
    gait: ExpertGait = field(default_factory=ExpertGait)
    """The expert's gait; its phase is set by the sweep."""
    settling_step_count: CountOrNone = 15
    """Time steps at zero pressure before the gait begins."""
    record_step_count: Count = 3
    """Time steps between recorded positions."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.last_phase_deg < self.first_phase_deg:
            raise ValueError(
                f"phases from {self.first_phase_deg} to {self.last_phase_deg} deg, expected a "
                "rising range"
            )

    @property
    def phases_deg(self) -> tuple[float, ...]:
        """The phases of the sweep [deg]."""
        count = int((self.last_phase_deg - self.first_phase_deg) / self.phase_step_deg + 1e-9) + 1
        return tuple(self.first_phase_deg + i * self.phase_step_deg for i in range(count))


@dataclass(frozen=True, eq=False)
class PhaseSweep:
    """Travel of the baseline over the phases.

    Attributes:
        phase_deg: Phases [deg], shape (phase,).
        distance_cm: Travel at each phase [cm], shape (phase,); NaN where the simulation failed.
        backsliding_cm: Mean slide back per cycle [cm], shape (phase,).
        time_s: Recorded times [s], shape (record,).
        forward_cm: Travel over time [cm], shape (record, phase).
        settings: What made it, as nested dictionaries.
        achieved: What of a goal was achieved at each phase [its unit], shape (phase,); NaN where
            the simulation failed. None for the distance.
        range_ratio: How far any leg went relative to the furthest snapshot it was reduced from,
            shape (phase,); NaN where that is not known.
    """

    phase_deg: np.ndarray
    distance_cm: np.ndarray
    backsliding_cm: np.ndarray
    time_s: np.ndarray
    forward_cm: np.ndarray
    settings: dict[str, Any]
    achieved: np.ndarray | None = None
    range_ratio: np.ndarray | None = None

    @property
    def counted(self) -> np.ndarray:
        """What phases are compared by, shape (phase,): what they achieved of the goal."""
        return self.distance_cm if self.achieved is None else self.achieved

    @property
    def best(self) -> int:
        """Place of the phase that achieves most."""
        return int(np.nanargmax(self.counted))

    @property
    def furthest_ratio(self) -> float | None:
        """The largest of the range ratios; None where none is known."""
        return furthest_ratio(self.range_ratio)

    @property
    def best_phase_deg(self) -> float:
        """Phase that achieves most [deg]."""
        return float(self.phase_deg[self.best])

    @property
    def best_distance_cm(self) -> float:
        """Travel at the best phase [cm]."""
        return float(self.distance_cm[self.best])

    def save(self, path: Path | str) -> Path:
        """Write the sweep as an npz artefact."""
        arrays = {
            name: getattr(self, name)
            for name in ("phase_deg", "distance_cm", "backsliding_cm", "time_s", "forward_cm")
        }
        for name in ("achieved", "range_ratio"):
            if getattr(self, name) is not None:
                arrays[name] = getattr(self, name)
        metadata = {"settings": self.settings}
        return save_artefact(path, "PhaseSweep", PHASE_SWEEP_VERSION, arrays, metadata)

    @classmethod
    def load(cls, path: Path | str) -> PhaseSweep:
        """Read what `save` wrote."""
        arrays, metadata = load_artefact(path, "PhaseSweep", PHASE_SWEEP_VERSION)
        with reading(path, "PhaseSweep"):
            return cls(**arrays, settings=metadata["settings"])


def sweep_phases(
    build_robot: RobotBuilder,
    make_simulator: SimulatorFactory,
    settings: PhaseSweepSettings | None = None,
    *,
    time_step_s: float = 0.01,
    progress: ProgressReport | None = None,
    goal: Goal = FORWARD,
) -> PhaseSweep:
    """Walk the baseline at every phase, all phases in one batch.

    Args:
        build_robot: Turns the design into a robot.
        make_simulator: Makes the simulator of as many robots as there are phases.
        settings: Phases and gait; None for the paper's.
        time_step_s: The simulator's time step [s].
        progress: Told how far the sweep is.
        goal: What phases are compared by.

    Raises:
        ValueError: The gait is shorter than its period, every simulation failed, the design uses a
            regulator the gait does not have, or the simulator does not know what the goal asks for.
    """
    settings = settings or PhaseSweepSettings()
    duration_s, period_s = settings.gait.duration_s, settings.gait.period_s
    if duration_s < period_s * (1.0 - 1e-6):
        raise ValueError(
            f"gait.duration_s is {duration_s:g}, expected at least gait.period_s, {period_s:g}: "
            "phases are compared over whole cycles; walk for longer, or shorten the period"
        )
    design = Design.parse(settings.design)
    design.check_regulators(settings.gait.regulator_count)
    gaits: Sequence[ExpertGait] = [
        replace(settings.gait, phase_deg=phase) for phase in settings.phases_deg
    ]
    result = walk(
        make_simulator([build_robot(design) for _ in gaits]),
        gaits,
        duration_s=duration_s,
        time_step_s=time_step_s,
        settling_step_count=settings.settling_step_count,
        record_step_count=settings.record_step_count,
        progress=progress,
    )
    if np.isnan(result.distance_cm).all():
        raise ValueError(
            f"the simulation failed at every phase of design {design}, expected at least one to "
            "walk; the reduced parts, the floor (slope, ground, friction) or the time step are at "
            "fault"
        )
    return PhaseSweep(
        phase_deg=np.array(settings.phases_deg),
        distance_cm=result.distance_cm,
        backsliding_cm=result.backsliding_cm(period_s),
        time_s=result.time_s,
        forward_cm=result.forward_cm,
        settings=settings_to_dict(settings),
        achieved=None if goal.is_forward else result.achieved(goal),
        range_ratio=result.range_ratio,
    )
