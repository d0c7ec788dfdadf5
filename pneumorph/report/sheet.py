"""The figures of a page: in the page as vectors, and beside it as files for print."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pneumorph.report import page
from pneumorph.report.style import save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Sheet:
    """Draws figures of a page.

    Args:
        folder: Where the page is; figures go to its ``figures`` as PDF and PNG.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files: list[Path] = []

    def drawn(self, name: str, figure: Figure, caption: str) -> str:
        """Return a figure for the page, and save it under a name."""
        self.files += save_figure(figure, self.folder / "figures" / name)
        return page.drawn(figure, caption)
