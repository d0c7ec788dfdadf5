"""Drive a rig with a gait: timed commands, a watchdog, and logs of every trial.

The gait is a run's best pair (runs/quick), a gait file (CSV, or sorotraj YAML), a policy (npz with
--design), or by default the expert's. The rig is --rig FILE (JSON or TOML: driver, channels,
limits), or by default a virtual one: a simulated robot whose parameters are off by seeded amounts,
behind imperfect regulators. --dry-run prints the schedule and commands nothing.

A run vents on Ctrl-C, on a lost connection, on a late or malformed answer, and on a sensed pressure
that no healthy regulator would have (docs/hardware.md, Safety). On a real rig a guardian process
vents if this one dies. With --calibration, pressures are converted to have the same effect on the
measured robot as in training.

Writes schedule.csv and, for each trial, trial_N/log.csv and on the virtual rig trial_N/track.csv;
for a real rig put the video tracker's table there. --bend-test measures one leg instead.

Example: pneumorph deploy runs/quick --model reduced --trials 5 --out runs/deploy-L1
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.command.verb import Verb, flat
from pneumorph.hardware.bend_staircase import BendTestSettings
from pneumorph.study.brought_gait import brought_gait
from pneumorph.study.deployed_gait import deploy_gait
from pneumorph.study.deployment_result import DeployedGait
from pneumorph.study.deployment_settings import DeploymentSettings
from pneumorph.study.gait_source import robot_of_source


@dataclass(frozen=True)
class DeployOptions:
    """The gait, the rig and its trials."""

    source: tyro.conf.Positional[Path | None] = None
    """Run folder, gait file or policy; by default the expert's gait."""
    deployment: Annotated[DeploymentSettings, flat] = field(default_factory=DeploymentSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """The design, the regulators and the pressures that the robot brings with it, also to a
        bend test."""
        below_it, source = below["deployment"], content.get("source")
        brought = brought_gait(content, below, source, below["source"], below_it["expert"])
        amplitude_kPa = brought.get("expert", {}).get("amplitude_kPa")
        bend_test = content.get("deployment", {}).get("bend_test", below_it["bend_test"])
        if amplitude_kPa is not None and bend_test:
            brought["bends"] = BendTestSettings.as_many_steps(2.0 * amplitude_kPa)
        return {"deployment": brought}

    def __post_init__(self) -> None:
        self.deployment.refuse_source_of_bend_test(self.source)


def run(options: DeployOptions, folder: RunFolder) -> DeployedGait:
    """Run the trials; between those on a real rig a person places the robot."""
    return deploy_gait(options.source, options.deployment, options.robot, folder, _wait_for_person)


def _wait_for_person(number: int) -> None:
    if sys.stdin is not None and sys.stdin.isatty():  # standard output may be a summary's file
        print(f"Place the robot for trial {number} and press Enter. ", file=sys.stderr, flush=True)
        if not sys.stdin.readline():  # Ctrl-D
            raise KeyboardInterrupt


VERB = Verb(DeployOptions, run, taken_over=lambda options: robot_of_source(options.source))
