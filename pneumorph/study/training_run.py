"""Design and gait learned together in a run folder, beside the expert's."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import ArtefactError, read_json
from pneumorph.base.run_folder import TRAINING_FOLDER, RunFolder
from pneumorph.catalogue.part_physics import physics_of_part
from pneumorph.catalogue.robot_identity import reduction_digest, resume_identity
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.worlds_check import check_worlds
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.reward_term import RewardTerm
from pneumorph.environment.training_environment import (
    TaskWrapper,
)
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.learn.checkpoint import has_checkpoint
from pneumorph.learn.coopt_result import SUMMARY_FILE, CooptResult
from pneumorph.learn.cooptimise import learn_in_folder, refuse_other_settings, refuse_other_task
from pneumorph.learn.design_gait_pair import DesignGaitPair
from pneumorph.learn.environments import state_size
from pneumorph.learn.settings import CooptSettings
from pneumorph.robot.design import Design
from pneumorph.study.baseline import BestPhase, swept
from pneumorph.study.certified_candidates import Candidates, CertificateSettings
from pneumorph.study.certified_rounds import (
    CERTIFICATE_FILE,
    CERTIFICATE_FOLDER,
    Again,
    certify_candidates,
    forget_certificate,
    set_rounds_aside,
)
from pneumorph.study.checked_designs import check_designs
from pneumorph.study.learned_again import Trained
from pneumorph.study.learning_robots import learning_and_judged, learning_robots
from pneumorph.study.own_task import OwnTask, environments_of, keeps_usual_reward, task_name
from pneumorph.study.recorded_walk import recorded_walk
from pneumorph.study.reduce_settings import ReduceSettings, from_walks
from pneumorph.study.robustness import KEPT_WALKS
from pneumorph.study.shown_gaits import digests_of_shown
from pneumorph.study.toppled_note import walk_notes
from pneumorph.study.training_result import TrainingResult, fields_of_learned, ranked_by
from pneumorph.study.training_worlds import TrainingWorlds
from pneumorph.trajectory import Trajectory

BEST_TRAJECTORY_FILE = "best_trajectory.npz"


def run_training(
    settings: CooptSettings,
    folder: RunFolder,
    spec: RobotSpec,
    *,
    baseline: PhaseSweepSettings,
    worlds: TrainingWorlds | None = None,
    certificate: CertificateSettings | None = None,
    reduction: ReduceSettings | None = None,
    resume: bool = False,
    wandb_project: str | None = None,
    own_task: OwnTask | None = None,
    demonstrations: Sequence[DesignGaitPair] = (),
) -> TrainingResult:
    """Sweep the baseline, train, replay the best pair, and return what was found.

    Args:
        settings: The learner, its task and its design space.
        folder: Where everything is written.
        spec: What the robots are.
        baseline: The expert's gaits to compare with.
        worlds: Worlds to train in; None for one.
        certificate: Unseen worlds that the best pairs are certified in at the end; None for none.
        reduction: How the leg is reduced again where the certificate asks for that; None for the
            way of its physics.
        resume: Go on from the newest checkpoint in the folder.
        wandb_project: Project of Weights & Biases to log to besides TensorBoard.
        own_task: Turns the environment of the robots into one of another task, such as a
            `TaskWrapper`; None for the task of the settings.
        demonstrations: Gaits that learning is shown, see `Training`.

    Raises:
        ValueError: The folder holds a training already, designs, task, robot and worlds do not go
            together (as of `check_designs`), designs walk in another number of worlds than are
            drawn, or the environment is none for these settings.
    """
    start = time.monotonic()
    name = None if own_task is None else task_name(own_task)
    by_goal = keeps_usual_reward(own_task) or settings.sided_reward
    checked = _check(settings, spec, folder, resume, worlds, baseline, certificate, by_goal)
    if settings.space.symmetries and not by_goal:
        folder.progress.say(
            f"{name} is taken to reward designs alike that count as one by designs.same of the "
            "robot's file or space.symmetries: only you know whether its step does"
        )
    drawn = {} if worlds is None else {"randomisation": worlds.as_dict()}
    shown = digests_of_shown(demonstrations, settings)
    provenance = {
        "simulation": spec.settings,
        "leg": reduction_digest(spec),
        **resume_identity(spec, None if worlds is None else worlds.randomisation),
        **drawn,
        **({} if name is None else {"environment": name}),
        **({"shown": shown} if shown else {}),
    }
    # Before any robot walks, and the baseline of other settings is written over that of the run.
    training = folder.path / TRAINING_FOLDER
    if own_task is None:
        refuse_other_settings(settings, training, provenance)
    else:  # its terms are known once it is made
        refuse_other_task(training, name)
    learning = learning_robots(spec, settings, folder.progress)
    make_environments, make_judged = learning_and_judged(
        lambda robots: environments_of(settings, robots, worlds, own_task), spec, learning
    )
    terms: tuple[RewardTerm, ...] = ()
    if own_task is not None:  # what does not fit is told before the baseline walks
        made = make_environments(settings.space.some(settings.environment_count))
        terms = made.all_terms if isinstance(made, TaskWrapper) else ()
        if settings.mirrored_scores and not terms:
            folder.progress.say(
                f"{name} is taken to reward a robot and its mirror image alike; where it rewards a "
                "side, set is_symmetric = False in it, and mirror_transitions to false"
            )
        state_size(made, settings)
        if terms:  # each tells what it finds wrong
            made.reset()
            made.step(np.zeros((made.num_envs, settings.task.regulator_count), np.float32))
        provenance |= {"terms": [term.said for term in terms]} if terms else {}
        refuse_other_settings(settings, training, provenance)
    expert = swept(spec, baseline, folder, settings.task.goal)
    folder.progress.stage("learning design and gait together")
    swept_s = time.monotonic() - start
    known = _told_pairs(training)
    learned = learn_in_folder(
        make_environments,
        settings,
        folder.path / TRAINING_FOLDER,
        make_judged=make_judged,
        demonstrations=demonstrations,
        time_step_s=spec.physics.time_step_s,
        provenance=provenance,
        resume=resume,
        wandb_project=wandb_project,
        progress=folder.progress,
        say=folder.progress.say,
    )
    start = time.monotonic()
    anew = known != _told_pairs(training)
    if anew and certificate is not None and certificate.full:
        # Before all else: a process that stops here and goes on no longer knows the earlier pairs.
        set_rounds_aside(folder.path / CERTIFICATE_FOLDER)
    replayed = _replay_best(spec, learned, settings.task, folder)
    certified = None
    if certificate is not None and learned.pairs:
        drawn_from = None if worlds is None else worlds.randomisation
        found = Candidates.of_training(
            learned.pairs, folder.path, settings, baseline, drawn_from, certificate, name
        )
        again = Again(reduction or from_walks(physics_of_part(spec.modules[0].reduced)))
        if settings.finetuning.timesteps and name is None:
            trained = Trained(folder.path / TRAINING_FOLDER, settings, worlds)
            again = replace(again, trained=trained)
        own = folder
        if certificate.full:
            own = RunFolder(folder.path / CERTIFICATE_FOLDER, "certify", folder.progress)
        certified = certify_candidates(found, certificate, spec, own, again)
        folder.keep_until_summary(own.path / KEPT_WALKS)
    if certified is None or not certified.rounds:
        certificate_folder = folder.path / CERTIFICATE_FOLDER
        # One with finite elements, of hours, is of these very pairs where nothing was learned here.
        if anew or not _has_rounds(certificate_folder):
            forget_certificate(certificate_folder)
    # Learning counts what earlier processes spent on it before this one went on.
    learned_s = learned.wall_s + (learned.finetuning_wall_s or 0.0)
    return TrainingResult(
        **vars(expert),
        **fields_of_learned(learned),
        replayed_distance_cm=None if replayed is None else replayed.distance_cm,
        replayed_achieved=None if replayed is None else settings.task.goal.achieved(replayed),
        **spec.describe(),
        seed=settings.seed,
        wall_s=swept_s + learned_s + time.monotonic() - start,
        randomisation=drawn.get("randomisation"),
        ranked_by=ranked_by(settings, name, terms),
        own_task=name,
        certificate=certified,
        shown=tuple(shown),
        notes=(
            *checked,
            *learned.remarks,
            *_untaught(learned, settings),
            *_range_notes(expert, replayed),
            *(() if certified is None else certified.notes),
        ),
    )


def _told_pairs(training: Path) -> list[Any] | None:
    """What a training folder says of its best pairs; None where it has not ended or is damaged."""
    with suppress(ArtefactError, FileNotFoundError, KeyError, TypeError):
        names = ("design", "gait", "timestep", "distance_cm")
        pairs = read_json(training / SUMMARY_FILE, "JSON")["pairs"]
        return [[pair[name] for name in names] for pair in pairs]
    return None


def _has_rounds(folder: Path) -> bool:
    """Whether a folder has a certificate with finite elements."""
    with suppress(ArtefactError, FileNotFoundError, KeyError, TypeError):
        return bool(read_json(folder / CERTIFICATE_FILE, "JSON")["rounds"])
    return False


def _too_short(settings: CooptSettings) -> list[str]:
    """What of its settings a training is too short for, told before it begins."""
    timesteps, notes = settings.restart_timesteps, []
    if timesteps <= settings.learning_start_timestep:
        notes.append(
            f"nothing will be learned: there are {timesteps} timesteps, and learning_start_timestep"
            f" is {settings.learning_start_timestep}"
        )
    schedule, objective = settings.schedule, settings.objective
    if timesteps < schedule.decay_end_timestep and schedule.final_entropy < math.log(
        len(settings.space)
    ):
        notes.append(
            f"designs will not be narrowed to the end: there are {timesteps} timesteps, and "
            f"schedule.decay_end_timestep is {schedule.decay_end_timestep}"
        )
    if objective.is_robust and timesteps <= objective.nominal_until_timestep:
        notes.append(
            f"robots will learn in the nominal world alone: there are {timesteps} timesteps, and "
            f"objective.nominal_until_timestep is {objective.nominal_until_timestep}"
        )
    return notes


def _untaught(learned: CooptResult, settings: CooptSettings) -> list[str]:
    """What to tell of a training that ended before its policy learned anything."""
    if learned.update_count:
        return []
    return [
        f"nothing was learned: {learned.timesteps} timesteps are not more than "
        f"learning_start_timestep, {settings.learning_start_timestep}, until which actions are "
        "drawn at random"
    ]


def _range_notes(expert: BestPhase, replayed: Trajectory | None) -> list[str]:
    """What to tell of the expert's robot and of the best pair's, in the world as it stands."""
    if replayed is None:
        return [*expert.expert_notes]
    ratio, lean_deg = replayed.metadata.get("range_ratio"), float(replayed.lean_deg.max())
    return [*expert.expert_notes, *walk_notes("The best pair's robot", ratio, lean_deg)]


def _check(
    settings: CooptSettings,
    spec: RobotSpec,
    folder: RunFolder,
    resume: bool,
    worlds: TrainingWorlds | None,
    baseline: PhaseSweepSettings,
    certificate: CertificateSettings | None,
    by_goal: bool,
) -> tuple[str, ...]:
    wanted, drawn = settings.objective.worlds_per_design, worlds.world_count if worlds else 1
    if wanted > 1 and wanted != drawn:
        raise ValueError(
            f"objective.worlds_per_design is {wanted} and {drawn} worlds are drawn for a round, "
            "expected as many; without --randomize there is one"
        )
    notes = check_designs(
        spec,
        settings.space,
        settings.task,
        folder.progress.say,
        worlds=None if worlds is None else worlds.randomisation,
        expert_kPa=2.0 * baseline.gait.amplitude_kPa,
        by_goal=by_goal,
        sided_reward=settings.sided_reward,
    )
    if certificate is not None:
        check_worlds(spec, certificate.randomisation)
    if (single := _of_single_worlds(wanted, drawn)) is not None:
        folder.progress.say(single)
        notes = (*notes, single)
    _ = spec.assembly(baseline.design)
    Design.parse(baseline.design).check_regulators(baseline.gait.regulator_count)
    for short in _too_short(settings):
        folder.progress.say(short)
    if has_checkpoint(folder.path / TRAINING_FOLDER) and not resume:
        raise ValueError(
            f"{folder.path} holds a training run already; go on with --resume, or choose another "
            "--out"
        )
    return notes


def _of_single_worlds(worlds_per_design: int, drawn: int) -> str | None:
    """What to tell where designs are ranked by a walk in one world, which is not the others'."""
    if worlds_per_design > 1 or drawn == 1:
        return None
    return (
        f"each design walks in one of {drawn} drawn worlds, and not all in the same: whose world "
        "was kind ranks first, so distances of the best are better than they would be; "
        "objective.worlds_per_design = 4 ranks designs by the same worlds"
    )


def _replay_best(
    spec: RobotSpec, learned: CooptResult, task: CrawlingTask, folder: RunFolder
) -> Trajectory | None:
    """Walk the best pair's gait file once more, and record it."""
    if learned.best is None:
        return None
    folder.progress.stage("recording the best pair")
    gait, _ = read_gait(
        folder.path / TRAINING_FOLDER / learned.best.gait,
        task.minimum_pressure_kPa,
        task.maximum_pressure_kPa,
    )
    trajectory = recorded_walk(
        spec,
        Design.parse(learned.best.design),
        gait,
        settling_steps=task.settling_step_count,
        description={"gait": learned.best.gait},
    )
    trajectory.with_skin_only().save(folder / BEST_TRAJECTORY_FILE)
    return trajectory
