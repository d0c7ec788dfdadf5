"""Heights of a floor that come from a file: an image or an array."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.base.artefact import reading
from pneumorph.base.checked import Checked, NotNegative, Positive
from pneumorph.physics.height_grid import checked_heights

LEAST_HEIGHT_MM = 0.1
"""A map whose heights differ by less [mm] is a plane to legs that are some ten millimetres high."""

_WITHOUT_WHITE = {"F": "floating-point numbers", "I": "integers that are signed or of 32 bits"}
"""Pillow's modes of grey images without a largest value, and what they hold."""
_TIFF_BITS, _TIFF_MEANING = 258, 262
"""Tags of a TIFF: bits of a pixel, and what 0 means, 1 being black."""


@dataclass(frozen=True)
class HeightMap(Checked):
    """A file of heights, seen from above: columns go along x (forward), rows from +y to -y."""

    path: Path | None = None
    """A grey image of 8 or 16 bits (such as PNG), or an .npy file with heights in mm. None: a
    plane."""
    mm_per_pixel: Positive = 1.0
    """Distance between neighbouring pixels [mm]."""
    black_mm: float = 0.0
    """Height of black in an image [mm]."""
    white_mm: float = 10.0
    """Height of white in an image [mm]."""
    centre_x_mm: float = 0.0
    """Where the middle of the map lies, x [mm]."""
    centre_y_mm: float = 0.0
    """Where the middle of the map lies, y [mm]."""
    smoothing_mm: NotNegative = 0.0
    """Standard deviation of a Gaussian that rounds the map's edges and steps [mm]."""

    def smoothed_mm(self) -> np.ndarray:
        """Read the file and round its edges [mm], (row, column).

        Raises:
            FileNotFoundError: No such file.
            ValueError: Not a grey image, or no grid of heights; names the file.
        """
        heights = self.heights_mm()
        try:
            heights = checked_heights(heights)
            if 0.0 < np.ptp(heights) < LEAST_HEIGHT_MM:
                raise ValueError(
                    f"its heights differ by {np.ptp(heights):.3g} mm, expected {LEAST_HEIGHT_MM:g} "
                    "mm or more, or none: they may be in metres"
                )
            return smoothed(heights, self.smoothing_mm / self.mm_per_pixel)
        except ValueError as error:
            raise ValueError(f"height map {self.path}: {error}") from error

    def heights_mm(self) -> np.ndarray:
        """Read the file [mm], (row, column).

        Raises:
            FileNotFoundError: No such file.
            ValueError: Not a grey image or array of heights.
        """
        if self.path is None:
            raise ValueError("path of the height map is None, expected an image or a .npy file")
        path = Path(self.path)
        if not path.is_file():
            what = "is no file" if path.exists() else "does not exist"
            raise FileNotFoundError(f"height map {path} {what}")
        if path.suffix == ".npy":
            with reading(path, "height map"):
                heights = np.load(path, allow_pickle=False)
                if heights.dtype.kind not in "fiub":
                    raise ValueError(
                        f"height map {path} holds {heights.dtype}, expected heights in mm"
                    )
                return np.asarray(heights, dtype=float)
        try:
            pixels = _pixels(path)
        except (OSError, SyntaxError) as error:
            raise ValueError(
                f"height map {path} is not an image that can be read ({error}); expected a grey "
                "image such as PNG, or a .npy of heights in mm"
            ) from error
        if pixels.ndim == 3:
            colours = pixels[:, :, : 3 if pixels.shape[2] > 2 else 1]
            if np.ptp(colours, axis=2).max() > 0.0:
                raise ValueError(
                    f"height map {path} has colours, expected greys: a colour names no height"
                )
            pixels = colours[:, :, 0]
        grey = np.asarray(pixels, dtype=float)
        return self.black_mm + (self.white_mm - self.black_mm) * grey


def _pixels(path: Path) -> np.ndarray:
    """Pixels of an image from 0 (black) to 1 (white), (row, column) or (row, column, colour).

    Raises:
        OSError: It cannot be read.
        SyntaxError: Its format is broken.
        ValueError: Its pixels have no white, or are not read as they are meant.
    """
    from matplotlib.image import imread
    from PIL import Image

    instead = "expected greys of 8 or 16 bits, such as PNG, or heights in mm saved as .npy"
    with Image.open(path) as image:
        mode, kind = image.mode, image.format
        tags = dict(image.getexif()) if kind == "TIFF" else {}
        if mode == "I" and kind == "PPM":  # of 16 bits; Pillow makes 65535 of its white
            return np.asarray(image) / 65535.0
    # Some versions of Pillow open PNG of 16 bits as I. Of other files in these modes matplotlib
    # cuts all above 255.
    if mode in _WITHOUT_WHITE and kind != "PNG":
        raise ValueError(
            f"height map {path} has pixels of mode {mode} ({_WITHOUT_WHITE[mode]}), of which none "
            f"is white; {instead}"
        )
    pixels = imread(path)
    if pixels.dtype == np.uint16:  # Pillow leaves such as they are in the file
        bits, black_is_zero = tags.get(_TIFF_BITS, 16), tags.get(_TIFF_MEANING, 1) == 1
        if bits != 16 or not black_is_zero:
            raise ValueError(
                f"height map {path} is a TIFF of {bits} bits whose 0 is "
                f"{'black' if black_is_zero else 'white'}, expected 16 bits whose 0 is black; "
                f"{instead}"
            )
    if pixels.dtype.kind == "u":
        pixels = pixels / np.iinfo(pixels.dtype).max
    return pixels


def smoothed(heights_mm: np.ndarray, deviation: float) -> np.ndarray:
    """Heights [mm], (row, column), after a Gaussian of this standard deviation [pixel]."""
    from scipy.ndimage import gaussian_filter

    if deviation == 0.0:
        return heights_mm
    rounded: np.ndarray = gaussian_filter(heights_mm, deviation, mode="nearest")
    return rounded
