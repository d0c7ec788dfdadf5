"""Draw the picture of the replay for the README from a finished demo run, in headless Chromium.

pneumorph demo --out runs/demo && python docs/make_replay_image.py runs/demo

Needs playwright (the extra `development`) and a Chromium (on Debian: apt install chromium).
"""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from pneumorph.artefact import write_atomically
from pneumorph.report.film import side_by_side
from pneumorph.report.replay.page import write_replay
from pneumorph.report.scene import Actor
from pneumorph.trajectory import Trajectory

TARGET = Path(__file__).parent / "images/replay.png"
SIZE = {"width": 960, "height": 720}
TIME_S = 13.0


def main(run: Path) -> None:
    """Write docs/images/replay.png."""
    actors = side_by_side(
        [
            Actor.of(Trajectory.load(run / "best_trajectory.npz"), "learned"),
            Actor.of(Trajectory.load(run / "baseline_trajectory.npz"), "expert"),
        ]
    )
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        page_file = write_replay(Path(folder) / "replay.html", actors)
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"),
            args=["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"],
        )
        # Twice the pixels, averaged below: smooth edges without a graphics card.
        page = browser.new_page(viewport=SIZE, device_scale_factor=2)
        page.set_default_timeout(180_000)
        page.goto(page_file.as_uri())
        page.evaluate(f"pneumorphReplay.players[0].seek({TIME_S})")
        page.evaluate("new Promise((done) => setTimeout(done, 1000))")
        shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        browser.close()
    picture = shot.resize((SIZE["width"], SIZE["height"]), Image.Resampling.BOX)
    small = picture.quantize(128, dither=Image.Dither.NONE)
    write_atomically(TARGET, lambda stream: small.save(stream, format="png", optimize=True))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/demo"))
