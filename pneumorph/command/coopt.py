"""Learn a design and its gait together, and compare them with the expert's.

First the expert's gait walks at every phase. Then a policy for all designs and a probability
distribution over designs are trained together, as in the paper. The best pairs are open-loop gaits
that anyone can replay. The first round walks gaits that work already, where --demonstrations gives
some, which compete with what is learned. A stopped run resumes with --resume and the same --out.

Presets: quick (minutes on two cores: many updates per action, mirror images), fast (two and a
half hours on one core: twelve beginnings as long as quick, --restarts, of which the last four learn
from what all saw, --pooled-restarts; then fine-tuning of the best one's five best designs) and
paper (the paper's schedule: one million timesteps, then fine-tuning of the eight best; with
--physics published, its experiment).

By default robots have measured material properties, and every round walks in worlds drawn from the
ranges of what nobody has measured (--randomize, --randomisation). Every design walks in four worlds
(--objective.worlds-per-design), and --objective.kind over them ranks designs, finalists and gaits;
quick and fast begin in the nominal world (--objective.nominal-until-timestep).
score_standard_error_cm in the metrics is the uncertainty that the draw leaves. While they learn,
legs have at most 16 modes for each chamber (--learning-modes) and the points that these need
(--learning-tolerance), with one chamber a quarter of a step's work; gaits are ranked on legs with
all of theirs, once a shortlist of designs has been made (--shortlist-count). At the end the best
pairs are certified in worlds that training never saw (--certified-world-count; see `pneumorph
certify`). With --certify they also walk as finite elements, and where the two models differ the leg
is reduced again and the pairs are fine-tuned on it. This takes hours, up to --rounds.limit and
--rounds.budget-s. --physics published trains as the paper did: in one world, ranked by the distance
there, without a certificate.

Writes best_trajectory.npz, baseline_trajectory.npz, phase_sweep.npz and, in training/,
metrics.jsonl, TensorBoard logs, checkpoints, policy.npz, a policy for each fine-tuned design, and
gaits/L1.csv, L2.csv ...; and report/page.html, as `pneumorph report` does. With --certify it also
writes certificate/, as `pneumorph certify --full` does.

Example: pneumorph coopt --preset quick --seed 1 --out runs/quick-1
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import TRAINING_FOLDER, RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.command.verb import Verb
from pneumorph.learn.checkpoint import has_checkpoint
from pneumorph.report.run_page import page_of_finished
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_options import PRESETS, TrainingOptions, train_as_asked
from pneumorph.study.training_result import TrainingResult


@dataclass(frozen=True, kw_only=True)
class Learned(TrainingResult):
    """What was learned, and the page that shows it."""

    page: str | None = None
    """None where none was asked for, or it could not be written."""
    page_wall_s: float | None = None
    """Wall time of drawing it [s], which `wall_s` leaves out, as on the page itself."""


def run(options: TrainingOptions, folder: RunFolder) -> TrainingResult:
    """Train as the options say, and show it on a page."""
    if options.resume and not has_checkpoint(folder.path / TRAINING_FOLDER):
        folder.progress.say(f"{folder.path} has no checkpoint to go on from: a new training begins")
    found = train_as_asked(options, folder)
    if not options.page:
        return found
    start = time.monotonic()
    folder.progress.stage("drawing the page")
    summary = {"verb": folder.verb, **folder.provenance, **result_to_dict(found)}
    shown = FinishedRun(folder.path, summary, settings_to_dict(options))
    page = page_of_finished(shown, folder.progress)
    return Learned(**vars(found), page=page, page_wall_s=time.monotonic() - start)


VERB = Verb(TrainingOptions, run, PRESETS)
