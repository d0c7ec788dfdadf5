"""One HTML page with everything in it: opens from disk with no network, and prints well."""

from __future__ import annotations

import base64
import html
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pneumorph.base.artefact import write_text
from pneumorph.report.style import figure_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Section:
    """A heading and the HTML under it."""

    title: str
    body: str


def write_page(
    path: Path | str,
    title: str,
    lead: str,
    opening: str,
    sections: Iterable[Section],
    head: str = "",
) -> Path:
    """Write a page.

    Args:
        path: The HTML file.
        title: Its heading.
        lead: One sentence under the heading.
        opening: HTML before the first section.
        sections: The rest.
        head: HTML for the head, such as scripts.
    """
    parts = [
        f'<main><h1>{html.escape(title)}</h1><p class="lead">{html.escape(lead)}</p>',
        opening,
        *(f"<h2>{html.escape(each.title)}</h2>\n{each.body}" for each in sections),
        "</main>",
    ]
    return write_html(path, document(title, page_style() + head, "\n".join(parts)))


def document(title: str, head: str, body: str, kind: str = "") -> str:
    """Return the HTML of a whole page.

    Args:
        title: What the window is called.
        head: HTML of its head, such as style and scripts.
        body: HTML of its body.
        kind: Class of its body, for style.
    """
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<link rel="icon" href="data:,">',
            f"<title>{html.escape(title)}</title>{head}</head>",
            f'<body class="{kind}">{body}</body></html>',
        ]
    )


def page_style() -> str:
    """Return the style of pages with sections, for a page's head."""
    return f"<style>{files('pneumorph.report').joinpath('page.css').read_text('utf-8')}</style>"


def write_html(path: Path | str, text: str) -> Path:
    """Write a page."""
    return write_text(path, text)


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph of plain text."""
    name = f' class="{kind}"' if kind else ""
    return f"<p{name}>{html.escape(text)}</p>"


def numbers(values: Mapping[str, str]) -> str:
    """Return a row of headline numbers: the value large, its name under it."""
    cells = [
        f'<div class="number"><b>{html.escape(value)}</b><span>{html.escape(name)}</span></div>'
        for name, value in values.items()
    ]
    return f'<div class="numbers">{"".join(cells)}</div>'


def drawn(figure: Figure, text: str) -> str:
    """Return a figure as an embedded vector picture with its caption."""
    stream = io.BytesIO()
    with figure_style():
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return _pictured("image/svg+xml", stream.getvalue(), text)


def picture(path: Path, text: str) -> str:
    """Return a PNG picture that a run saved, embedded with its caption."""
    return _pictured("image/png", path.read_bytes(), text)


def caption(text: str) -> str:
    """Return the caption of a figure."""
    return f"<figcaption>{html.escape(text)}</figcaption>"


def side_by_side(*figures: str) -> str:
    """Return figures next to each other where the page is wide enough."""
    return f'<div class="row">{"".join(figures)}</div>'


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table; numbers are right-aligned."""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in header)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f'<div class="scroll"><table><tr>{head}</tr>{body}</table></div>'


def folded(title: str, content: Mapping[str, Any]) -> str:
    """Return nested values as JSON behind a line to click."""
    text = html.escape(json.dumps(content, indent=2))
    return f"<details><summary>{html.escape(title)}</summary><pre>{text}</pre></details>"


def command_lines(lines: Iterable[str]) -> str:
    """Return commands to copy."""
    return f"<pre>{html.escape(chr(10).join(lines))}</pre>"


def _cell(value: object) -> str:
    if value is None:
        return '<td class="value">-</td>'
    if isinstance(value, float):
        return f'<td class="value">{value:.3g}</td>'
    if isinstance(value, int) and not isinstance(value, bool):
        return f'<td class="value">{value}</td>'
    return f"<td>{html.escape(str(value))}</td>"


def _pictured(kind: str, content: bytes, text: str) -> str:
    address = f"data:{kind};base64,{base64.b64encode(content).decode()}"
    return f'<figure><img alt="{html.escape(text)}" src="{address}">{caption(text)}</figure>'
