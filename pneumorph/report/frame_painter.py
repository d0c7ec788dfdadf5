"""One image of a film: the floor with its grid, the shadows, the shaded robots and the captions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.camera import Camera, fitted_camera
from pneumorph.report.marker_actor import MarkerActor
from pneumorph.report.rasteriser import DepthBuffer
from pneumorph.report.scene import Actor, ColourBy, red_green_blue
from pneumorph.report.style import INK_COLOUR, path_colour

if TYPE_CHECKING:
    from PIL import Image, ImageFont

_SUPERSAMPLING = 2
_FLOOR = np.array([0.965, 0.968, 0.972])
_GRID = np.array([0.87, 0.88, 0.89])
_START = np.array([0.55, 0.57, 0.60])
_SHADOW = 0.80
_LIGHT = np.array([-0.35, -0.45, 0.82]) / np.linalg.norm([-0.35, -0.45, 0.82])
_AMBIENT = 0.55
_GRID_MM = 50.0


class FramePainter:
    """Paints the frames of a film of one or more robots.

    Args:
        actors: The robots.
        width: Pixels across.
        azimuth_deg: Turn of the view about the vertical.
        elevation_deg: Height of the viewer above the horizon.
        colour_by: What the colour of a leg tells.
        captions: Write clock, scale and labels into the images.
    """

    def __init__(
        self,
        actors: Sequence[Actor | MarkerActor],
        width: int = 960,
        azimuth_deg: float = 12.0,
        elevation_deg: float = 42.0,
        colour_by: ColourBy = "regulator",
        captions: bool = True,
    ) -> None:
        if not actors:
            raise ValueError("a film needs at least one robot, got none")
        self._actors = list(actors)
        self._captions = captions
        self._colour_by = colour_by
        extreme, floor = _extent(self._actors, captions)
        self._floor_mm = floor
        self._camera = fitted_camera(extreme, width, azimuth_deg, elevation_deg)
        scale = _SUPERSAMPLING
        self._fine = Camera(
            self._camera.right,
            self._camera.down,
            self._camera.away,
            self._camera.origin_mm,
            self._camera.pixels_per_mm * scale,
            self._camera.width * scale,
            self._camera.height * scale,
        )
        depth = extreme @ self._camera.away
        self._buffer = DepthBuffer(
            self._fine.width, self._fine.height, depth.min() - 50, depth.max() + 50
        )
        self._shadow = DepthBuffer(self._camera.width, self._camera.height, -1.0, 1.0)
        self._background = self._painted_floor()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the images in pixels."""
        return self._camera.width, self._camera.height

    @property
    def pixels_per_mm(self) -> float:
        """Scale of the images."""
        return self._camera.pixels_per_mm

    def paint(self, time_s: float) -> np.ndarray:
        """Return the image at a time, (height, width, 3) uint8."""
        frames = [actor.frame_at(time_s) for actor in self._actors]
        corners = np.concatenate(
            [self._corners(actor, f) for actor, f in zip(self._actors, frames, strict=True)]
        )
        colours = np.concatenate(
            [a.colours(f, self._colour_by) for a, f in zip(self._actors, frames, strict=True)]
        )
        finite = np.isfinite(corners).all(axis=(1, 2))
        corners, colours = corners[finite], colours[finite]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        lit = np.clip(normal @ _LIGHT, 0.0, 1.0)
        shaded = colours * (_AMBIENT + (1.0 - _AMBIENT) * lit)[:, None]

        image = self._background.copy()
        self._shade_floor(image, corners[lit > 0])
        image = self._with_paths(image, frames)
        seen = normal @ self._camera.away < 0
        self._buffer.clear()
        self._buffer.draw(self._fine.project(corners[seen]))
        self._blend_robots(image, shaded[seen] * 255)
        picture = image.astype(np.uint8).reshape(*self.size[::-1], 3)
        return self._captioned(picture, time_s, frames) if self._captions else picture

    def _corners(self, actor: Actor | MarkerActor, frame: int) -> np.ndarray:
        """Return an actor's triangles; what is measured has no height of its own."""
        lift = self._floor_mm if isinstance(actor, MarkerActor) else 0.0
        return np.asarray(actor.corners(frame) + np.array([0.0, 0.0, lift]))

    def _with_paths(self, image: np.ndarray, frames: list[int]) -> np.ndarray:
        """Return the image with the way of each robot so far drawn on the floor."""
        from PIL import Image, ImageDraw

        picture = Image.fromarray(image.astype(np.uint8).reshape(*self.size[::-1], 3))
        draw = ImageDraw.Draw(picture)
        for index, (actor, frame) in enumerate(zip(self._actors, frames, strict=True)):
            way = actor.path_mm[: frame + 1]
            points = np.column_stack([way, np.full(len(way), self._floor_mm)])
            places = [tuple(point) for point in self._camera.project(points)[:, :2].tolist()]
            if len(places) > 1:
                draw.line(places, fill=path_colour(index, len(self._actors)), width=3)
        return np.asarray(picture).reshape(-1, 3).astype(np.float32)

    def _shade_floor(self, image: np.ndarray, corners: np.ndarray) -> None:
        """Darken the floor where triangles keep the light off it."""
        height = corners[:, :, 2:] - self._floor_mm
        projected = self._camera.project(corners - height * (_LIGHT / _LIGHT[2]))
        projected[..., 2] = 0.0
        self._shadow.clear()
        self._shadow.draw(projected)
        pixel, _ = self._shadow.nearest()
        image[pixel] *= _SHADOW

    def _blend_robots(self, image: np.ndarray, colours: np.ndarray) -> None:
        """Lay the robots' fine pixels over the image: each counts for its share of a pixel."""
        fine, triangle = self._buffer.nearest()
        row, column = np.divmod(fine, self._fine.width)
        coarse = (row // _SUPERSAMPLING) * self._camera.width + column // _SUPERSAMPLING
        share = np.bincount(coarse, minlength=len(image)) / _SUPERSAMPLING**2
        touched = np.flatnonzero(share)
        image[touched] *= 1.0 - share[touched, None]
        for channel in range(3):
            total = np.bincount(coarse, colours[triangle, channel], minlength=len(image))
            image[touched, channel] += total[touched] / _SUPERSAMPLING**2

    def _painted_floor(self) -> np.ndarray:
        """Return the floor, (pixel, 3) in 0..255: a line every 5 cm and a dark one at x = 0."""
        rows, columns = np.mgrid[0 : self._fine.height, 0 : self._fine.width]
        pixel = np.stack([columns + 0.5, rows + 0.5], axis=-1)
        point = self._fine.floor_point(pixel, self._floor_mm)
        # A line is one fine pixel wide in the image, whatever its direction on the floor.
        step = 1.0 / self._fine.pixels_per_mm
        image = np.tile(_FLOOR, (self._fine.height, self._fine.width, 1))
        for axis, slant in ((0, 1.0), (1, 1.0 / max(abs(self._camera.down[1]), 0.2))):
            distance = np.abs((point[..., axis] + _GRID_MM / 2) % _GRID_MM - _GRID_MM / 2)
            image[distance < step * slant] = _GRID
        image[np.abs(point[..., 0]) < 1.6 * step] = _START
        return _averaged(image) * np.float32(255)

    def _captioned(self, image: np.ndarray, time_s: float, frames: list[int]) -> np.ndarray:
        """Return the image with clock, scale bar and each robot's label and distance."""
        from PIL import Image, ImageDraw

        picture: Image.Image = Image.fromarray(image)
        draw = ImageDraw.Draw(picture)
        large, small = _font(self._camera.width // 42), _font(self._camera.width // 56)
        ink = tuple(round(255 * part) for part in red_green_blue(INK_COLOUR))
        space = self._camera.width // 60
        draw.text((space, space), f"{max(time_s, 0.0):5.1f} s", fill=ink, font=large)

        for actor, frame in zip(self._actors, frames, strict=True):
            start, now = actor.path_mm[[0, frame], 0]
            anchor = self._camera.project(
                np.array([[_label_x(self._actors), actor.lane_mm, self._floor_mm]])
            )[0]
            text = f"{actor.label}\n{(now - start) / 10:+.1f} cm"
            place = (min(anchor[0], self._camera.width - space), anchor[1])
            draw.text(place, text, fill=ink, font=small, anchor="rm", align="right")

        # At the top: a video player's controls cover the bottom.
        right, base = self._camera.width - space, 2 * space
        bar = 50.0 * self._camera.pixels_per_mm
        draw.line([(right - bar, base), (right, base)], fill=ink, width=3)
        draw.text((right - bar / 2, base + 4), "5 cm", fill=ink, font=small, anchor="mt")
        return np.asarray(picture)


def _label_x(actors: list[Actor | MarkerActor]) -> float:
    """Return the world x of the labels: clear of every robot at the end of its path."""
    return max(float(np.nanmax(actor.path_mm[:, 0])) for actor in actors) + 330.0


def _extent(actors: list[Actor | MarkerActor], captions: bool) -> tuple[np.ndarray, float]:
    """Return the corners of boxes around all that will be drawn, (point, 3), and the floor's z."""
    boxes = [actor.extent_mm() for actor in actors]
    lowest = [
        float(box[:, 2].min())
        for actor, box in zip(actors, boxes, strict=True)
        if isinstance(actor, Actor)
    ]
    floor = min(lowest, default=0.0) - 0.5
    for actor, box in zip(actors, boxes, strict=True):
        if isinstance(actor, MarkerActor):
            box[:, 2] += floor
    if captions:
        boxes.append(np.array([[_label_x(actors), actor.lane_mm, floor + 0.5] for actor in actors]))
    return np.concatenate(boxes), floor


def _averaged(image: np.ndarray) -> np.ndarray:
    """Return each square of fine pixels averaged into one, (pixel, 3) float32."""
    height, width = image.shape[0] // _SUPERSAMPLING, image.shape[1] // _SUPERSAMPLING
    squares = image.reshape(height, _SUPERSAMPLING, width, _SUPERSAMPLING, 3)
    return squares.mean(axis=(1, 3)).reshape(-1, 3).astype(np.float32)


def _font(size: int) -> ImageFont.FreeTypeFont:
    """Return matplotlib's own DejaVu Sans: the machine need not have any font."""
    import matplotlib
    from PIL import ImageFont

    path = f"{matplotlib.get_data_path()}/fonts/ttf/DejaVuSans.ttf"
    return ImageFont.truetype(path, max(size, 9))
