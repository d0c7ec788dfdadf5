"""How Sphinx makes the documentation site; `make site` runs it."""

from __future__ import annotations

import re
import unicodedata
from typing import TYPE_CHECKING, Any

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

from pneumorph import __version__

if TYPE_CHECKING:
    from docutils.nodes import math, math_block
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator

project = "pneumorph"
author = "the pneumorph developers"
release = version = __version__
html_title = f"pneumorph {release}"
html_theme = "furo"
html_show_copyright = False
html_copy_source = False
exclude_patterns = ["_site"]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.apidoc",
]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

# A page for each package, from its docstrings.
apidoc_modules = [
    {
        "path": "../pneumorph",
        "destination": "api",
        "max_depth": 2,
        "automodule_options": {"members", "show-inheritance"},
    }
]
autodoc_default_options = {
    "members": True,
    "member-order": "bysource",
    "ignore-module-all": True,  # names that a package passes on are described where they are made
}
autodoc_typehints_format = "short"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
# Fields are members already; a second description of each would be a duplicate.
napoleon_use_ivar = True
# Before a colon a field's docstring is read as a type, whose words, such as an axis, may be names
# of several members.
suppress_warnings = ["ref.python"]
# `name` in a docstring is code, as in Markdown.
default_role = "code"


# Norms in docstrings, such as |v|, are no substitutions; what stands in backticks is left alone.
_BAR = re.compile(r"(`[^`]*`)|\|")


# Browsers know no letters of another alphabet by an attribute; Unicode has them as characters.
_ALPHABET = re.compile(r'<mi mathvariant="(script|bold|sans-serif)">([A-Za-z])</mi>')


def _mathml(formula: str, display: str) -> str:
    apart = formula.replace(r"\tag", r"\qquad\tag")  # an equation's number
    return _ALPHABET.sub(_letter, convert(apart, display=display))


def _letter(found: re.Match[str]) -> str:
    alphabet, letter = found.groups()
    case = "CAPITAL" if letter.isupper() else "SMALL"
    name = f"MATHEMATICAL {alphabet.upper()} {case} {letter.upper()}"
    return f'<mi mathvariant="normal">{unicodedata.lookup(name)}</mi>'


def _inline(translator: HTML5Translator, node: math) -> None:
    translator.body.append(_mathml(node.astext(), "inline"))
    raise SkipNode


def _block(translator: HTML5Translator, node: math_block) -> None:
    translator.body.append(f'<div class="formula">{_mathml(node.astext(), "block")}</div>')
    raise SkipNode


def _escape_bars(
    app: Sphinx, kind: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    lines[:] = [_BAR.sub(lambda found: found.group(1) or "\\|", line) for line in lines]


def setup(app: Sphinx) -> None:
    """Write formulas as MathML, which browsers draw themselves: no script and no network."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("autodoc-process-docstring", _escape_bars)


html_math_renderer = "mathml"
