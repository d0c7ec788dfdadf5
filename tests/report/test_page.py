"""The page holds everything in itself and shows text as text."""

from __future__ import annotations

import re
from pathlib import Path

from pneumorph.report import page
from pneumorph.report.reduction_figures import bend_figure


def test_page_needs_nothing_from_outside(tmp_path: Path) -> None:
    still = tmp_path / "s.png"
    still.write_bytes(b"still")
    sections = [
        page.Section("Still", page.picture(still, "both robots")),
        page.Section("Bend", page.drawn(bend_figure([0, 1], [0, 1], [0, 1]), "bend")),
        page.Section("Table", page.table(["a", "b"], [["x", 1.23456], ["y", 2]])),
    ]
    path = page.write_page(tmp_path / "page.html", "A title", "A lead", "", sections)
    content = path.read_text()
    sources = re.findall(r'(?:src|href|poster)="([^"]*)"', content)
    assert len(sources) == 3  # the icon, the still and the figure
    assert all(source.startswith("data:") for source in sources)
    assert "url(" not in content
    assert "<script" not in content
    assert "1.23<" in content


def test_text_cannot_become_markup() -> None:
    bad = "<i>&"
    for made in (
        page.paragraph(bad),
        page.numbers({bad: bad}),
        page.table([bad], [[bad]]),
        page.folded(bad, {bad: bad}),
        page.command_lines([bad]),
    ):
        assert bad not in made
        assert "&lt;i&gt;&amp;" in made
