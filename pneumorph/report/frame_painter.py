"""One image of a film: the floor with its grid, the shadows, the shaded robots and the captions.

Pillow draws the triangles from the farthest to the nearest. Those of a robot are a few millimetres
across, so their middles tell which of two is in front: no depth buffer, and so neither a display
nor a graphics driver, is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from pneumorph.base.checked import Bounds, Checked, Count, Positive
from pneumorph.report.camera import fitted_camera
from pneumorph.report.floor_slope import shown_slope_deg, slope_deg, slope_words
from pneumorph.report.ground_surface import SPACING_MM, GroundSurface
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.physics_words import physics_of_walks
from pneumorph.report.scene import Actor, ColourBy, full_pressure_kPa
from pneumorph.report.style import INK_COLOUR, path_colour, red_green_blue

_FINE = 2
"""Drawn so many times as large, then averaged: smooth edges."""
_FLOOR = "#F6F7F8"
_GRID = "#DEE0E3"
_START = "#8C9199"
_SHADOW = 0.80
_LIGHT = np.array([-0.35, -0.45, 0.82]) / np.linalg.norm([-0.35, -0.45, 0.82])
_AMBIENT = 0.55
_GRID_MM = 50.0


@dataclass(frozen=True)
class FilmSettings(Checked):
    """Size, speed and view of a film."""

    width: Annotated[int, Bounds(least=160)] = 960
    """Width of the picture [pixels]; the height follows from what must be in view."""
    frames_per_second: Count = 10
    """Frames per second of film. More are smoother and take longer to draw; a GIF has at most
    50."""
    speed: Positive = 1.0
    """Playback speed: seconds of robot time per second of film. 2 is twice as fast as reality."""
    azimuth_deg: float = 12.0
    """Rotation of the view about the vertical axis [degrees]; 0 looks at the robot from its right
    side."""
    elevation_deg: Annotated[float, Bounds(above=0.0, most=90.0)] = 42.0
    """Height of the camera above the horizon [degrees]; 90 looks straight down."""
    colour_by: ColourBy = "regulator"
    """What a leg's colour shows: its regulator, or its pressure from 0 to 90 kPa or, if that is
    more, to the highest that is shown."""


@dataclass(frozen=True, eq=False)
class _Shaded:
    """Triangles that the camera sees, (triangle, 3, 3) mm, their colours, (triangle, 3), and those
    that the light falls on, (triangle, 3, 3) mm."""

    seen: np.ndarray
    colours: np.ndarray
    lit: np.ndarray


class FramePainter:
    """Paints the frames of a film of one or more robots.

    Args:
        actors: The robots.
        settings: Size, view and colours.
        captions: Write clock, scale, labels and the physics into the images.
        told: What is written once of all robots; None for the names of their physics.
        full_kPa: Pressure of a leg's full colour [real kPa]; None for that of these robots.
    """

    def __init__(
        self,
        actors: Sequence[Actor | MarkerActor],
        settings: FilmSettings | None = None,
        captions: bool = True,
        told: str | None = None,
        full_kPa: float | None = None,
    ) -> None:
        if not actors:
            raise ValueError("a film needs at least one robot, got none")
        self._actors = list(actors)
        self._captions = captions
        simulated = [actor.trajectory for actor in actors if isinstance(actor, Actor)]
        slopes = [slope_deg(trajectory) for trajectory in simulated]
        once = (physics_of_walks(simulated) if told is None else told, slope_words(slopes))
        self._told = ", ".join(words for words in once if words)
        view = settings or FilmSettings()
        self._colour_by = view.colour_by
        self._full_kPa = full_pressure_kPa(actors) if full_kPa is None else full_kPa
        extreme, self._floor_mm = _extent(self._actors, captions)
        self._camera = fitted_camera(
            extreme,
            view.width,
            view.azimuth_deg,
            view.elevation_deg,
            slope_deg=shown_slope_deg(slopes),
        )
        self._floor = self._painted_floor()
        self._shaded_floor = self._floor.point(lambda value: round(_SHADOW * value))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the images in pixels."""
        return self._camera.width, self._camera.height

    @property
    def pixels_per_mm(self) -> float:
        """Scale of the images."""
        return self._camera.pixels_per_mm

    def paint(self, time_s: float) -> Image.Image:
        """Return the image at a time."""
        frames = [actor.frame_at(time_s) for actor in self._actors]
        now = list(zip(self._actors, frames, strict=True))
        robots = self._shaded(
            np.concatenate([self._corners(actor, frame) for actor, frame in now]),
            np.concatenate([each.colours(at, self._colour_by, self._full_kPa) for each, at in now]),
        )
        carried = [(actor, frame) for actor, frame in now if isinstance(actor, Actor)]
        marks = self._shaded(
            np.concatenate([np.zeros((0, 3, 3)), *(each.mark_corners(at) for each, at in carried)]),
            np.concatenate([np.zeros((0, 3)), *(each.mark_colours(at) for each, at in carried)]),
        )

        image = self._floor.copy()
        self._shade_floor(image, np.concatenate([robots.lit, marks.lit]))
        draw = ImageDraw.Draw(image)
        for index, (actor, frame) in enumerate(now):
            way = self._on_floor(actor.path_mm[: frame + 1])
            draw.line(way, path_colour(index, len(now)), 3 * _FINE, joint="curve")
        for each in (robots, marks):  # marks over all that would hide them
            self._draw_robots(draw, each.seen, each.colours)
        image = image.reduce(_FINE)
        if self._captions:
            self._write_captions(ImageDraw.Draw(image), time_s, frames)
        return image

    def _shaded(self, corners: np.ndarray, colours: np.ndarray) -> _Shaded:
        """Return what is seen of triangles, and those that the light falls on."""
        finite = np.isfinite(corners).all(axis=(1, 2))
        corners, colours = corners[finite], colours[finite]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        lit = np.clip(normal @ _LIGHT, 0.0, 1.0)
        shaded = colours * (_AMBIENT + (1.0 - _AMBIENT) * lit)[:, None]
        seen = normal @ self._camera.axes[:, 2] < -1e-6  # neither turned away nor without area
        return _Shaded(corners[seen], shaded[seen], corners[lit > 0])

    def _corners(self, actor: Actor | MarkerActor, frame: int) -> np.ndarray:
        """Return an actor's triangles; what is measured has no height of its own."""
        lift = self._floor_mm if isinstance(actor, MarkerActor) else 0.0
        return np.asarray(actor.corners(frame) + np.array([0.0, 0.0, lift]))

    def _on_floor(self, points: np.ndarray) -> list[tuple[float, float]]:
        """Return the fine pixels of points (point, 2) of the floor."""
        points = np.column_stack([points, np.full(len(points), self._floor_mm)])
        return [(x, y) for x, y in (_FINE * self._camera.project(points)[:, :2]).tolist()]

    def _painted_floor(self) -> Image.Image:
        """Return the floor, fine: a line every 5 cm and a dark one at x = 0."""
        width, height = _FINE * self._camera.width, _FINE * self._camera.height
        image = Image.new("RGB", (width, height), _FLOOR)
        draw = ImageDraw.Draw(image)
        corners = np.array([[x, y] for x in (0, self.size[0]) for y in (0, self.size[1])])
        seen = self._camera.floor_point(corners, self._floor_mm) / _GRID_MM
        low, high = np.floor(seen.min(axis=0)), np.ceil(seen.max(axis=0))
        for axis in (0, 1):
            for place in np.arange(low[axis], high[axis] + 1):
                ends = np.array([low, high])
                ends[:, axis] = place
                draw.line(self._on_floor(_GRID_MM * ends), _GRID, _FINE)
        draw.line(self._on_floor(_GRID_MM * np.array([[0, low[1]], [0, high[1]]])), _START, 3)
        for actor in self._actors:
            if isinstance(actor, Actor) and actor.ground is not None:
                self._paint_ground(draw, actor.ground, actor.lane_mm)
        return image

    def _paint_ground(
        self, draw: ImageDraw.ImageDraw, ground: GroundSurface, lane_mm: float
    ) -> None:
        """Draw the heights that a robot walks on, shaded, with the floor's lines on them."""
        lane = np.array([0.0, lane_mm, 0.0])
        corners = ground.triangles + lane
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        light = _AMBIENT + (1.0 - _AMBIENT) * np.clip(normal @ _LIGHT, 0.0, 1.0)
        colours = light[:, None] / (_AMBIENT + (1.0 - _AMBIENT) * _LIGHT[2])
        self._draw_robots(draw, corners, np.clip(colours * red_green_blue(_FLOOR), 0.0, 1.0))
        points, step = ground.points + lane, round(_GRID_MM / SPACING_MM)
        for line in (*points[::step], *points.transpose(1, 0, 2)[::step]):
            seen = _FINE * self._camera.project(line)[:, :2]
            draw.line([(x, y) for x, y in seen.tolist()], _GRID, _FINE)

    def _shade_floor(self, image: Image.Image, corners: np.ndarray) -> None:
        """Darken the floor where triangles keep the light off it."""
        height = corners[:, :, 2:] - self._floor_mm
        shadows = self._camera.project(corners - height * (_LIGHT / _LIGHT[2]))[..., :2]
        mask = Image.new("1", image.size)
        draw = ImageDraw.Draw(mask)
        for outline in (_FINE * shadows).reshape(-1, 6).tolist():
            draw.polygon(outline, fill=1)
        image.paste(self._shaded_floor, mask=mask)

    def _draw_robots(
        self, draw: ImageDraw.ImageDraw, corners: np.ndarray, colours: np.ndarray
    ) -> None:
        """Draw triangles, the farthest first."""
        projected = self._camera.project(corners)
        order = np.argsort(-projected[..., 2].mean(axis=1))
        outlines = (_FINE * projected[order, :, :2]).reshape(-1, 6).tolist()
        fills = (255 * colours[order]).astype(int).tolist()
        for outline, fill in zip(outlines, fills, strict=True):
            draw.polygon(outline, tuple(fill))

    def _write_captions(
        self, draw: ImageDraw.ImageDraw, time_s: float, frames: Sequence[int]
    ) -> None:
        """Write clock, physics, scale bar and each robot's label and distance."""
        width = self._camera.width
        large, small = _font(width // 42), _font(width // 56)
        space = width // 60
        draw.text((space, space), f"{max(time_s, 0.0):5.1f} s", INK_COLOUR, large)
        draw.text((space, space + width // 36), self._told, INK_COLOUR, small)
        self._write_labels(draw, small, time_s, frames)

        # At the top: a video player's controls cover the bottom.
        end, base = width - space, 2 * space
        bar = 50.0 * self._camera.pixels_per_mm
        draw.line([(end - bar, base), (end, base)], INK_COLOUR, 3)
        draw.text((end - bar / 2, base + 4), "5 cm", INK_COLOUR, small, anchor="mt")

    def _write_labels(
        self,
        draw: ImageDraw.ImageDraw,
        font: ImageFont.FreeTypeFont,
        time_s: float,
        frames: Sequence[int],
    ) -> None:
        """Write each robot's label and what it has achieved behind its lane, below each other where
        lanes are close, and there with a bar in the colour of its path."""
        width, right = self._camera.width, _label_x(self._actors)
        space, texts, boxes, wanted = width // 60, list[str](), list[tuple[float, ...]](), []
        for actor, frame in zip(self._actors, frames, strict=True):
            over = f", ended at {actor.end_s:.3g} s" if time_s > actor.end_s + 0.02 else ""
            texts.append(f"{actor.label}\n{actor.travelled(frame)}{over}")
            boxes.append(draw.textbbox((0, 0), texts[-1], font, anchor="rm", align="right"))
            ((x, y),) = self._on_floor(np.array([[right, actor.lane_mm]]))
            wanted.append((min(x / _FINE, width - space), y / _FINE))
        heights = [box[3] - box[1] + 0.4 * font.size for box in boxes]
        placed = _spread([y for _, y in wanted], heights, self._camera.height)
        close = placed != [y for _, y in wanted]
        for number, (text, box, (x, _), y) in enumerate(
            zip(texts, boxes, wanted, placed, strict=True)
        ):
            draw.text((x, y), text, INK_COLOUR, font, anchor="rm", align="right")
            if close:
                bar = (x + box[0] - 0.8 * font.size, x + box[0] - 0.5 * font.size)
                draw.rectangle(
                    (bar[0], y + box[1], bar[1], y + box[3]), path_colour(number, len(texts))
                )


def _spread(middles: Sequence[float], heights: Sequence[float], room: float) -> list[float]:
    """Where labels go down a picture, so that none covers another: the upper ones above, of those
    in one place the first, as near to where they would be as that allows, and in the picture.

    Args:
        middles: Where the middles of labels would be [pixels].
        heights: How high they are [pixels].
        room: How high the picture is [pixels].
    """
    placed, lowest = list(middles), -np.inf
    order = sorted(range(len(middles)), key=lambda number: middles[number])
    for number in order:
        placed[number] = max(middles[number], lowest + heights[number] / 2.0)
        lowest = placed[number] + heights[number] / 2.0
    if placed == list(middles):
        return placed
    # Those that were pushed down were pushed by the others: all give way alike.
    shift = max(float(np.mean(np.subtract(placed, middles))), lowest - room)
    shift = min(shift, placed[order[0]] - heights[order[0]] / 2.0)
    return [each - shift for each in placed]


def _label_x(actors: list[Actor | MarkerActor]) -> float:
    """Return the world x of the labels: clear of every robot at the end of its path."""
    return max(float(np.nanmax(actor.path_mm[:, 0])) for actor in actors) + 330.0


def _extent(actors: list[Actor | MarkerActor], captions: bool) -> tuple[np.ndarray, float]:
    """Return the corners of boxes around all that will be drawn, (point, 3), and the floor's z."""
    boxes = [actor.extent_mm() for actor in actors]
    pairs = list(zip(actors, boxes, strict=True))
    lowest = [float(box[:, 2].min()) for actor, box in pairs if isinstance(actor, Actor)]
    floor = min(lowest, default=0.0) - 0.5
    for actor, box in pairs:
        box[:, 2] += floor if isinstance(actor, MarkerActor) else 0.0
    if captions:
        boxes.append(np.array([[_label_x(actors), actor.lane_mm, floor + 0.5] for actor in actors]))
    return np.concatenate(boxes), floor


def _font(size: int) -> ImageFont.FreeTypeFont:
    """Return matplotlib's own DejaVu Sans: the machine need not have any font."""
    import matplotlib

    path = f"{matplotlib.get_data_path()}/fonts/ttf/DejaVuSans.ttf"
    return ImageFont.truetype(path, max(size, 9))
