"""The figures and replays of a page; figures are also kept beside it as files for print."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pneumorph.report import page
from pneumorph.report.film import side_by_side
from pneumorph.report.replay.page import replay_assets, replay_fragment
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.style import FIGURE_FILES, FigureFormat, place_once, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.report.marker_actor import MarkerActor
    from pneumorph.report.scene import Actor


class Sheet:
    """Makes what a page shows.

    Args:
        folder: Where the page is; files of its figures go to its ``figures``.
        replay: How exact replays are.
        figure_files: What each figure is saved as.
    """

    def __init__(
        self,
        folder: Path,
        replay: ReplaySettings | None = None,
        figure_files: tuple[FigureFormat, ...] = FIGURE_FILES,
    ) -> None:
        self.folder = folder
        self.figure_files = figure_files
        self.files: list[Path] = []
        self._replay = replay or PAGE_REPLAY
        self._has_replay = False

    def drawn(self, name: str, figure: Figure, caption: str) -> str:
        """Return a figure for the page, and save it under a name."""
        place_once(figure)
        if self.figure_files:
            self.files += save_figure(figure, self.folder / "figures" / name, self.figure_files)
        return page.drawn(figure, caption)

    def replayed(self, actors: Sequence[Actor | MarkerActor], caption: str) -> str:
        """Return a player of robots side by side."""
        self._has_replay = True
        fragment = replay_fragment(side_by_side(actors), self._replay)
        return f"<figure>{fragment}{page.caption(caption)}</figure>"

    @property
    def head(self) -> str:
        """What the page's head needs for what was made."""
        return replay_assets() if self._has_replay else ""


PAGE_REPLAY = ReplaySettings(tolerance_mm=0.1, frame_interval_s=0.1)
"""A tenth of a millimetre is a tenth of a pixel on a page, and keeps full robots small."""
