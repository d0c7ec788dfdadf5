"""What notebooks show in place of a value's text."""

from __future__ import annotations

import importlib


class ShownInNotebooks:
    """A value that `pneumorph.report.notebook` knows how to show.

    What draws comes later in the flow of data than what is drawn, so it is found by its name, and
    imported when a notebook asks.
    """

    def _repr_html_(self) -> str | None:
        """HTML that needs no network and nothing of the page around it; None where there is
        nothing to draw, so that a notebook shows the text."""
        shown: str | None = importlib.import_module("pneumorph.report.notebook").html_of(self)
        return shown
