"""What the documents say can be run, and what they point at exists."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path

import pytest

from pneumorph.catalogue.bench_tests import BENCH_TESTS
from pneumorph.cli import VERBS
from pneumorph.learn.metrics import HISTOGRAM_EDGES_CM

ROOT = Path(__file__).parent.parent
DOCUMENTS = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")]


def test_the_python_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """Eight lines without an import of a file inside the package."""
    (block,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    lines = [line for line in block.splitlines() if line]
    assert len(lines) <= 8
    assert not re.search(r"pneumorph\.", block)
    exec(compile(block, "README.md", "exec"), {})
    assert re.fullmatch(r"-?\d+\.\d\d cm\n", capsys.readouterr().out)


def test_the_numbers_of_the_pages_are_those_of_the_experiments() -> None:
    specification = importlib.util.spec_from_file_location("numbers", ROOT / "docs/make_numbers.py")
    assert specification is not None
    assert specification.loader is not None
    numbers = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(numbers)
    for file, names in numbers.PAGES.items():
        page = (ROOT / file).read_text()
        assert numbers.with_numbers(page, names) == page, file


@pytest.mark.parametrize(
    "file",
    [
        "demo/demo.json",
        "restarts/restarts.json",
        "robust/summary.json",
        "long_trainings/summary.json",
    ],
)
def test_the_index_of_experiments_says_what_they_found(file: str) -> None:
    name, found = file.split("/")[0], ROOT / "reproduce" / file
    page = (ROOT / "reproduce/README.md").read_text()
    (row,) = (line for line in page.splitlines() if f"[{name}]({name}/README.md)" in line)
    said = [float(number) for number in re.findall(r"\d+\.\d", row)]
    for seed in json.loads(found.read_text())["seeds"]:
        band = seed.get("band", seed)
        assert round(band["median_cm"], 1) in said, seed["seed"]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_and_verbs_exist(document: Path) -> None:
    text = document.read_text()
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", text):
        if target == "api/modules.rst":  # `make site` writes it
            continue
        package = re.fullmatch(r"api/(pneumorph[\w.]*)\.rst", target)
        if package is None:
            assert (document.parent / target).exists(), target
        else:  # which `make site` writes, for each package
            name = package[1].replace(".", "/")
            assert (ROOT / name / "__init__.py").exists(), target
    for verb in re.findall(r"^pneumorph (\w+)", text, re.MULTILINE):
        assert verb in VERBS


def test_metrics_of_a_training_are_told() -> None:
    """All that rounds of kept trainings say, and each bin of the histogram."""
    page = (ROOT / "docs/file_formats.md").read_text()
    keys = {
        name
        for line in (ROOT / "reproduce/robust/fast_0/training/metrics.jsonl").open()
        for name in json.loads(line)
    }
    assert [name for name in sorted(keys) if f"`{name}`" not in page] == []
    bins = len(HISTOGRAM_EDGES_CM) - 1
    first, last = HISTOGRAM_EDGES_CM[0], HISTOGRAM_EDGES_CM[-1]
    assert f"{bins} bins of {(last - first) / bins:g} cm from {first:g} to {last:g} cm" in page


def test_bench_tests_are_told_by_their_names() -> None:
    page = " ".join((ROOT / "docs/hardware.md").read_text().split())
    assert [each.name for each in BENCH_TESTS if f"`{each.name}`" not in page] == []


def test_files_of_the_map_exist() -> None:
    text = (ROOT / "docs" / "map.md").read_text()
    for path in re.findall(r"`((?:pneumorph|engine)/[\w/.]+)`", text):
        assert (ROOT / path).exists(), path


# Files of the engine that hold no physics: data, threads, vectors, the module.
PLUMBING = {
    "batch", "blas", "lanes", "mode_counts", "model", "numpy_arrays", "padded_part",
    "rubber_system", "thread_pool", "workspace",
}  # fmt: skip


def test_equations_are_numbered_in_order() -> None:
    found = re.findall(r"\\tag\{(\d+)\}|^\| \((\d+)\) \|", _physics(), re.MULTILINE)
    assert [int(a or b) for a, b in found] == list(range(1, len(found) + 1))
    displays = re.findall(r"\$\$(.*?)\$\$", _physics(), re.DOTALL)
    assert all(r"\tag" in formula for formula in displays)


@pytest.mark.parametrize("header", sorted(ROOT.glob("engine/*.hpp")), ids=lambda path: path.stem)
def test_headers_of_the_engine_name_their_equations(header: Path) -> None:
    cited = _cited(header)
    if header.stem in PLUMBING:
        assert not cited
        return
    assert cited, "which equation of docs/physics.md does it compute? Its first lines say so"
    assert max(cited) <= _physics().count(r"\tag{") + 3  # the table of laws has three more


def test_every_equation_of_the_reduced_step_is_in_the_reference_and_in_the_engine() -> None:
    text = _physics()
    section = text[text.index("## The reduced robot") : text.index("### Floors")]
    numbers = {int(number) for number in re.findall(r"\\tag\{(\d+)\}", section)}
    reference = ROOT.glob("pneumorph/simulation/reference_*.py")
    written = {int(n) for path in reference for n in re.findall(r"\((\d+)\)", path.read_text())}
    kept = {23, 25, 26}  # elimination and kept stiffness are the engine's own affair
    assert numbers - kept <= written
    headers = [*ROOT.glob("engine/*.hpp"), ROOT / "engine" / "stepper.cpp"]
    assert numbers <= {number for path in headers for number in _cited(path)}


def _physics() -> str:
    return (ROOT / "docs" / "physics.md").read_text()


def _cited(path: Path) -> set[int]:
    """Equations in the comment at the top of a file, "(28) to (31)" being four, if it names any."""
    top = re.match(r"(?://.*\n)*", path.read_text())
    text = re.sub(r"\s*//\s*", " ", top.group()) if top else ""
    if "docs/physics.md" not in text:
        return set()
    ranges = re.findall(r"\((\d+)\) to \((\d+)\)", text)
    between = {number for a, b in ranges for number in range(int(a), int(b) + 1)}
    return between | {int(number) for number in re.findall(r"\((\d{1,2})\)", text)}
