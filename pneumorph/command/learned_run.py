"""What a verb takes over from the folder of a coopt run: its pairs, its task, its robots."""

from __future__ import annotations

import json
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from pneumorph.command.robots import RobotOptions
from pneumorph.command.run_folder import read_settings, read_summary
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.robot.design import Design
from pneumorph.settings import settings_from_dict, settings_to_dict


@dataclass(frozen=True, eq=False)
class LearnedRun:
    """A finished coopt run.

    Attributes:
        folder: The run folder.
        pairs: Its best pairs as its summary tells them, the furthest first.
        designs: The design of each.
        gaits: The gait of each.
        task: The run's own task.
        robot: Its leg and physics, with what the flags changed laid over.
    """

    folder: Path
    pairs: list[dict[str, Any]]
    designs: list[Design]
    gaits: list[HeldGait]
    task: CrawlingTask
    robot: RobotOptions


def run_digest(folder: Path) -> str:
    """Return a digest of a run's settings and best gaits, which tells one training from another."""
    digest = sha256(json.dumps(read_settings(folder), sort_keys=True).encode())
    for pair in read_summary(folder)["pairs"]:
        digest.update((folder / pair["gait"]).read_bytes())
    return digest.hexdigest()[:12]


def read_learned_run(
    folder: Path, asked: RobotOptions, pair_count: int = 5, afresh: bool = False
) -> LearnedRun:
    """Read a coopt run.

    Args:
        folder: The run folder.
        asked: Robots asked for now; what differs from the usual ones replaces the run's.
        pair_count: Most pairs to read.
        afresh: Take what is asked for as it is, and nothing of the run's leg and physics.

    Raises:
        ArtefactError: The folder holds no summary.
        ValueError: The run has no pairs.
    """
    pairs = read_summary(folder).get("pairs")
    if not pairs:
        raise ValueError(f"{folder} holds no design-gait pairs; expected a coopt run")
    pairs = pairs[:pair_count]
    saved = read_settings(folder)
    task = settings_from_dict(CrawlingTask, saved["coopt"]["task"])
    limits = (task.minimum_pressure_kPa, task.maximum_pressure_kPa)
    changed, usual = (settings_to_dict(each) for each in (asked, RobotOptions()))
    return LearnedRun(
        folder,
        pairs,
        [Design.parse(pair["design"]) for pair in pairs],
        [read_gait(folder / pair["gait"], *limits)[0] for pair in pairs],
        task,
        asked
        if afresh
        else settings_from_dict(RobotOptions, _overlaid(saved["robot"], changed, usual)),
    )


def _overlaid(
    saved: dict[str, Any], asked: dict[str, Any], usual: dict[str, Any]
) -> dict[str, Any]:
    """What was saved, but where a flag asks for something unusual."""
    merged = dict(saved)
    for name, value in asked.items():
        if isinstance(value, dict):
            merged[name] = _overlaid(saved.get(name, {}), value, usual[name])
        elif value != usual[name] or name not in saved:
            merged[name] = value
    return merged
