"""What robots walk on: a plane, or heights that are read, drawn and built."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np
from jaxtyping import Float

from pneumorph.base.checked import Bounds, Checked, CountOrNone, NotNegative, Positive
from pneumorph.physics.floor import Floor, HeightField, PlaneFloor
from pneumorph.physics.height_grid import HeightGrid, nodes_along
from pneumorph.physics.height_map import HeightMap

MOST_CELLS = 4e6
"""Cells of a ground that is made."""
_NEAR_MM = 1e-6
"""Far above rounding, far below any step."""


@dataclass(frozen=True)
class RoughGround(Checked):
    """A random surface: Gaussian heights h whose correlation is Gaussian,
    <h(r) h(r + d)> = roughness^2 exp(-d^2 / correlation^2)."""

    roughness_mm: NotNegative = 0.0
    """Standard deviation of the heights [mm]."""
    correlation_mm: Positive = 40.0
    """Correlation length of the heights, at which their correlation is 1/e [mm]. Slopes along any
    direction have the standard deviation roughness sqrt(2) / correlation."""
    seed: CountOrNone = 0
    """Seed of the heights."""

    def heights_mm(self, shape: tuple[int, int], spacing_mm: float) -> np.ndarray:
        """Heights on a grid that goes round at its edges [mm], (row, column).

        Raises:
            ValueError: The grid is too small for the correlation.
        """
        from scipy.ndimage import gaussian_filter

        if 2.0 * self.correlation_mm > spacing_mm * min(shape):
            raise ValueError(
                f"physics.ground.rough.correlation_mm is {self.correlation_mm:g}, expected at most "
                f"half of the ground's shorter side, {spacing_mm * min(shape):g} mm"
            )
        # White noise through a Gaussian of deviation s is correlated as one of s sqrt(2).
        deviation = 0.5 * self.correlation_mm / spacing_mm
        noise = np.random.default_rng(self.seed).standard_normal(shape)
        impulse = np.zeros(shape)
        impulse[0, 0] = 1.0
        gain = np.linalg.norm(gaussian_filter(impulse, deviation, mode="wrap"))
        rough: np.ndarray = gaussian_filter(noise, deviation, mode="wrap")
        return self.roughness_mm / gain * rough


@dataclass(frozen=True)
class Steps(Checked):
    """Steps or ramps across the way of a robot that walks forward (x)."""

    rise_mm: float = 0.0
    """Height of each step, negative for down [mm]."""
    start_mm: float = 150.0
    """Where the first step begins, x [mm]."""
    run_mm: Positive = 20.0
    """Length over which each step rises [mm]; a long one is a ramp."""
    tread_mm: NotNegative = 100.0
    """Length of the level part behind each step [mm]."""
    count: Annotated[int, Bounds(least=1, most=1000)] = 1
    """Number of steps."""

    def check_within(self, low_mm: float, high_mm: float, cure: str) -> None:
        """Refuse steps that are not wholly on a ground, which goes on level beyond its ends.

        Args:
            low_mm: Where the ground begins, x [mm].
            high_mm: Where it ends, x [mm].
            cure: What would make them fit, in words.

        Raises:
            ValueError: One begins before the ground does, or still rises where it ends.
        """
        end = self.start_mm + self.count * self.run_mm + (self.count - 1) * self.tread_mm
        within = low_mm - _NEAR_MM <= self.start_mm and end <= high_mm + _NEAR_MM
        if self.rise_mm != 0.0 and not within:
            raise ValueError(
                f"steps.start_mm {self.start_mm:g}, run_mm {self.run_mm:g}, tread_mm "
                f"{self.tread_mm:g} and count {self.count} make steps from {self.start_mm:g} to "
                f"{end:g} mm along x, expected within the ground, from {low_mm:g} to "
                f"{high_mm:g} mm: beyond it goes on level, without steps. {cure}"
            )

    def height(self, x: np.ndarray) -> np.ndarray:
        """Heights at places along x [mm]: a cubic that begins and ends level for each step."""
        starts = self.start_mm + (self.run_mm + self.tread_mm) * np.arange(self.count)
        share = np.clip((x[..., None] - starts) / self.run_mm, 0.0, 1.0)
        height: np.ndarray = self.rise_mm * np.sum(share**2 * (3.0 - 2.0 * share), axis=-1)
        return height


@dataclass(frozen=True)
class Ground(Checked):
    """What the floor is like: a plane, unless there is a map, roughness or steps. Their heights add
    up, counted from the floor's height.

    Raises:
        ValueError: A number is out of range, or the grid is too coarse for what is on it; whether
            steps go on beyond it, `grid` tells.
    """

    map: HeightMap = field(default_factory=HeightMap)
    """Heights from a file, whose grid the ground then uses."""
    rough: RoughGround = field(default_factory=RoughGround)
    """Random heights."""
    steps: Steps = field(default_factory=Steps)
    """Steps or ramps."""
    length_mm: Positive = 2000.0
    """Extent along x of a ground without a map, centred on the origin [mm]; beyond it the ground
    continues level at the height of its edge."""
    width_mm: Positive = 1200.0
    """Extent along y [mm]."""
    spacing_mm: Positive = 5.0
    """Distance between the nodes of the ground's grid [mm]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        spacing, of_it = self.spacing_mm, "spacing_mm"
        if self.map.path is not None:
            spacing, of_it = self.map.mm_per_pixel, "map.mm_per_pixel"
        elif not self.is_plane:
            sides = self.length_mm / spacing, self.width_mm / spacing
            if min(sides) < 4.0 or sides[0] * sides[1] > MOST_CELLS:
                raise ValueError(
                    f"the ground of {self.length_mm:g} x {self.width_mm:g} mm has {sides[0]:.0f} x "
                    f"{sides[1]:.0f} cells of spacing_mm {spacing:g}, expected at least 4 along "
                    f"each side and at most {MOST_CELLS:g} in all"
                )
        for needed, name, least in (
            (self.rough.roughness_mm > 0.0, "rough.correlation_mm", 4.0),
            (self.steps.rise_mm != 0.0, "steps.run_mm", 2.0),
        ):
            group, number = name.split(".")
            value = getattr(getattr(self, group), number)
            if needed and value < least * spacing:
                raise ValueError(
                    f"{name} is {value:g}, expected at least {least:g} times {of_it}, {spacing:g}: "
                    "a coarser grid does not show it"
                )

    @property
    def is_plane(self) -> bool:
        """Whether there is nothing on it."""
        bare = self.rough.roughness_mm == 0.0 and self.steps.rise_mm == 0.0
        return self.map.path is None and bare

    @property
    def description(self) -> str:
        """What is on it, in words."""
        path, rough, steps = self.map.path, self.rough, self.steps
        words = [] if path is None else [f"height map {Path(path).name}"]
        if rough.roughness_mm > 0.0:
            words.append(
                f"roughness of {rough.roughness_mm:g} mm over {rough.correlation_mm:g} mm, seed "
                f"{rough.seed}"
            )
        if steps.rise_mm != 0.0:
            count = f"{steps.count} step{'' if steps.count == 1 else 's'}"
            words.append(f"{count} of {steps.rise_mm:g} mm from {steps.start_mm:g} mm")
        return " with ".join(words) or "plane"

    def file_identity(self) -> dict[str, str]:
        """What tells a map from another of the same name, for what is kept of walks on it; nothing
        without one. Raises as `grid`."""
        if self.map.path is None:
            return {}
        return {"map_digest": hashlib.sha256(self.map.smoothed_mm().tobytes()).hexdigest()}

    def grid(self) -> HeightGrid:
        """Its heights over the floor's height; the same object for the same ground.

        Raises:
            FileNotFoundError: No such map.
            ValueError: The map is no grey image or no grid of heights, or the ground is too short
                for its steps; names the setting and the file.
        """
        path = self.map.path
        changed_ns = Path(path).stat().st_mtime_ns if path and Path(path).exists() else 0
        return _grid_of(self, changed_ns)

    def floor(self, height_mm: float, standing: Float[np.ndarray, "point 3"]) -> Floor:
        """What a robot stands on.

        Robots start in the same pose on any ground: one that would be above a point there is
        lowered until it touches.

        Args:
            height_mm: Where the heights are counted from [mm].
            standing: Where the robot's contact points are at the start, without a lift [mm].

        Raises:
            FileNotFoundError: As `grid`.
            ValueError: Likewise, or the robot starts beyond an edge of a map or of roughness.
        """
        if self.is_plane:
            return PlaneFloor(height_mm)
        grid = self.grid()
        if self.ends and len(standing) > 0:
            self._check_start(grid, standing)
        x, y, z = standing.T
        above = float(np.max(height_mm + grid.height(x, y) - z, initial=0.0))
        return HeightField(grid.height, grid.gradient, height_mm - above, self.description)

    def left_note(
        self, name: str, time_s: Float[np.ndarray, " frame"], path_mm: Float[np.ndarray, "frame 3"]
    ) -> str | None:
        """What to tell of a robot that was beyond the edges of a map or of roughness; None of
        others, and of other grounds. Raises as `grid`.

        Args:
            name: What it is called.
            time_s: When it was where [s].
            path_mm: Places of its tracked point [mm].
        """
        if not self.ends:
            return None
        beyond = ~self.grid().covers(path_mm[:, 0], path_mm[:, 1])
        if not beyond.any():
            return None
        return (
            f"{name} was beyond the edges of its ground ({self.description}) from "
            f"{time_s[beyond][0]:g} s on: that is level there, and what it achieved was not on it"
        )

    @property
    def ends(self) -> bool:
        """Whether it is level beyond its edges: steps alone are the same all across."""
        return self.map.path is not None or self.rough.roughness_mm > 0.0

    def _check_start(self, grid: HeightGrid, standing: Float[np.ndarray, "point 3"]) -> None:
        # One that stands partly on it walks on the map; of one beyond an edge nothing does.
        low, high = standing[:, :2].min(axis=0), standing[:, :2].max(axis=0)
        (left, right), (back, front) = grid.y_mm[[0, -1]], grid.x_mm[[0, -1]]
        if np.all(low <= [front, right]) and np.all(high >= [back, left]):
            return
        larger = "physics.ground.length_mm and width_mm larger"
        if self.map.path is not None:
            larger = "the map larger or move it (physics.ground.map.mm_per_pixel, centre_x_mm)"
        raise ValueError(
            f"physics.start.x_mm and y_mm put the robot from {low[0]:g} to {high[0]:g} mm along x "
            f"and from {low[1]:g} to {high[1]:g} mm along y, expected it on the ground "
            f"({self.description}), from {back:g} to {front:g} mm along x and from {left:g} to "
            f"{right:g} mm along y: beyond its edges it goes on level. Start it on that, or make "
            f"{larger}"
        )


@lru_cache(maxsize=32)
def _grid_of(ground: Ground, changed_ns: int) -> HeightGrid:
    """The grid of a ground whose file was changed then [ns]."""
    if ground.map.path is not None:
        where = "physics.ground.map.path"
        try:
            heights = ground.map.smoothed_mm()
        except FileNotFoundError as error:
            raise FileNotFoundError(f"{where}: {error}") from error
        except ValueError as error:
            raise ValueError(f"{where}: {error}") from error
        spacing = ground.map.mm_per_pixel
        centre = ground.map.centre_x_mm, ground.map.centre_y_mm
    else:
        spacing, centre = ground.spacing_mm, (0.0, 0.0)
        counts = [1 + round(side / spacing) for side in (ground.width_mm, ground.length_mm)]
        heights = np.zeros((counts[0], counts[1]))
    if ground.rough.roughness_mm > 0.0:
        rows, columns = heights.shape
        heights = heights + ground.rough.heights_mm((rows, columns), spacing)
    x = centre[0] + nodes_along(heights.shape[1], spacing)
    longer = "length_mm larger"
    if ground.map.path is not None:
        longer = f"the map {Path(ground.map.path).name} longer (mm_per_pixel {spacing:g})"
    cure = f"Make them fewer or shorter, or {longer}"
    try:
        ground.steps.check_within(float(x[0]), float(x[-1]), cure)
    except ValueError as error:
        raise ValueError(f"physics.ground.{error}") from error
    return HeightGrid(heights + ground.steps.height(x), spacing, centre)
