"""A certificate whose reduced robots are held to their finite elements, round after round.

Learning goes where the reduction flatters. So the pairs walk as finite elements; where the two
models part, the leg is reduced again with these walks among its snapshots, the pairs' designs are
fine-tuned on the new leg, and they walk again.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import write_json
from pneumorph.base.result import finite, result_to_dict
from pneumorph.base.run_folder import SUMMARY, RunFolder
from pneumorph.base.spent_time import spent_s
from pneumorph.catalogue.part_physics import physics_of_part
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.gait.gait_file import read_gait
from pneumorph.robot.design import Design
from pneumorph.study.certificate import certify_once
from pneumorph.study.certified_candidates import Candidates, CertificateSettings
from pneumorph.study.certified_pairs import Certificate, CertifiedRound, RoundPair
from pneumorph.study.certified_settings import SAID_NOW, made_of_settings, refuse_other_legs
from pneumorph.study.finished_run import FinishedRun, Pair
from pneumorph.study.learned_again import Trained, learned_again
from pneumorph.study.reduce_settings import ReduceSettings, from_walks
from pneumorph.study.reduction import PART_FILE, Reduction, reduce, said_of_further
from pneumorph.study.robustness import KEPT_WALKS
from pneumorph.study.shown_worlds import SHOWN_WORLDS
from pneumorph.study.study_once import refuse_others, study_once

CERTIFICATE_FILE = "certificate.json"
CERTIFICATE_FOLDER = "certificate"
SPENT_FILE = "spent.json"
"""What reducing a leg again has taken so far, so that what was stopped counts."""
GAITS_STAYED = (
    "gaits stayed as they were: the run fine-tuned nothing, or its checkpoint or task is not there"
)


@dataclass(frozen=True, eq=False)
class Again:
    """How a leg is reduced again, and the pairs' designs are fine-tuned on it.

    Attributes:
        reduction: Settings of the reduction.
        trained: The training of the pairs; None where gaits stay as they are.
    """

    reduction: ReduceSettings
    trained: Trained | None = None


def certify(
    run: FinishedRun | Path | str,
    settings: CertificateSettings | None = None,
    robot: RobotSpec | None = None,
    folder: RunFolder | None = None,
    reduction: ReduceSettings | None = None,
) -> Certificate:
    """Walk a run's best pairs and the expert in unseen worlds, and say what to expect of them.

    Args:
        run: A run of coopt or its folder.
        settings: Which pairs and worlds, and whether as finite elements too.
        robot: What they walk as; None for the leg and physics of the run.
        folder: Keeps walks of finite elements and all that is made of them, and is told how far it
            is; walks of reduced robots are there until it has a summary. None for RUN/certificate,
            where they are until the end.
        reduction: How the leg is reduced again where it parts from its finite elements; None for
            the way of its physics.

    Raises:
        ArtefactError: The run holds no pairs, or is damaged.
        ValueError: A surface of the worlds is none of the robot's, or the folder holds a
            certificate of something else.
    """
    settings = settings or CertificateSettings()
    run = run if isinstance(run, FinishedRun) else FinishedRun.read(Path(run))
    own = folder or RunFolder(run.folder / CERTIFICATE_FOLDER, "certify")
    robot = robot or run.spec()
    worlds = robot.agreeing_worlds(settings.randomisation)
    settings = replace(settings, randomisation=worlds)
    candidates = Candidates.of_run(run, settings)
    usual = from_walks(physics_of_part(robot.modules[0].reduced))
    again = Again(reduction or usual, Trained.of_run(run))
    found = certify_candidates(candidates, settings, robot, own, again)
    if folder is None:  # nobody writes a summary there
        shutil.rmtree(own.path / KEPT_WALKS, ignore_errors=True)
    return found


def certify_candidates(
    candidates: Candidates,
    settings: CertificateSettings,
    spec: RobotSpec,
    folder: RunFolder,
    again: Again,
) -> Certificate:
    """Certify pairs and the expert; raises as `certify`, before anything walks where the folder's
    new legs are of other settings, another robot or other pairs.

    What was made is kept until the folder has a summary, finite elements beyond it: the same call
    goes on where it was stopped, and seconds that were spent on finite elements and new legs before
    count.

    Args:
        candidates: What is certified.
        settings: In which worlds, and for how many rounds.
        spec: What they walk as.
        folder: Receives ``certificate.json`` after each round with finite elements,
            ``full_order/`` and ``round_1/`` ... Without finite elements an earlier one is removed
            at the end.
        again: How what differs is made again.
    """
    rounds: list[CertifiedRound] = []
    walked: list[tuple[Candidates, RobotSpec]] = []
    made_s = wall_s = 0.0
    made_of: dict[str, Any] = {}
    if settings.full:
        made_of = made_of_settings(candidates, settings, spec, again.reduction)
        refuse_other_legs(folder.path, made_of)
    folder.keep_until_summary(folder.path / KEPT_WALKS)
    while True:
        found = certify_once(candidates, settings, spec, folder)
        wall_s += found.wall_s
        if not settings.full:
            (folder.path / CERTIFICATE_FILE).unlink(missing_ok=True)  # of an earlier call
            break
        rounds.append(_round_of(found, made_s))
        walked.append((candidates, spec))
        ending = _ending(rounds, settings, spec)
        notes = found.notes
        if ending is not None:
            nearest, is_file = nearest_round(rounds), spec.name is not None
            if nearest < len(rounds) - 1:  # the walks that the folder shows are that round's, too
                its_candidates, its_spec = walked[nearest]
                found = certify_once(its_candidates, settings, its_spec, folder)
            of_rounds = _of_rounds(rounds, nearest, found.best, candidates.run, is_file)
            notes = (*found.notes, *of_rounds, ending)
            if len(rounds) > 1 and again.trained is None:
                notes = (*notes, GAITS_STAYED)
        found = replace(found, rounds=tuple(rounds), notes=notes, wall_s=wall_s)
        own = RunFolder(folder.path / f"round_{len(rounds)}", "reduce", folder.progress)
        asked = {**made_of, "walks": _walk_files(rounds)}
        if ending is None and (own.path / SUMMARY).exists():
            refuse_others(own.path, asked, later=SAID_NOW)
        write_json(folder / CERTIFICATE_FILE, finite(result_to_dict(found)))
        if ending is not None:
            break
        made = _reduced_again(spec, again.reduction, asked, own, folder.path)
        # Where it lies now: its summary says where it was made.
        spec, made_s = spec.reduced_again(own.path / PART_FILE), made.wall_s
        candidates = replace(candidates, seen_mean=None)  # those were of the other leg
        if again.trained is not None:
            candidates, learned_s = _tuned_again(candidates, again.trained, spec, own)
            made_s += learned_s
        wall_s += made_s
    return found


def forget_certificate(folder: Path) -> None:
    """Remove the certificate of an earlier training from a folder that is no run of its own; walks
    of finite elements and new legs stay."""
    if not (folder / SUMMARY).exists():
        for name in (CERTIFICATE_FILE, *(file for file, _ in SHOWN_WORLDS.values())):
            (folder / name).unlink(missing_ok=True)


def set_rounds_aside(folder: Path) -> None:
    """Move new legs of an earlier training's pairs to `earlier`, in the place of all that lay
    there: hours of work, but of other walks. Walks of finite elements stay, and say whose they are;
    so do the leg's own snapshots, which all rounds share.
    """
    rounds, aside = list(folder.glob("round_*")), folder / "earlier"
    if rounds:
        shutil.rmtree(aside, ignore_errors=True)
        aside.mkdir()
    for path in rounds:
        path.replace(aside / path.name)


def nearest_round(rounds: Sequence[CertifiedRound]) -> int:
    """Which round's leg parts least from its finite elements: the last one's where that agrees, of
    others, over the walks that are not chaotic, that of the fewest which did not come to their end
    in both models, of equals that of the least mean difference of the rest, then the later one. One
    whose walks are all chaotic says nothing, and comes last."""

    def parts_by(each: CertifiedRound) -> tuple[float, float]:
        repeating = [walk for pair in each.pairs for walk in pair.full_order if walk.repeats]
        apart = [
            abs(walk.full - walk.reduced)
            for walk in repeating
            if walk.full is not None and walk.reduced is not None
        ]
        unended = len(repeating) - len(apart) if repeating else np.inf
        return unended, float(np.mean(apart)) if apart else np.inf

    last = len(rounds) - 1
    if rounds[last].agrees:
        return last
    return min(range(len(rounds)), key=lambda number: (parts_by(rounds[number]), -number))


def _round_of(found: Certificate, made_s: float) -> CertifiedRound:
    pairs = tuple(
        RoundPair(pair.label, pair.design, pair.gait, pair.full_order) for pair in found.pairs
    )
    walks = [walk for pair in pairs for walk in pair.full_order]
    return CertifiedRound(found.leg, pairs, all(walk.agrees for walk in walks), made_s)


def _of_rounds(
    rounds: Sequence[CertifiedRound], nearest: int, best: str, run: Path, is_file: bool
) -> tuple[str, ...]:
    """How to walk what was certified, where that is not of the run's leg.

    Args:
        rounds: All of them.
        nearest: Which of them was certified.
        best: Label of the best pair.
        run: What files of gaits that were not learned again start from.
        is_file: Whether the robot is one of a file.
    """
    if len(rounds) == 1:
        return ()
    if nearest == 0:
        return ("the bands are of the run's own leg, which parts least from its finite elements",)
    first, chosen = rounds[0], rounds[nearest]
    (pair,) = [each for each in chosen.pairs if each.label == best]
    stayed = pair.gait in [each.gait for each in first.pairs]
    gait = str(run / pair.gait) if stayed else pair.gait
    leg = f"--part {chosen.leg.part}"
    if is_file:
        leg = f"part = {chosen.leg.part!r} of its module in the robot's file,"
    which = "last" if chosen is rounds[-1] else "nearest"
    return (
        f"the bands are of the {which} round's leg: simulate and deploy {best} with {leg} "
        f"--design {pair.design} --gait {gait}",
    )


def _ending(
    rounds: Sequence[CertifiedRound], settings: CertificateSettings, spec: RobotSpec
) -> str | None:
    """Why no further round follows; None where one does."""
    last, limits = rounds[-1], settings.rounds
    if last.agrees:
        known, walked = set(_walk_files(rounds[:-1])), _walk_files(rounds[-1:])
        among = sum(file in known for file in walked)
        told = f"; {among} of the {len(walked)} walks are among the leg's own snapshots"
        return (
            f"reduced robots and finite elements agree, after {len(rounds) - 1} new reductions"
            f"{told if among else ''}"
        )
    walks = {
        (pair.design, pair.gait, walk.world): walk
        for each in rounds
        for pair in each.pairs
        for walk in pair.full_order
    }
    if not any(walk.parts for pair in last.pairs for walk in pair.full_order):
        return (
            "no new reduction: walks that differ are chaotic, or did not come to their end as "
            "finite elements"
        )
    if len(spec.modules) > 1:
        return "no new reduction: the robot has several kinds of modules"
    if len(rounds) > 1 and _walk_files(rounds) == _walk_files(rounds[:-1]):
        return "the two models part still, on walks that the leg was made from: no more can be had"
    if len(rounds) > limits.limit:
        return f"the two models part still: there were {limits.limit} new reductions at most"
    spent_s = sum(each.made_s for each in rounds) + sum(walk.wall_s for walk in walks.values())
    if spent_s >= limits.budget_s:
        return f"the two models part still: {spent_s:.0f} s of {limits.budget_s:.0f} were spent"
    return None


def _walk_files(rounds: Sequence[CertifiedRound]) -> list[str]:
    """Files of the states of all walks so far, each once, from the certificate's folder."""
    walks = (walk for each in rounds for pair in each.pairs for walk in pair.full_order)
    return list(dict.fromkeys(walk.states for walk in walks if walk.states is not None))


def _reduced_again(
    spec: RobotSpec,
    settings: ReduceSettings,
    asked: Mapping[str, Any],
    folder: RunFolder,
    kept: Path,
) -> Reduction:
    """The leg, with all walks so far among its snapshots."""

    def make() -> Reduction:
        with spent_s(folder.path / SPENT_FILE) as earlier_s:
            found = reduce(
                spec,
                folder,
                settings,
                said_of_further(spec),
                further=[kept / file for file in asked["walks"]],
                snapshot_folder=kept / "snapshots",
            )
        return replace(found, wall_s=earlier_s + found.wall_s)

    return study_once(folder, Reduction, asked, make, later=SAID_NOW)


def _tuned_again(
    candidates: Candidates, trained: Trained, spec: RobotSpec, folder: RunFolder
) -> tuple[Candidates, float]:
    """The candidates with gaits of their fine-tuned policies, and the seconds that took."""
    own = RunFolder(folder.path / "learned", "finetune", folder.progress)
    own.progress.stage("fine-tuning the designs on the new leg")
    found = learned_again(trained, spec, candidates.pairs, own)
    limits = (candidates.task.minimum_pressure_kPa, candidates.task.maximum_pressure_kPa)
    pairs = tuple(
        Pair(
            Design.parse(each.design),
            str(own.path / str(each.gait)),
            read_gait(own.path / str(each.gait), *limits)[0],
            each.distance_cm,
            each.achieved,
        )
        for each in found.pairs
    )
    # Where none survived on the new leg, gaits stay as they are.
    return (replace(candidates, pairs=pairs) if pairs else candidates), found.wall_s
