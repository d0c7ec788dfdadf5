"""Films of trajectories, made off-screen: several robots in one frame with scale bar and clock."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

import numpy as np
from PIL import Image

from pneumorph.base.artefact import write_atomically
from pneumorph.report.frame_painter import FilmSettings, FramePainter
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.scene import Actor

Shown = TypeVar("Shown", bound=Actor | MarkerActor)
"""Anything that has a lane."""

_MOST_GIF_FRAMES_PER_SECOND = 50
"""Frames of a GIF last whole hundredths of a second, and viewers slow down those of one."""

# H.264 plays everywhere; the others are for PyAV builds without it. MPEG-4 plays in players only.
_CODECS = ("libx264", "libopenh264", "libvpx-vp9", "mpeg4")


def write_film(
    path: Path | str,
    actors: Sequence[Actor | MarkerActor],
    settings: FilmSettings | None = None,
    progress: Callable[[int, int, str], None] | None = None,
    told: str | None = None,
) -> Path:
    """Film robots from the start of their trajectories to the end of the longest one.

    Args:
        path: ``.mp4`` or ``.gif``.
        actors: The robots; see `side_by_side` for their lanes.
        settings: Size, speed and view.
        progress: Called with frames done, frames in all and a message.
        told: What is written once of all robots; None for the names of their physics.

    Raises:
        ValueError: Another suffix, more than 50 frames per second of a GIF, or a trajectory without
            node positions.
    """
    path = Path(path)
    settings = settings or FilmSettings()
    refuse_unwritable(path, settings)
    painter = FramePainter(actors, settings, told=told)
    frames = _frames(painter, actors, settings, progress)
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / f"film{path.suffix}"
        if path.suffix == ".gif":
            _write_gif(draft, frames, settings)
        else:
            _write_mp4(draft, frames, painter.size, settings)
        return write_atomically(path, lambda stream: stream.write(draft.read_bytes()))


def refuse_unwritable(path: Path, settings: FilmSettings) -> None:
    """Refuse a film that no file of its kind holds.

    Args:
        path: The file.
        settings: How fast it is.

    Raises:
        ValueError: Neither ``.mp4`` nor ``.gif``, or more than 50 frames per second of a GIF.
    """
    if path.suffix not in (".mp4", ".gif"):
        raise ValueError(f"film {path} ends in {path.suffix!r}, expected .mp4 or .gif")
    if path.suffix == ".gif" and settings.frames_per_second > _MOST_GIF_FRAMES_PER_SECOND:
        raise ValueError(
            f"film {path} has {settings.frames_per_second} frames per second, expected at most "
            f"{_MOST_GIF_FRAMES_PER_SECOND} of a GIF: viewers slow down frames of less than two "
            "hundredths of a second; an .mp4 may have more"
        )


def side_by_side(actors: Sequence[Shown], spacing_mm: float = 340.0) -> list[Shown]:
    """Return the actors in lanes of their own, the first one farthest from the viewer."""
    count = len(actors)
    return [replace(a, lane_mm=(count - 1 - i) * spacing_mm) for i, a in enumerate(actors)]


def _frames(
    painter: FramePainter,
    actors: Sequence[Actor | MarkerActor],
    settings: FilmSettings,
    progress: Callable[[int, int, str], None] | None,
) -> Iterator[Image.Image]:
    end = max(actor.end_s for actor in actors)
    step = settings.speed / settings.frames_per_second
    count = max(1, int(np.floor(end / step + 1e-9)) + 1)
    for number in range(count):
        if progress is not None:
            progress(number, count, "filming")
        yield painter.paint(number * step)
    if progress is not None:
        progress(count, count, "filming")


def _write_mp4(
    path: Path, frames: Iterator[Image.Image], size: tuple[int, int], settings: FilmSettings
) -> None:
    import av
    from av.video.stream import VideoStream

    codec = next(name for name in _CODECS if name in av.codecs_available)
    # The index stands at the front of the file, so a browser starts before it has read all of it.
    with av.open(str(path), "w", options={"movflags": "+faststart"}) as container:
        video = container.add_stream(codec, rate=settings.frames_per_second)
        assert isinstance(video, VideoStream)
        video.width, video.height = size
        video.pix_fmt = "yuv420p"
        if codec == "libx264":
            video.options = {"crf": "23", "preset": "medium", "tune": "animation"}
        for image in frames:
            container.mux(video.encode(av.VideoFrame.from_image(image)))
        container.mux(video.encode())


def _write_gif(path: Path, frames: Iterator[Image.Image], settings: FilmSettings) -> None:
    first, *rest = (image.quantize(96, dither=Image.Dither.NONE) for image in frames)
    # Whole hundredths, as a GIF has them, whose running sum is right: errors would add up.
    ends = [round(100 * k / settings.frames_per_second) for k in range(len(rest) + 2)]
    durations_ms = [10 * (end - start) for start, end in pairwise(ends)]
    first.save(path, save_all=True, append_images=rest, duration=durations_ms, loop=0)
