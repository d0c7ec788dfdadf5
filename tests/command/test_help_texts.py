"""What help and error texts say can be typed, and what documents say that verbs return."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, get_type_hints

import pytest

from pneumorph.base.layers import _flags, _switched_off
from pneumorph.cli import VERBS, _parsed
from pneumorph.command.verb import CommonOptions
from pneumorph.fabrication.fabricated_robot import refuse_thin_fins
from pneumorph.fabrication.robot_to_make import described_robot_to_make

ROOT = Path(__file__).parent.parent.parent
COMMANDS = (
    r"`pneumorph (\w+)([^`]*)`",
    r"Example: pneumorph (\w+)(.*?)(?= Example:|$)",
    r"pneumorph (\w+)((?: --[\w.-]+(?: [^\s-]\S*)?)+)",
)
"""As texts write them: quoted, as an example, or with a flag just after the verb."""
FLAG = re.compile(r"--[a-z][\w.-]*")


def verb_of(name: str) -> Any:
    return import_module(f"pneumorph.command.{name}").VERB


def flags_of(verb: str) -> set[str]:
    """All that a verb takes; some of them have an option of the preset's name."""
    found = {"--help", "--preset"}
    for kind in (verb_of(verb).options, CommonOptions):
        for _, flag in _flags(kind):
            if flag is not None:
                found |= {flag, _switched_off(flag)}
    return found


def literals(file: Path) -> Iterator[tuple[int, str]]:
    """Each text of a file and its line; what is filled in is left out."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.JoinedStr):
            parts = [part.value if isinstance(part, ast.Constant) else "X" for part in node.values]
            yield node.lineno, "".join(map(str, parts))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value


def commands(text: str) -> Iterator[tuple[str, str]]:
    """Verb and arguments of each command that a text names."""
    for pattern in COMMANDS:
        yield from re.findall(pattern, " ".join(text.split()))


def test_flags_that_texts_name_are_flags_of_their_verb() -> None:
    """Messages say what to type next: a flag that is spelled otherwise there is a dead end."""
    taken = {verb: flags_of(verb) for verb in VERBS}
    seen, wrong = 0, []
    for file in sorted(ROOT.glob("pneumorph/**/*.py")):
        for line, text in literals(file):
            for verb, rest in commands(text):
                for flag in FLAG.findall(rest) if verb in taken else ():
                    seen += 1
                    if flag.rstrip(".") not in taken[verb]:
                        wrong.append(f"{file.relative_to(ROOT)}:{line}: pneumorph {verb} {flag}")
    assert wrong == []
    assert seen > 30


@pytest.mark.parametrize("verb", VERBS)
def test_examples_of_a_verb_are_paragraphs_of_their_own(verb: str) -> None:
    help_text = import_module(f"pneumorph.command.{verb}").__doc__ or ""
    assert [each for each in help_text.split("\n\n") if each.count("Example:") > 1] == []


def test_the_example_of_a_robots_file_can_be_built(monkeypatch: pytest.MonkeyPatch) -> None:
    """The mould of its short leg has thinner fins than are taken unasked."""
    monkeypatch.chdir(ROOT)
    help_text = import_module("pneumorph.command.fabricate").__doc__ or ""
    (arguments,) = re.findall(
        r"Example: pneumorph fabricate (\S+ --robot [^\n]*(?:\n.+)*)", help_text
    )
    options = _parsed("fabricate", verb_of("fabricate"), "", arguments.split())[0]
    description, settings = options.robot.description, options.fabrication
    robot = options.robot.spec()
    made = described_robot_to_make(options.design, description, robot, settings)
    refuse_thin_fins(made.legs, settings.mould)


@pytest.mark.parametrize("verb", VERBS)
def test_the_class_of_a_summary_is_named_and_is_what_the_verb_returns(verb: str) -> None:
    page = (ROOT / "docs/file_formats.md").read_text()
    told = page[page.index("**Keys of summaries.**") : page.index("**Metrics of a training**")]
    named = {
        each: kind
        for kind, verbs in re.findall(r"`([A-Z]\w+)` \((`[^)]+`)\)", told)
        for each in re.findall(r"`(\w+)`", verbs)
    }
    assert len(named) > 12
    made = get_type_hints(verb_of(verb).run).get("return")  # None of a function without a name
    if verb in named and made is not None:
        assert made.__name__ == named[verb]
