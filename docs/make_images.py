"""Draw the pictures of the README and the docs from a finished demo run.

pneumorph demo --out runs/demo && python docs/make_images.py runs/demo

The pictures of the report page and the explorer are taken by a headless Chromium through
playwright, which the extra `development` has.
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

from pneumorph.cli import run as pneumorph
from pneumorph.coopt.metrics import HISTOGRAM_EDGES_CM, read_metrics
from pneumorph.report.film import FilmSettings, side_by_side, write_film
from pneumorph.report.reward_figure import reward_figure
from pneumorph.report.scene import Actor
from pneumorph.report.style import save_figure
from pneumorph.trajectory import Trajectory

IMAGES = Path(__file__).parent / "images"
LOOP = FilmSettings(width=720, frames_per_second=5, speed=2.0)
# Without a graphics card: SwiftShader draws on the processor.
CHROMIUM = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]


def main(run: Path) -> None:
    """Write the pictures of a run into docs/images."""
    draw_film_and_training(run)
    take_pages(run)


def draw_film_and_training(run: Path) -> None:
    """Write robots.gif and training.png."""
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
        summary["pairs"],
    )
    save_figure(figure, IMAGES / "training.png", ("png",))


def take_pages(run: Path) -> None:
    """Write report.png and explorer.png: pages as a browser shows them, in mid-walk."""
    from playwright.sync_api import sync_playwright

    for verb in ("report", "explore"):
        if pneumorph([verb, str(run)]) != 0:
            raise SystemExit(f"pneumorph {verb} {run} failed")
    best = json.loads((run / "summary.json").read_text())["best_design"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium") or shutil.which("google-chrome"), args=CHROMIUM
        )
        page = browser.new_page(viewport={"width": 1040, "height": 1500})
        page.goto((run / "report/page.html").resolve().as_uri())
        _take(page, "pneumorphReplay.players[0].seek(7.4)", "report.png")
        page.set_viewport_size({"width": 1240, "height": 780})
        page.goto((run / "explorer/explorer.html").resolve().as_uri() + f"#design={best}")
        _take(page, "pneumorphExplorer.player().seek(7.4)", "explorer.png")
        browser.close()


def _take(page: Any, script: str, name: str) -> None:
    page.evaluate(script)
    page.wait_for_timeout(2000)  # a few pictures on the processor
    page.screenshot(path=IMAGES / name)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/demo"))
