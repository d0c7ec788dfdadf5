"""Say how far the best pairs of a coopt run will walk, and how sure that is.

The pairs and the expert's robot walk in worlds that training never saw, drawn from the ranges of
what nobody has measured (--randomisation; by default those that the run was trained in, if any).
For each pair it reports the band from the 10th to the 90th percentile, the share of worlds in which
it goes further than the expert (whose phase is tuned in the training's worlds), how much selecting
the best overestimated its distance (optimism), the weight on the hub, the share of its friction
that each leg uses, and which uncertain numbers the distance depends on.

With --full the best pair also walks as finite elements, in the nominal world and in its two worst
worlds; the other pairs in the nominal world. Where reduced robots differ from them by more than 3 %
and 0.3 cm, the leg is reduced again with these walks among its snapshots, the pairs' designs are
fine-tuned on it and walk again, until both models agree or --rounds.limit or --rounds.budget-s is
reached. A stopped certificate resumes with the same --out. Writes certificate.json after each
round, full_order/ with the walks, and round_1/ ... with each new leg (leg.npz) and its gaits
(learned/gaits/).

It names the test of the robot that would narrow the band most. Pass a test's result as
--randomisation.measured "friction sheet" 0.62 0.03 (value and standard deviation), and the worlds
are drawn to agree with it.

Example: pneumorph certify runs/quick --world-count 200 --out runs/certificate
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.command.verb import Verb, flat
from pneumorph.study.certified_candidates import CertificateSettings
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.certified_rounds import certify
from pneumorph.study.finished_run import FinishedRun, TakenOver
from pneumorph.study.reduce_settings import from_walks


@dataclass(frozen=True)
class CertifyOptions:
    """The run, its pairs, and the worlds they walk in."""

    run: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder of a coopt run."""
    afresh: bool = False
    """Take leg and physics only from the flags. Otherwise they are the run's, changed by the flags
    that are given."""
    certificate: Annotated[CertificateSettings, flat] = field(default_factory=CertificateSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)


def run(options: CertifyOptions, folder: RunFolder) -> Certificate:
    """Certify the run's pairs."""
    settings = options.certificate
    if not settings.full:
        options.robot.refuse_full_options()
    robot = options.robot
    return certify(options.run, settings, robot.spec(), folder, from_walks(robot.leg_name))


def taken_over(options: CertifyOptions) -> TakenOver | None:
    """Leg and physics of the run, and the worlds that it was trained in."""
    learned = FinishedRun.read(options.run)
    learned.refuse_other_robot(options.robot, options.afresh)
    return None if options.afresh else learned.handed_on_with_worlds("certificate")


VERB = Verb(CertifyOptions, run, taken_over=taken_over)
