"""What the documents say can be run, and what they point at exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pneumorph.cli import VERBS

ROOT = Path(__file__).parent.parent
DOCUMENTS = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")]


def test_the_python_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (block,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    exec(compile(block, "README.md", "exec"), {})
    assert re.fullmatch(r"-?\d+\.\d\d cm\n", capsys.readouterr().out)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_and_verbs_exist(document: Path) -> None:
    text = document.read_text()
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", text):
        assert (document.parent / target).exists(), target
    for verb in re.findall(r"^pneumorph (\w+)", text, re.MULTILINE):
        assert verb in VERBS


def test_files_of_the_map_exist() -> None:
    text = (ROOT / "docs" / "map.md").read_text()
    for path in re.findall(r"`((?:pneumorph|engine)/[\w/.]+)`", text):
        assert (ROOT / path).exists(), path
