"""Draw the pictures of the README and the docs from a finished demo run.

pneumorph demo --out runs/demo && python docs/make_images.py runs/demo

Pictures of pages are taken in headless Chromium (on Debian: apt install chromium) through
playwright, which the extra `development` has.
"""

from __future__ import annotations

import io
import shutil
import sys
from pathlib import Path
from typing import Any

from PIL import Image

from pneumorph.base.artefact import write_atomically
from pneumorph.report.explorer.explored_run import explore
from pneumorph.report.film import FilmSettings, side_by_side, write_film
from pneumorph.report.replay.page import write_replay
from pneumorph.report.run_page import write_run_page
from pneumorph.report.scene import Actor
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.study_once import study_folder
from pneumorph.study.training_result import TrainingResult
from pneumorph.trajectory import Trajectory

IMAGES = Path(__file__).parent / "images"
LOOP = FilmSettings(width=720, frames_per_second=5, speed=2.0)
TIME_S = 13.0
"""Instant of the walk that pages are taken at."""


def main(run: Path) -> None:
    """Write the pictures of a run into docs/images."""
    learned = FinishedRun.read(run)
    found = learned.result(TrainingResult)
    actors = side_by_side(
        [
            Actor.of(Trajectory.load(run / "best_trajectory.npz"), "learned"),
            Actor.of(Trajectory.load(run / "baseline_trajectory.npz"), "expert"),
        ]
    )
    write_film(IMAGES / "robots.gif", actors, LOOP)
    explorer = explore(study_folder(run / "explorer", "explore"), learned)
    take_pages(
        write_replay(run / "replay.html", actors),
        Path(write_run_page(learned, run / "report" / "page.html").page).resolve(),
        Path(explorer.page).resolve().as_uri() + f"#design={found.best_design}",
    )


def take_pages(replay: Path, report: Path, explorer: str) -> None:
    """Write replay.png, report.png and explorer.png."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"),
            # Without a graphics card: SwiftShader draws on the processor.
            args=["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"],
        )
        player = f"pneumorphReplay.players[0].seek({TIME_S})"
        _take(browser, replay.resolve().as_uri(), (960, 720), player, "replay.png")
        _take(browser, report.as_uri(), (1040, 1400), player, "report.png")
        shown = f"pneumorphExplorer.player().seek({TIME_S})"
        _take(browser, explorer, (1240, 780), shown, "explorer.png")
        browser.close()


def _take(browser: Any, address: str, size: tuple[int, int], script: str, name: str) -> None:
    # Twice the pixels, averaged below: smooth edges without a graphics card.
    viewport = {"width": size[0], "height": size[1]}
    page = browser.new_page(viewport=viewport, device_scale_factor=2)
    page.set_default_timeout(180_000)
    page.goto(address)
    page.evaluate(script)
    page.evaluate("new Promise((done) => setTimeout(done, 1000))")
    shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    page.close()
    small = shot.resize(size, Image.Resampling.BOX).quantize(128, dither=Image.Dither.NONE)
    write_atomically(IMAGES / name, lambda stream: small.save(stream, format="png", optimize=True))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/demo"))
