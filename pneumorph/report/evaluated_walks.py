"""The walks that an evaluation recorded, side by side on a page."""

from __future__ import annotations

from pathlib import Path

from pneumorph.report.replay.page import write_side_by_side
from pneumorph.study.evaluation import REPLAY_PAGE, Evaluation, trajectory_file
from pneumorph.study.recorded_walk import Model


def write_evaluated_walks(found: Evaluation, model: Model, folder: Path) -> None:
    """Write the page that replays them.

    Args:
        found: The evaluation.
        model: Of the robots that walked.
        folder: Its folder, which has the trajectories and receives the page.
    """
    walks = {
        f"L{rank} {pair.design}": folder / trajectory_file(model, rank)
        for rank, pair in enumerate(found.pairs, start=1)
    }
    write_side_by_side(folder / REPLAY_PAGE, walks, str(folder), found.goal)
