"""What is kept of a coopt run: its small files, in a folder that verbs take as they take the run's.

Checkpoints with their replay buffers are hundreds of megabytes. Settings, summary, metrics, best
gaits and the trained policy are one, and enough to evaluate, analyse, replay or deploy what was
found, and to compare other searches with it.
"""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

from pneumorph.base.artefact import write_atomically, write_json, write_text
from pneumorph.base.result import result_to_dict
from pneumorph.base.run_folder import SETTINGS, SUMMARY, TRAINING_FOLDER
from pneumorph.learn.cooptimise import GAIT_FOLDER, POLICY_FILE
from pneumorph.learn.metrics import METRICS_FILE, read_metrics
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_result import TrainingResult

DIGITS = 5
"""Digits of the metrics that are kept."""


def keep_run(run: Path, folder: Path) -> TrainingResult:
    """Copy the small files of a finished coopt run.

    Args:
        run: The run's folder.
        folder: Receives ``settings.json``, ``summary.json``, ``gaits/``, ``training/metrics.jsonl``
            and ``training/policy.npz``; those of an earlier run are replaced.

    Returns:
        What the run found, as it is kept: its pairs name the gaits in ``folder``.

    Raises:
        ArtefactError: The folder holds no finished training, or it is damaged.
        ValueError: The run has no pairs, or is to be kept in its own folder or inside of it.
        FileNotFoundError: The run lacks its policy or a gait; nothing is replaced.
    """
    learned = FinishedRun.read(run)
    found = learned.result(TrainingResult)
    if not found.pairs:
        raise ValueError(f"{run} holds no design-gait pairs; expected a coopt run")
    if run.resolve() == folder.resolve():
        raise ValueError(f"{folder} is the run itself, expected another folder to keep it in")
    if folder.resolve().is_relative_to(run.resolve()):
        raise ValueError(
            f"{folder} is inside the run, expected a folder outside of {run}: it would replace "
            "files of the run itself"
        )
    policy = (run / TRAINING_FOLDER / POLICY_FILE).read_bytes()
    gaits = [
        (run / learned.of_summary(f"pairs.{place}.gait", str)).read_bytes()
        for place in range(len(found.pairs))
    ]
    metrics = read_metrics(run / TRAINING_FOLDER)
    shutil.rmtree(folder / GAIT_FOLDER, ignore_errors=True)
    for name in (GAIT_FOLDER, TRAINING_FOLDER):
        (folder / name).mkdir(parents=True, exist_ok=True)
    pairs = []
    for rank, (pair, content) in enumerate(zip(found.pairs, gaits, strict=True), start=1):
        gait = f"{GAIT_FOLDER}/L{rank}.csv"
        (folder / gait).write_bytes(content)
        pairs.append(replace(pair, gait=gait))
    lines = "".join(json.dumps(_rounded(line)) + "\n" for line in metrics)
    training = folder / TRAINING_FOLDER
    write_text(training / METRICS_FILE, lines)
    write_atomically(training / POLICY_FILE, lambda stream: stream.write(policy))
    write_json(folder / SETTINGS, learned.settings)
    kept = replace(found, best_gait=pairs[0].gait, pairs=tuple(pairs))
    write_json(folder / SUMMARY, {**learned.summary, **result_to_dict(kept)})
    return kept


def _rounded(value: Any) -> Any:
    """The same with numbers of few digits."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
