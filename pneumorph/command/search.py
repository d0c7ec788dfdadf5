"""Search for gaits or designs without learning a policy, to see how good the learned ones are.

--method gaits searches for the best gait of each design separately, by CMA-ES over all numbers of
the gait: for the expert's design, a coopt run's best pairs (--run), --designs, and designs drawn at
random. With --run, the policy's own distance is shown beside each. --method random and --method
genetic search designs and gaits together, with as much simulated time as a coopt run of equal
--timesteps, so that their learning curves can be compared. In the measured physics they use the
worlds, objective and reward of a training there. All robots walk side by side in the reduced model.
A stopped search resumes with the same --out.

Writes search.jsonl, learning_curve.json and the best gaits as gaits/DESIGN.csv.

Example: pneumorph search --method genetic --timesteps 1000000 --out runs/genetic
"""

from __future__ import annotations

from dataclasses import replace

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.description_notes import damping_note
from pneumorph.command.verb import Verb
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.search import search
from pneumorph.study.search_findings import SearchFindings
from pneumorph.study.search_options import SearchOptions


def run(options: SearchOptions, folder: RunFolder) -> SearchFindings:
    """Search as the options say."""
    learned = None if options.run is None else FinishedRun.read(options.run)
    robot, described = options.robot.spec(), options.robot.description
    note = None if described is None else damping_note(described, options.robot.physics)
    if note is not None:
        folder.progress.say(note)
    found = search(options.search, robot, folder, learned, options.randomisation)
    return found if note is None else replace(found, notes=(*found.notes, note))


VERB = Verb(SearchOptions, run, taken_over=lambda options: options.taken_over)
