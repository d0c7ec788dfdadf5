"""Compare trials on a rig with the simulation.

Takes folders of `pneumorph deploy`, each as LABEL=FOLDER or FOLDER, whose trials hold a log and the
marker's track (time_s,x_mm,y_mm, or a table of Tracker, DeepLabCut or SLEAP, see --video). Each
design is simulated with the commands that were sent and compared with its trials: reward per step,
commanded against sensed pressure, backsliding, mean and spread, and the transfer ratio, of what the
last robot was taught (degrees of one that turns) where all tracks tell it.

Writes the paper's two comparison figures, transfer_rewards and transfer_gaits (PNG and PDF), the
simulations as simulated_LABEL.npz, and comparison.json.

Example: pneumorph transfer B=runs/deploy-B L1=runs/deploy-L1 --calibration calibration.json
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import tyro

from pneumorph.base.run_folder import SUMMARY, RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.command.verb import Verb, flat
from pneumorph.report.plan import plans_of
from pneumorph.report.trial_figures import save_transfer_figures
from pneumorph.study.deployed_otherwise import deployed_otherwise
from pneumorph.study.finished_run import FinishedRun, TakenOver
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
    deployed = [Path(text.rpartition("=")[2]) for text in options.runs]
    told = [note for each in deployed for note in deployed_otherwise(each, options.robot)]
    for note in told:
        folder.progress.say(note)
    compared = transfer(options.runs, options.settings, options.robot.spec(), folder)
    figures = save_transfer_figures(compared, folder.path, plans_of(options.robot))
    return replace(
        compared.found,
        figures=tuple(str(each) for each in figures),
        notes=(*told, *compared.found.notes),
    )


def taken_over(options: TransferOptions) -> TakenOver | None:
    """The robot of a file that the first of them deployed. Of the paper's robot a deployment's
    physics may be that of its virtual rig, with which the simulation is to be compared."""
    if options.robot.described is not None:
        return None
    for text in options.runs[:1]:
        folder = Path(text.rpartition("=")[2])
        if (folder / SUMMARY).is_file():
            deployed = FinishedRun.read(folder)
            if deployed.robot.described is not None:
                return deployed.handed_on(deployed.taken_over("robot"))
    return None


VERB = Verb(TransferOptions, run, taken_over=taken_over)
