"""Walk the expert's gait at every phase shift: the baseline that learning has to beat.

The design is the paper's, 1.0.0.2.2.0.0.1: two front legs on regulator 1, two hind legs on
regulator 2. Both follow a sine wave, with the hind legs delayed by the phase. All phases are
simulated side by side.

Writes phase_sweep.npz and baseline_trajectory.npz, the walk of the best phase.

Of a robot of a file all phases are tried, of the paper's those up to 180 degrees, as in the paper.

Example: pneumorph baseline --phase-step-deg 20 --out runs/baseline
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_settings import chosen_robot
from pneumorph.command.verb import Verb, flat
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.study.baseline import baseline
from pneumorph.study.brought_gait import brought_gait, brought_phases


@dataclass(frozen=True)
class BaselineOptions:
    """Phases to try, and the robots."""

    sweep: Annotated[PhaseSweepSettings, flat] = field(default_factory=PhaseSweepSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """The design, the regulators and the pressures that the robot brings with it."""
        brought = brought_gait(content, below, None, None, below["sweep"]["gait"])
        phases = brought_phases(content, chosen_robot(content))
        return {"sweep": {"gait": brought.pop("expert"), **brought, **phases}}


VERB = Verb(
    BaselineOptions, lambda options, folder: baseline(options.robot.spec(), options.sweep, folder)
)
