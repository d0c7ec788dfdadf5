"""Compare trials on a rig with the simulation.

Takes folders of `pneumorph deploy`, each as LABEL=FOLDER or FOLDER, whose trials hold a log and the
marker's track (time_s,x_mm,y_mm, or a table of Tracker, DeepLabCut or SLEAP, see --video). Each
design is simulated with the commands that were sent and compared with its trials: reward per step,
commanded against sensed pressure, backsliding, mean and spread, and the transfer ratio.

Writes the paper's two comparison figures, transfer_rewards and transfer_gaits (PNG and PDF), the
simulations as simulated_LABEL.npz, and comparison.json.

Example: pneumorph transfer B=runs/deploy-B L1=runs/deploy-L1 --calibration calibration.json
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated

import tyro

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.command.verb import Verb, flat
from pneumorph.report.trial_figures import save_transfer_figures
from pneumorph.study.transfer import Transfer, TransferSettings, transfer


@dataclass(frozen=True)
class TransferOptions:
    """What was deployed, and the simulation beside it."""

    runs: tyro.conf.Positional[tuple[str, ...]] = tyro.MISSING
    """Deployments, as LABEL=FOLDER or FOLDER; the others are compared with the first."""
    settings: Annotated[TransferSettings, flat] = field(default_factory=TransferSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)


def run(options: TransferOptions, folder: RunFolder) -> Transfer:
    """Compare and draw."""
    if options.settings.model == "reduced":
        options.robot.refuse_full_options()
    compared = transfer(options.runs, options.settings, options.robot.spec(), folder)
    figures = save_transfer_figures(compared, folder.path)
    return replace(compared.found, figures=tuple(str(each) for each in figures))


VERB = Verb(TransferOptions, run)
