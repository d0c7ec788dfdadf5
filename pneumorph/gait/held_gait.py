"""A gait of pressures that are held, one after another: what a policy or a file prescribes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pneumorph.base.checked import rises
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA, check_commands
from pneumorph.physics.open_loop_gait import SAME_TIME_S


@dataclass(frozen=True, eq=False)
class HeldGait:
    """Pressures held from one time to the next.

    Attributes:
        start_s: When each command begins [s], shape (command,), rising from 0.
        held_kPa: Real pressure of each command [kPa], shape (command, regulator).
        duration_s: When the gait ends [s].
        minimum_pressure_kPa: Lowest pressure that is accepted [kPa].
        maximum_pressure_kPa: Highest pressure that is accepted [kPa].
    """

    start_s: np.ndarray
    held_kPa: np.ndarray
    duration_s: float
    minimum_pressure_kPa: float = field(default=0.0, repr=False)
    maximum_pressure_kPa: float = field(default=HIGHEST_COMMAND_KPA, repr=False)

    def __post_init__(self) -> None:
        start_s = np.asarray(self.start_s, dtype=np.float64)
        held_kPa = np.asarray(self.held_kPa, dtype=np.float64)
        if start_s.ndim != 1 or len(start_s) == 0:
            raise ValueError(f"start_s has shape {start_s.shape}, expected (command,), one or more")
        if held_kPa.ndim != 2 or len(held_kPa) != len(start_s) or held_kPa.shape[1] == 0:
            raise ValueError(
                f"held_kPa has shape {held_kPa.shape}, expected (command, regulator) with "
                f"{len(start_s)} commands as in start_s"
            )
        if start_s[0] != 0.0 or not rises(start_s):
            raise ValueError(
                f"start_s begins {start_s[:4].tolist()}, expected finite times that rise from 0 s"
            )
        if not (np.isfinite(self.duration_s) and self.duration_s > start_s[-1]):
            raise ValueError(
                f"duration_s is {self.duration_s}, expected more than {start_s[-1]} s, when the "
                "last command begins"
            )
        check_commands(
            held_kPa, self.maximum_pressure_kPa, self.minimum_pressure_kPa, "pressure_kPa"
        )
        object.__setattr__(self, "start_s", start_s)
        object.__setattr__(self, "held_kPa", held_kPa)

    @classmethod
    def evenly(
        cls, held_kPa: np.ndarray, hold_s: float = 1.0, task: CrawlingTask | None = None
    ) -> HeldGait:
        """Pressures (command, regulator) [kPa] each held for ``hold_s``, as a policy's actions.

        Args:
            held_kPa: Real pressures [kPa], (command, regulator).
            hold_s: How long each is held [s].
            task: Whose range of pressures is accepted; None for the paper's.
        """
        held_kPa = np.asarray(held_kPa, dtype=np.float64)
        count = len(held_kPa) if held_kPa.ndim else 0
        task = task or CrawlingTask()
        return cls(
            hold_s * np.arange(count),
            held_kPa,
            hold_s * count,
            task.minimum_pressure_kPa,
            task.maximum_pressure_kPa,
        )

    @property
    def regulator_count(self) -> int:
        """Number of regulators it commands."""
        return int(self.held_kPa.shape[1])

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        """Real pressure commanded at a time [kPa], shape (regulator,).

        Before the beginning the first command stands, after the end the last.
        """
        place = int(np.searchsorted(self.start_s, time_s + SAME_TIME_S, side="right")) - 1
        return self.held_kPa[max(place, 0)]
