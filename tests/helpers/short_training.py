"""Flags of a training of a few dozen actions and a sweep of one period: every stage, no result."""

from __future__ import annotations

SHORT_SWEEP = ("phase-step-deg 90", "gait.duration-s 4", "record-step-count 10")
"""Of the expert's gait, without their dashes."""
SHORT_TRAINING = (
    "--total-timesteps 48 --environment-count 4 --task.action-step-count 20 "
    "--learning-start-timestep 12 --updates 1 --sac.batch-size 8 --sac.hidden-sizes 8 8 "
    "--schedule.decay-start-timestep 12 --schedule.decay-end-timestep 36 "
    "--evaluated-design-count 4 --kept-pair-count 2 --no-page "
    + " ".join(f"--baseline.{flag}" for flag in SHORT_SWEEP)
)
SHORT_FINETUNING = (
    f"--preset fast --restarts 1 {SHORT_TRAINING} --task.action-count 5 "
    "--checkpoint-interval-timesteps 20 --finetuning.timesteps 20 --finetuning.finalist-count 2"
)
"""The same with fine-tuning."""
