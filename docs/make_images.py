"""Draw the pictures of the README and the docs from a finished demo run.

pneumorph demo --out runs/demo && python docs/make_images.py runs/demo
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from pneumorph.coopt.metrics import HISTOGRAM_EDGES_CM, read_metrics
from pneumorph.report.film import FilmSettings, side_by_side, write_film
from pneumorph.report.reward_figure import reward_figure
from pneumorph.report.scene import Actor
from pneumorph.report.style import save_figure
from pneumorph.trajectory import Trajectory

IMAGES = Path(__file__).parent / "images"
LOOP = FilmSettings(width=720, frames_per_second=5, speed=2.0)


def main(run: Path) -> None:
    """Write the pictures of a run into docs/images."""
    actors = side_by_side(
        [
            Actor.of(Trajectory.load(run / "best_trajectory.npz"), "learned"),
            Actor.of(Trajectory.load(run / "baseline_trajectory.npz"), "expert"),
        ]
    )
    write_film(IMAGES / "robots.gif", actors, LOOP)
    summary = json.loads((run / "summary.json").read_text())
    figure = reward_figure(
        read_metrics(run / "training"),
        HISTOGRAM_EDGES_CM,
        summary["baseline_best_distance_cm"],
        summary["best_distance_cm"],
    )
    save_figure(figure, IMAGES / "training.png", ("png",))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/demo"))
