"""A whole co-optimisation run in a folder: train, checkpoint, evaluate, write what was found."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneumorph.artefact import write_json
from pneumorph.coopt.checkpoint import has_checkpoint, load_checkpoint, save_checkpoint
from pneumorph.coopt.metrics import MetricsLog
from pneumorph.coopt.policy_file import save_policy
from pneumorph.coopt.settings import CooptSettings
from pneumorph.coopt.training import Training
from pneumorph.environment.crawling_simulator import RobotBuilder, SimulatorFactory
from pneumorph.gait.gait_file import write_gait
from pneumorph.gait.walk import Progress
from pneumorph.settings import settings_to_dict

SETTINGS_FILE = "settings.json"
SUMMARY_FILE = "summary.json"
POLICY_FILE = "policy.npz"
GAIT_FOLDER = "gaits"


def cooptimise(
    build_robot: RobotBuilder,
    make_simulator: SimulatorFactory,
    settings: CooptSettings,
    folder: Path | str,
    *,
    time_step_s: float = 0.01,
    provenance: Mapping[str, Any] | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Run co-optimisation to its end, or go on with a run that was stopped.

    The folder receives ``settings.json``, ``metrics.jsonl``, ``tensorboard/``, the two newest
    checkpoints, and at the end ``policy.npz``, ``gaits/L1.csv`` ... for the best pairs and
    ``summary.json``.

    Args:
        build_robot: Turns a design into a robot of the simulator.
        make_simulator: Makes the simulator of a list of robots.
        settings: All options; a resumed run must have those it began with.
        folder: The run folder.
        time_step_s: The simulator's time step [s].
        provenance: What else a resumed run must have in common with its beginning, such as the
            physics and the leg; JSON values.
        resume: Go on from the folder's newest checkpoint; begin anew if there is none.
        progress: Told (timesteps done, timesteps in all, message).

    Returns:
        The summary, as in ``summary.json``.

    Raises:
        ValueError: The folder holds a run already and ``resume`` is off, or that run had other
            settings.
    """
    folder = Path(folder)
    if has_checkpoint(folder) and not resume:
        raise ValueError(
            f"{folder} holds a training run already, expected an empty folder; resume it, or "
            "choose another folder"
        )
    training = Training(build_robot, make_simulator, settings)
    earlier_s = 0.0
    remarks: list[str] = []
    if has_checkpoint(folder):
        earlier_s, remarks = _restore(training, folder, provenance or {})
    else:
        write_json(folder / SETTINGS_FILE, settings_to_dict(settings))
    started = time.perf_counter() - earlier_s
    log = MetricsLog(folder, training.timestep)
    try:
        _train(training, folder, log, started, remarks, provenance or {}, progress)
    finally:
        log.close()
    if progress is not None:
        progress(training.timestep, training.timestep, "evaluating the best designs")
    evaluated = training.evaluate()
    save_policy(folder / POLICY_FILE, training.state.policy, settings, timestep=training.timestep)
    action_s = settings.task.action_step_count * time_step_s
    for rank, pair in enumerate(training.best.pairs, start=1):
        comments = {
            "design": str(training.space[pair.design]),
            "distance_cm": f"{pair.distance_cm:.3f}",
            "source": pair.source,
        }
        write_gait(
            folder / GAIT_FOLDER / f"L{rank}.csv", pair.gait(action_s, settings.task), comments
        )
    summary = _summary(training, evaluated, time.perf_counter() - started, remarks)
    write_json(folder / SUMMARY_FILE, summary)
    return summary


def _restore(
    training: Training, folder: Path, provenance: Mapping[str, Any]
) -> tuple[float, list[str]]:
    """Take over the newest checkpoint; return the seconds spent before it, and remarks."""
    checkpoint = load_checkpoint(folder)
    theirs, ours = checkpoint.metadata["settings"], settings_to_dict(training.settings)
    changed = _differences(theirs, ours, "")
    changed += _differences(checkpoint.metadata["provenance"], _as_json(provenance), "")
    if changed:
        raise ValueError(
            f"{folder} was trained with other settings ({'; '.join(changed)}), expected the same; "
            "resume with the settings in its settings.json, or choose another folder"
        )
    training.restore(checkpoint.arrays, checkpoint.metadata)
    remarks = list(checkpoint.metadata["remarks"])
    if checkpoint.remark is not None:
        remarks.append(checkpoint.remark)
    remarks.append(f"resumed at timestep {training.timestep}")
    return float(checkpoint.metadata["wall_s"]), remarks


def _as_json(values: Mapping[str, Any]) -> dict[str, Any]:
    # As they come back from a checkpoint: tuples are lists there.
    copy: dict[str, Any] = json.loads(json.dumps(values))
    return copy


def _differences(theirs: Any, ours: Any, name: str) -> list[str]:
    """What two nested settings differ in, one line each."""
    if isinstance(theirs, Mapping) and isinstance(ours, Mapping):
        names = sorted({*theirs, *ours})
        return [
            line
            for key in names
            for line in _differences(theirs.get(key), ours.get(key), f"{name}.{key}".lstrip("."))
        ]
    return [] if theirs == ours else [f"{name} {theirs!r}, now {ours!r}"]


def _train(
    training: Training,
    folder: Path,
    log: MetricsLog,
    started: float,
    remarks: list[str],
    provenance: Mapping[str, Any],
    progress: Progress | None,
) -> None:
    settings = training.settings
    total = settings.round_count * settings.timesteps_per_round
    while not training.is_finished:
        before = training.timestep
        metrics = training.run_round()
        if _passed(settings.evaluation_interval_timesteps, before, training.timestep):
            evaluated = training.evaluate()
            if evaluated:
                metrics["evaluated_distance_cm"] = evaluated[0].distance_cm
        wall_s = time.perf_counter() - started
        log.write({**metrics, "wall_s": wall_s})
        if training.is_finished or _passed(
            settings.checkpoint_interval_timesteps, before, training.timestep
        ):
            metadata = {
                **training.metadata(),
                "settings": settings_to_dict(settings),
                "provenance": _as_json(provenance),
                "wall_s": wall_s,
                "remarks": remarks,
            }
            save_checkpoint(folder, training.arrays(), metadata)
        if progress is not None:
            best = training.best.best_distance_cm
            message = "training" if best is None else f"training, best {best:.1f} cm"
            progress(training.timestep, total, message)


def _passed(interval: int, before: int, after: int) -> bool:
    """Whether a multiple of the interval lies in (before, after]; an interval of 0 has none."""
    return interval > 0 and after // interval > before // interval


def _summary(
    training: Training, evaluated: list[Any], wall_s: float, remarks: list[str]
) -> dict[str, Any]:
    pairs = [
        {
            "design": str(training.space[pair.design]),
            "distance_cm": pair.distance_cm,
            "source": pair.source,
            "timestep": pair.timestep,
            "gait": f"{GAIT_FOLDER}/L{rank}.csv",
        }
        for rank, pair in enumerate(training.best.pairs, start=1)
    ]
    policy_best = evaluated[0] if evaluated else None
    return {
        "best_design": pairs[0]["design"] if pairs else None,
        "best_distance_cm": pairs[0]["distance_cm"] if pairs else None,
        "best_gait": pairs[0]["gait"] if pairs else None,
        "best_source": pairs[0]["source"] if pairs else None,
        "policy_best_design": str(training.space[policy_best.design]) if policy_best else None,
        "policy_best_distance_cm": policy_best.distance_cm if policy_best else None,
        "pairs": pairs,
        "timesteps": training.timestep,
        "update_count": training.update_count,
        "failed_episode_count": training.failure_count,
        "wall_s": wall_s,
        "simulate_s": training.seconds["simulate"],
        "learn_s": training.seconds["learn"],
        "seed": training.settings.seed,
        "remarks": remarks,
    }
