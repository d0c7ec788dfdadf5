"""A whole co-optimisation run in a folder: train, checkpoint, evaluate, write what was found."""

from __future__ import annotations

import json
import math
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pneumorph.base.artefact import read_json, reading, write_json
from pneumorph.base.progress import ProgressReport
from pneumorph.base.result import result_to_dict
from pneumorph.base.settings import differences, settings_from_dict, settings_to_dict
from pneumorph.catalogue.older_names import current_setting
from pneumorph.environment.training_environment import EnvironmentFactory
from pneumorph.learn.checkpoint import (
    KIND,
    Checkpoint,
    has_checkpoint,
    load_checkpoint,
    peek_checkpoint,
    save_checkpoint,
)
from pneumorph.learn.coopt_result import SUMMARY_FILE, CooptResult, KeptPair, SeenPair
from pneumorph.learn.design_gait_pair import BestPairs, DesignGaitPair
from pneumorph.learn.finetuning import FINETUNED_FOLDER, finalists, finetune
from pneumorph.learn.metrics import MetricsLog, read_metrics
from pneumorph.learn.policy_file import save_policy
from pneumorph.learn.pool_files import forget_transitions, keep_transitions, recall_transitions
from pneumorph.learn.restarts import BEST_RESTART, check_kept, go_on_with_best, keep_if_best
from pneumorph.learn.settings import CooptSettings
from pneumorph.learn.training import STAGES, Training

SETTINGS_FILE = "settings.json"
POLICY_FILE = "policy.npz"
GAIT_FOLDER = "gaits"
_NARROW_ENOUGH = 1.0
"""Entropy above its schedule that goes without a word [nat]: some three times as many designs."""
_MADE_ANEW = ("learning_leg", "learning_points")
"""What checkpoints of an earlier version kept of the legs that robots learn on. They follow from
the legs and the settings, but for how a processor rounds: another one could not go on."""


def learn_in_folder(
    make_environment: EnvironmentFactory,
    settings: CooptSettings,
    folder: Path | str,
    *,
    make_judged: EnvironmentFactory | None = None,
    demonstrations: Sequence[DesignGaitPair] = (),
    time_step_s: float = 0.01,
    provenance: Mapping[str, Any] | None = None,
    resume: bool = False,
    wandb_project: str | None = None,
    progress: ProgressReport | None = None,
    say: Callable[[str], None] | None = None,
) -> CooptResult:
    """Run co-optimisation to its end, or go on with a run that was stopped.

    The folder receives ``settings.json``, ``metrics.jsonl``, ``tensorboard/``, the two newest
    checkpoints, and at the end ``policy.npz``, ``finetuned/DESIGN.npz`` for the finalists,
    ``gaits/L1.csv`` ... for the best pairs and ``summary.json``.

    The best pairs are the best of those that were seen in training or in an evaluation and those
    of the finalists' policies without noise, all ranked in the same worlds. With
    ``settings.restarts`` learning begins from nothing so often, and the beginning with the best
    pair is kept: its policy is that of the folder, and is fine-tuned.

    Args:
        make_environment: Makes the environment that the designs live in: `crawling`, or one's own.
        settings: All options; a resumed run must have those it began with.
        folder: The run folder.
        make_judged: Makes the environment that evaluations walk in, see `Training`; None for one
            that is made alike, whatever `settings.learning_modes` and `learning_tolerance` say.
        demonstrations: Gaits that are known, see `Training`; they compete with what is learned. A
            resumed run is to have the same, which `provenance` may say.
        time_step_s: The simulator's time step [s].
        provenance: What else a resumed run must have in common with its beginning, such as the
            physics and the leg; JSON values.
        resume: Go on from the folder's newest checkpoint; begin anew if there is none.
        wandb_project: Project of Weights & Biases to log to as well.
        progress: Told (timesteps done, timesteps in all, message).
        say: Told where a resumed run goes on and what was lost.

    Returns:
        What was found, as in ``summary.json``.

    Raises:
        ValueError: The folder holds a run already and ``resume`` is off, or that run had other
            settings, or its checkpoints are damaged.
    """
    folder = Path(folder)
    if has_checkpoint(folder) and not resume:
        raise ValueError(
            f"{folder} holds a training run already, expected an empty folder; resume it, or "
            "choose another folder"
        )
    training = Training(make_environment, settings, make_judged, demonstrations)
    earlier_s, remarks = _begin(training, folder, provenance or {})
    if say is not None:
        for remark in remarks:
            say(remark)
    started = time.perf_counter() - earlier_s
    log = MetricsLog(folder, training.timestep, wandb_project)
    try:
        _train(training, folder, log, started, remarks, provenance or {}, progress)
    finally:
        log.close()
    if progress is not None:
        progress(training.timestep, training.timestep, "evaluating the best designs")
    evaluated = training.evaluate()
    shown = training.evaluate_shown()
    remarks = [*remarks, *_of_narrowing(training)]
    result = _result(training, evaluated, time.perf_counter() - started, remarks)
    save_policy(
        folder / POLICY_FILE,
        training.learned.state.policy,
        settings,
        timestep=training.timestep,
        time_step_s=time_step_s,
    )
    pairs = training.best.pairs
    if settings.finetuning.timesteps:
        designs = finalists(training, [*evaluated, *shown])
        finetuned = finetune(
            training, designs, folder, folder / FINETUNED_FOLDER, time_step_s, progress
        )
        # A policy that learned on may have become worse, with one design as with the other.
        best = BestPairs(
            training.space, settings.kept_pair_count, training.environment.is_symmetric
        )
        best.offer([*pairs, *finetuned.pairs])
        pairs = best.pairs
        walked = result.evaluation_timesteps
        if walked is not None:
            walked += finetuned.evaluation_timesteps
        result = replace(
            result,
            pairs=_kept(training, pairs),
            finetuning_timesteps=finetuned.timesteps,
            finetuning_wall_s=finetuned.wall_s,
            evaluation_timesteps=walked,
        )
    result = replace(result, remarks=(*result.remarks, *_of_shown(training, shown, pairs)))
    action_s = settings.task.action_s(time_step_s)
    for pair, said in zip(pairs, result.pairs, strict=True):
        pair.write(folder / said.gait, training.space[pair.design], action_s, settings.task)
    write_json(folder / SUMMARY_FILE, result_to_dict(result))
    return result


def _begin(
    training: Training, folder: Path, provenance: Mapping[str, Any]
) -> tuple[float, list[str]]:
    """Begin, or go on with the newest checkpoint: seconds spent before it, and remarks."""
    if has_checkpoint(folder):
        return _restore(training, folder, provenance)
    remarks = _lost(folder, 0)
    if remarks and not _is_of(folder, training.settings):
        remarks = [
            "began anew: a training with other settings had stopped here before a checkpoint"
        ]
    # Policies of a training whose checkpoints are gone are not this one's.
    shutil.rmtree(folder / FINETUNED_FOLDER, ignore_errors=True)
    forget_transitions(folder)
    for name in (BEST_RESTART, SUMMARY_FILE):
        (folder / name).unlink(missing_ok=True)
    write_json(folder / SETTINGS_FILE, settings_to_dict(training.settings))
    return 0.0, remarks


def _is_of(folder: Path, settings: CooptSettings) -> bool:
    """Whether what stopped in a folder before its first checkpoint had these settings."""
    file = folder / SETTINGS_FILE
    try:
        # Read as settings: one that is newer than the file had its default.
        return settings_from_dict(CooptSettings, read_json(file, "JSON")) == settings
    except (FileNotFoundError, ValueError):
        return False


def refuse_other_settings(
    settings: CooptSettings, folder: Path | str, provenance: Mapping[str, Any]
) -> None:
    """Refuse to go on in a folder whose training has other settings; does nothing without one.

    Args:
        settings: All options.
        folder: The run folder.
        provenance: As `learn_in_folder` takes it.

    Raises:
        ValueError: It has another task or other settings, or its checkpoints are damaged.
    """
    if has_checkpoint(Path(folder)):
        _refuse_changes(load_checkpoint(Path(folder)), settings, Path(folder), provenance)


def refuse_other_task(folder: Path | str, own_task: str | None) -> None:
    """Refuse to go on in a folder whose training is of another task; does nothing without one that
    can be read.

    Args:
        folder: The run folder.
        own_task: What a task of one's own is called; None for the package's.

    Raises:
        ValueError: It is of another one.
    """
    if (checkpoint := peek_checkpoint(folder)) is not None:
        refuse_task(folder, checkpoint.metadata["provenance"].get("environment"), own_task)


def refuse_task(folder: Path | str, theirs: str | None, ours: str | None) -> None:
    """Refuse another task than that of a training: the name of each that is one's own, else None.

    Raises:
        ValueError: They differ; says how to go on.
    """
    if theirs == ours:
        return
    usual = "the package's task"
    way = (
        f"pass that task to pm.train, own_task={theirs}, since no file of the run holds it"
        if theirs is not None
        else "leave out own_task"
    )
    raise ValueError(
        f"{folder} holds a training with own_task {theirs}, expected {ours}: it was trained on "
        f"{usual if theirs is None else f'the task {theirs}'}, and "
        f"{usual if ours is None else ours} is asked for; {way}, or choose another folder"
    )


def _refuse_changes(
    checkpoint: Checkpoint, settings: CooptSettings, folder: Path, provenance: Mapping[str, Any]
) -> None:
    kept = checkpoint.metadata["provenance"]
    refuse_task(folder, kept.get("environment"), provenance.get("environment"))
    # Read as settings: one that is newer than the checkpoint had its default.
    with reading(checkpoint.path, KIND):
        theirs = settings_from_dict(CooptSettings, checkpoint.metadata["settings"])
    apart = differences(settings_to_dict(theirs), settings_to_dict(settings))
    kept = {name: value for name, value in kept.items() if name not in _MADE_ANEW}
    for name, before, now in differences(kept, _as_json(provenance)):
        apart.append((current_setting(name), before, now))
    changed = [f"{name} {before!r}, now {now!r}" for name, before, now in apart]
    if changed:
        raise ValueError(
            f"{folder} was trained with other settings ({'; '.join(changed)}), expected the same; "
            "resume with the settings in its settings.json, or choose another folder"
        )


def _restore(
    training: Training, folder: Path, provenance: Mapping[str, Any]
) -> tuple[float, list[str]]:
    """Take over the newest checkpoint; return the seconds spent before it, and remarks."""
    checkpoint = load_checkpoint(folder)
    _refuse_changes(checkpoint, training.settings, folder, provenance)
    recall_transitions(training, folder, checkpoint)
    training.take_over(checkpoint)
    check_kept(training, folder)
    remarks = list(checkpoint.metadata["remarks"])
    if checkpoint.remark is not None:
        remarks.append(checkpoint.remark)
    remarks += _lost(folder, training.timestep) or [f"resumed at timestep {training.timestep}"]
    return float(checkpoint.metadata["wall_s"]), remarks


def _lost(folder: Path, timestep: int) -> list[str]:
    """A remark where the metrics go on after the timestep that training goes on from."""
    lost = max((line["timestep"] for line in read_metrics(folder)), default=timestep) - timestep
    if lost <= 0:
        return []
    how = f"resumed at timestep {timestep}" if timestep else "began again"
    return [f"{how}: {lost} timesteps after the last checkpoint were lost and are made again"]


def _as_json(values: Mapping[str, Any]) -> dict[str, Any]:
    # As they come back from a checkpoint: tuples are lists there.
    copy: dict[str, Any] = json.loads(json.dumps(values))
    return copy


def _train(
    training: Training,
    folder: Path,
    log: MetricsLog,
    started: float,
    remarks: list[str],
    provenance: Mapping[str, Any],
    progress: ProgressReport | None,
) -> None:
    settings = training.settings
    total = settings.training_timesteps
    write = training.clock.timed("log", log.write)
    save = training.clock.timed("log", save_checkpoint)
    saved = training.timestep

    def metadata() -> dict[str, Any]:
        return {
            **training.metadata(),
            "settings": settings_to_dict(settings),
            "provenance": _as_json(provenance),
            "wall_s": time.perf_counter() - started,
            "remarks": remarks,
        }

    while not training.is_finished:
        if training.is_restart_over:
            keep_if_best(training, folder, metadata())
            keep_transitions(training, folder)
            training.begin_again()
        before = training.timestep
        metrics = training.run_round()
        if _passed(settings.evaluation_interval_timesteps, before, training.timestep):
            evaluated = training.evaluate()
            if evaluated:
                metrics["evaluated_distance_cm"] = evaluated[0].distance_cm
        write({**metrics, "wall_s": time.perf_counter() - started})
        # Before the round that would go beyond the interval: no more than it is ever lost.
        after_next = training.timestep + settings.timesteps_per_round - saved
        if training.is_restart_over or after_next > settings.checkpoint_interval_timesteps:
            save(folder, training.arrays(), metadata())
            saved = training.timestep
        if progress is not None:
            progress(training.timestep, total, _said(training))
    if 1 < settings.restarts > len(training.restart_scores_cm):
        keep_if_best(training, folder, metadata())
        go_on_with_best(training, folder)
        save(folder, training.arrays(), metadata())
    forget_transitions(folder)


def _said(training: Training) -> str:
    """How far a training is, for a person."""
    restarts, best = training.settings.restarts, training.best.best_achieved
    which = "" if restarts == 1 else f" {training.restart + 1} of {restarts}"
    said = "" if best is None else f", best {training.settings.task.goal.said(best)}"
    return f"training{which}{said}"


def _of_narrowing(training: Training) -> list[str]:
    """What to tell of a choice of designs that stayed wider than its schedule."""
    distribution, schedule = training.learned.distribution, training.settings.schedule
    wanted, found = distribution.target_entropy(training.learned_timesteps), distribution.entropy
    if found <= wanted + _NARROW_ENOUGH:
        return []
    return [
        f"the choice of designs did not narrow: some {math.exp(found):.0f} of them are left and "
        f"not {math.exp(wanted):.0f}, because their scores differ by too little for "
        f"schedule.maximum_inverse_temperature, {schedule.maximum_inverse_temperature:g} per cm: "
        "raise it, or the weight of what the reward counts"
    ]


def _passed(interval: int, before: int, after: int) -> bool:
    """Whether a multiple of the interval lies in (before, after]; an interval of 0 has none."""
    return interval > 0 and after // interval > before // interval


def _result(
    training: Training,
    evaluated: Sequence[DesignGaitPair],
    wall_s: float,
    remarks: Sequence[str],
) -> CooptResult:
    """What was found where nothing is fine-tuned."""
    policy_best = evaluated[0] if evaluated else None
    return CooptResult(
        policy_best_design=str(training.space[policy_best.design]) if policy_best else None,
        policy_best_distance_cm=policy_best.distance_cm if policy_best else None,
        pairs=_kept(training, training.best.pairs),
        seen_pairs=tuple(_seen(training, pair) for pair in training.best.pairs),
        timesteps=training.timestep,
        finetuning_timesteps=0,
        update_count=training.update_count,
        failed_episode_count=training.failure_count,
        seed=training.settings.seed,
        wall_s=wall_s,
        **{f"{stage}_s": training.clock.seconds[stage] for stage in STAGES},
        finetuning_wall_s=None,
        remarks=tuple(remarks),
        restart_scores_cm=tuple(training.restart_scores_cm),
        evaluation_timesteps=training.ranking.timesteps,
    )


def _of_shown(
    training: Training, shown: Sequence[DesignGaitPair], pairs: Sequence[DesignGaitPair]
) -> list[str]:
    """Remarks on the gaits that were shown."""
    walked = {pair.design for pair in shown}
    fell = {pair.design for pair in training.demonstrations} - walked
    remarks = [
        f"{training.space[design]}: no walk of a gait shown came to its end"
        for design in sorted(fell)
    ]
    if pairs and pairs[0].source == "demonstration":
        remarks.append(f"{training.space[pairs[0].design]}: no gait scores higher than one shown")
    return remarks


def _kept(training: Training, pairs: Sequence[DesignGaitPair]) -> tuple[KeptPair, ...]:
    return tuple(
        KeptPair(**vars(_seen(training, pair)), gait=f"{GAIT_FOLDER}/L{rank}.csv")
        for rank, pair in enumerate(pairs, start=1)
    )


def _seen(training: Training, pair: DesignGaitPair) -> SeenPair:
    return SeenPair(
        str(training.space[pair.design]),
        pair.distance_cm,
        pair.score_cm,
        pair.source,
        pair.timestep,
        achieved=pair.achieved,
    )
