"""Plants mistakes in the engine, one at a time, and sees whether the tests notice.

    python benchmarks/engine_mutation_run.py --out runs/engine_mutation

The mistakes stand in `engine_mutants.json`: a file, a text of it and what takes its place, an
expression or a statement. The engine compiles for minutes, so it is compiled once, in a copy of the
repository and for the one instruction set of this machine's processor, with all of them in it:
each where a switch chooses, which the environment sets and which is off by default. For every
mistake the tests of its subject, which are named beside it, are run until one fails, and with
`--whole` the rest of tests/simulation after them. The test that fails is then run with the switch
off, and must pass.

Results are lines of results.jsonl; what stands there is not run again, unless it survived and tests
were added (`--again`).
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tyro
from mutation_run import copied, run_tests

import pneumorph
from pneumorph.base.progress import Progress

MISTAKES = Path(__file__).with_name("engine_mutants.json")
SWITCH = "PNEUMORPH_PLANTED"
# Read once for each file of the engine, before anything steps.
HEADER = f"""#pragma once
#include <cstdlib>
namespace {{
const int kPlanted = std::getenv("{SWITCH}") ? std::atoi(std::getenv("{SWITCH}")) : 0;
}}
"""
# Processor seconds that the tests may take.
LIMIT_S = 900.0
# The engine has one instruction set; tests that ask for others by name are left out.
ONE_SET = "not avx2 and not baseline"


def planted(source: str, number: int, mistake: dict[str, str]) -> str:
    """The source with the mistake and what is right, of which the switch chooses one."""
    was, becomes = mistake["was"], mistake["becomes"]
    within = mistake.get("within", was)
    if source.count(within) != 1 or within.count(was) != 1:
        raise ValueError(f"{mistake['file']} does not have this once: {within}")
    if was.endswith(";"):
        choice = f"if (kPlanted == {number}) {{ {becomes} }} else {{ {was} }}"
    else:
        choice = f"(kPlanted == {number} ? ({becomes}) : ({was}))"
    return source.replace(within, within.replace(was, choice))


def built(copy: Path, mistakes: Sequence[dict[str, str]]) -> None:
    """Puts the engine with all mistakes beside the package in the copy."""
    header = copy / "engine" / "planted.hpp"
    header.write_text(HEADER)
    for number, mistake in enumerate(mistakes, 1):
        file = copy / mistake["file"]
        file.write_text(planted(file.read_text(), number, mistake))
    rules = copy / "CMakeLists.txt"
    kept = [
        line
        for line in rules.read_text().splitlines()
        if not line.lstrip().startswith(("add_stepper(avx", "target_compile_definitions(_engine"))
    ]
    rules.write_text("\n".join(kept) + "\n")
    build = copy / ".cache" / "planted"
    commands = (
        ["cmake", "-S", copy, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
         f"-DPython_EXECUTABLE={sys.executable}", "-DSKBUILD_SABI_COMPONENT=",
         f"-DCMAKE_CXX_FLAGS=-march=native -include {header}"],
        ["ninja", "-C", build, "-j1"],
    )  # fmt: skip
    for command in commands:
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    for engine in (copy / "pneumorph").glob("_engine*"):
        engine.unlink()
    shutil.copy2(next(build.glob("_engine*")), copy / "pneumorph")


def tried(copy: Path, number: int, tests: Sequence[str], passing: set[str]) -> dict[str, Any]:
    """What became of a mistake; a test that fails with it must pass without. `passing` grows."""
    status, told = run_tests(copy, ["-x", "-k", ONE_SET, *tests], LIMIT_S, **{SWITCH: str(number)})
    failed = [line for line in told.splitlines() if line.startswith(("FAILED", "ERROR"))]
    test = failed[0].split(" ")[1] if failed else ""
    if failed and test not in passing:
        right, told = run_tests(copy, [test], LIMIT_S)
        if right != 0:
            raise SystemExit(f"{test} fails without any mistake:\n{told}")
        passing.add(test)
    outcome = "survived" if status == 0 else "caught" if failed else f"stopped by {status}"
    return {"outcome": outcome, "by": test, "tests": list(tests)}


def main(
    out: Path = Path("runs/engine_mutation"),
    whole: bool = False,
    again: bool = False,
    show: bool = False,
) -> None:
    """Try the mistakes that were not tried yet, and sum up.

    Args:
        out: Folder of the copy and of the results.
        whole: Run all of tests/simulation after the tests of the mistake's own subject.
        again: Try those that survived again, with the tests of today.
        show: Sum up alone.
    """
    out = out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    results = out / "results.jsonl"
    mistakes = json.loads(MISTAKES.read_text())
    rows: dict[str, dict[str, Any]] = {}
    for line in results.read_text().splitlines() if results.exists() else ():
        row = json.loads(line)
        rows[row["mistake"]] = row  # a later one overrides
    if not show:
        say = Progress()
        copy = out / "copy"
        planted_here = copy / ".planted"
        texts = [{k: v for k, v in each.items() if k != "tests"} for each in mistakes]
        if not planted_here.exists():
            shutil.rmtree(copy, ignore_errors=True)
            copied(copy, False)
            say.stage("the engine with all mistakes")
            built(copy, mistakes)
            planted_here.write_text(json.dumps(texts))
        elif json.loads(planted_here.read_text()) != texts:
            raise SystemExit(f"{copy} was built with other mistakes: remove it")
        elif again:
            copied(copy, True)
        todo = [
            (number, mistake)
            for number, mistake in enumerate(mistakes, 1)
            if mistake["name"] not in rows
            or (again and rows[mistake["name"]]["outcome"] == "survived")
        ]
        passing = {row["by"] for row in rows.values() if row["by"]}
        say.stage("mistakes")
        for done, (number, mistake) in enumerate(todo):
            say(done, len(todo))
            tests = [*mistake["tests"], *(["tests/simulation"] if whole else [])]
            row = {"mistake": mistake["name"], **tried(copy, number, tests, passing)}
            rows[mistake["name"]] = row
            with results.open("a") as file:
                file.write(json.dumps(row) + "\n")
        say(len(todo), len(todo))
    for mistake in mistakes:
        row = rows.get(mistake["name"], {"outcome": "not tried", "by": ""})
        print(f"{row['outcome']:10} {mistake['file']}: {mistake['name']}  {row['by']}")


if __name__ == "__main__":
    assert Path(pneumorph.__file__).parent.parent == Path(__file__).resolve().parent.parent
    tyro.cli(main, description=__doc__)
