"""Colours and sizes shared by every figure, film and page.

The colours are those of Okabe and Ito (2008), told apart with any common colour blindness and in
grey print.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

REGULATOR_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_REGION_COLOURS = (
    *REGULATOR_COLOURS, "#F0E442", "#332288", "#663300", "#9966FF", "#990066", "#B8E68A",
)  # fmt: skip
"""Of the regions of a mesh, which are more than regulators; no two of them are nearer to each other
than some of the first six are."""
_DARKER = 0.6
"""Of what a colour was, once all of them are taken."""
LEARNED_COLOUR = "#0072B2"
BASELINE_COLOUR = "#E69F00"
NEUTRAL_COLOUR = "#8A8F94"
DISK_COLOUR = "#D9DCDF"
INK_COLOUR = "#22272B"
PATH_COLOURS = (LEARNED_COLOUR, BASELINE_COLOUR, "#CC79A7", "#56B4E9", "#009E73", NEUTRAL_COLOUR)
LEG_LINES: tuple[Any, ...] = (
    "-", (0, (5, 1.5)), (0, (1, 1)), (0, (4, 1, 1, 1)), (0, (6, 2, 2, 2)), (0, (2, 3)),
)  # fmt: skip
"""Styles of lines that tell legs of one regulator apart."""

_STYLE: Any = {
    "figure.dpi": 110,
    "savefig.dpi": 200,
    "figure.constrained_layout.use": True,
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK_COLOUR,
    "axes.labelcolor": INK_COLOUR,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E7E9EB",
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    # Text stays text: it can be selected, searched and edited, and the file does not change from
    # one run to the next.
    "svg.fonttype": "none",
    "svg.hashsalt": "pneumorph",
    "pdf.fonttype": 42,
}


_NO_DATE: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}


def regulator_colour(regulator: int) -> str:
    """Return the colour of regulator 1, 2, ...; the disk's for 0 (no leg)."""
    if regulator == 0:
        return DISK_COLOUR
    return REGULATOR_COLOURS[(regulator - 1) % len(REGULATOR_COLOURS)]


def region_colours(count: int) -> list[str]:
    """Return so many colours of regions that lie beside each other, no two alike; beyond twelve
    they become darker, and are told apart less well."""
    colours = []
    for number in range(count):
        taken, place = divmod(number, len(_REGION_COLOURS))
        parts = bytes.fromhex(_REGION_COLOURS[place][1:])
        colours.append("#" + "".join(f"{round(part * _DARKER**taken):02X}" for part in parts))
    return colours


def red_green_blue(colour: str) -> tuple[float, ...]:
    """Return red, green and blue in 0..1 of a colour written as ``#RRGGBB``."""
    return tuple(part / 255 for part in bytes.fromhex(colour[1:]))


def white_between() -> list[Any]:
    """Path effects that keep a text readable over lines: a white rim around its letters."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=2.0, foreground="white")]


def fill_outline(
    axes: Axes, corners: np.ndarray, colour: str, rim: str, width: float, order: float = 1.0
) -> None:
    """Fill a polygon, with a rim outside of it: it may go over itself on its way, which shows no
    lines inside.

    Args:
        axes: Where to draw.
        corners: Of the polygon, (corner, 2).
        colour: What it is filled with.
        rim: Colour of its rim.
        width: Width of the rim in points, half of which another patch would have inside.
        order: Later ones are drawn over earlier ones.
    """
    from matplotlib.patheffects import withStroke

    around = [withStroke(linewidth=width, foreground=rim)]
    axes.fill(*corners.T, facecolor=colour, edgecolor="none", path_effects=around, zorder=order)


def path_colour(index: int, count: int) -> str:
    """Return the colour of the way of a robot in a film or replay of so many."""
    return INK_COLOUR if count == 1 else PATH_COLOURS[index % len(PATH_COLOURS)]


@contextmanager
def figure_style() -> Iterator[None]:
    """Draw with the package's style and without a display, whatever the user's own settings are."""
    import matplotlib

    with matplotlib.rc_context(_STYLE):
        yield


def new_figure(width_inch: float = 5.2, height_inch: float = 3.0) -> Figure:
    """Return an empty figure that needs no display and that no global list keeps alive."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_inch, height_inch))
    FigureCanvasAgg(figure)
    return figure


def new_axes(width_inch: float = 5.2, height_inch: float = 3.0) -> tuple[Figure, Axes]:
    """Return a figure as `new_figure` with one panel, and the panel."""
    figure = new_figure(width_inch, height_inch)
    return figure, figure.add_subplot()


def zero_line(axes: Axes) -> None:
    """Draw where nothing was travelled."""
    axes.axhline(0.0, color=INK_COLOUR, linewidth=0.6)


def legend_beside(axes: Axes) -> None:
    """Write the legend to the right of a panel, where it hides nothing."""
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)


def legend_above(axes: Axes) -> None:
    """Write the legend in a row over the right end of a panel."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, fontsize=7,
                borderaxespad=0.1)  # fmt: skip


FigureFormat = Literal["png", "pdf", "svg"]
FIGURE_FILES: tuple[FigureFormat, ...] = ("png", "pdf")
"""What a figure is saved as: for a screen and for print."""


def place_once(figure: Figure) -> None:
    """Find where everything in a figure lies, once for all the files that it is saved as."""
    with figure_style():
        figure.draw_without_rendering()
    figure.set_layout_engine("none")


def save_figure(
    figure: Figure, path: Path | str, formats: tuple[FigureFormat, ...] = FIGURE_FILES
) -> list[Path]:
    """Save a figure beside ``path`` in each of some formats; return the files."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    written = []
    with figure_style():
        for suffix in formats:
            target = path.with_suffix(f".{suffix}")
            # A date in the file would make each run differ from the last.
            metadata = _NO_DATE.get(suffix)
            figure.savefig(target, metadata=metadata)
            written.append(target)
    return written
