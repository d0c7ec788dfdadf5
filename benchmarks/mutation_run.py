"""Plants small mistakes in the package, one at a time, and sees whether the tests notice.

    pip install coverage
    python benchmarks/mutation_run.py --count 150 --out runs/mutation

The mistakes (`mutants.py`) are a sample in an order that a seed fixes, so the first N of it are a
sample too. Each is put into a copy of the repository, and the tests of its own tier that run the
changed lines are run there until one fails: for fem, reduction and simulation the tier is the
folders of `make test-core`, for any other folder the folder of tests of its name. A first run of
these tests tells which lines each of them runs.

Results are lines of results.jsonl; what stands there is not run again, unless it survived and tests
were added (`--again`): the copy takes today's tests, and keeps the package that it was made with.
Equivalent mutants, which no test can tell from the right program, stand in equivalent_mutants.json
with their reason.
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import resource
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mutation_map
import tyro
from mutants import Mutant, mutants_of

import pneumorph
from pneumorph.base.progress import Progress

REPOSITORY = Path(__file__).resolve().parent.parent
EQUIVALENT = Path(__file__).with_name("equivalent_mutants.json")
CORE = ("geometry", "fem", "physics", "reduction", "robot", "simulation")
TIERS = {
    "fem": CORE, "reduction": CORE, "simulation": CORE,
    "environment": ("environment",), "learn": ("learn",), "hardware": ("hardware",),
}  # fmt: skip
# An editable install's own finder would find the package where it is, and not its copy.
NO_EDITABLE = """import sys
sys.meta_path = [it for it in sys.meta_path if not type(it).__module__.startswith("_editable")]
"""
# What a file is called while a mistake stands in its place.
RIGHT = ".right"
# Processor seconds of the tests that one mutant is worth.
WORTH_S = 60.0


def sample(copy: Path, count: int, seed: int) -> list[Mutant]:
    """The first `count` mutants of the folders, in the seed's order."""
    everything = [
        mutant
        for folder in TIERS
        for path in sorted((copy / "pneumorph" / folder).glob("*.py"))
        for mutant in mutants_of(str(path.relative_to(copy)), path.read_bytes())
    ]
    random.Random(seed).shuffle(everything)
    return everything[:count]


def copied(to: Path, renew: bool) -> Path:
    """A copy of what git keeps, and of the engine; where there is one, the tests alone if asked."""
    folders = ["."] if not to.exists() else ["tests"] if renew else ["benchmarks"]
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", *folders],
        cwd=REPOSITORY, check=True, capture_output=True, text=True,
    ).stdout.splitlines()  # fmt: skip
    for name in listed:
        (to / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(REPOSITORY / name, to / name)
    from pneumorph import _engine

    shutil.copy2(_engine.__file__, to / "pneumorph")
    for right in to.rglob(f"*{RIGHT}"):  # an earlier run was stopped
        right.replace(right.with_suffix(".py"))
    (to / "sitecustomize.py").write_text(NO_EDITABLE)
    return to


def run_tests(copy: Path, arguments: Sequence[str], limit_s: float, **more: str) -> tuple[int, str]:
    """Exit status and output of pytest in the copy, killed past this processor time."""
    limit = int(limit_s)
    environment = {
        **os.environ, **more,
        "PYTHONPATH": f"{copy}:{copy / 'benchmarks'}:{os.environ.get('PYTHONPATH', '')}",
        "JAX_COMPILATION_CACHE_DIR": str(copy / ".jax"), "OPENBLAS_NUM_THREADS": "1",
    }  # fmt: skip
    environment.pop("PYTHONUNBUFFERED", None)  # hides what is not flushed
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist",
             "--tb=line", "-m", "not alone", *arguments],
            cwd=copy, env=environment, capture_output=True, text=True, timeout=10 * limit,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5)),
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return -1, ""
    return done.returncode, done.stdout


def map_tests(copy: Path, out: Path, say: Progress) -> dict[str, dict[str, Any]]:
    """What each test runs; test files that did not change since the last time are not run again."""
    kept = out / "tests.json"
    known = json.loads(kept.read_text()) if kept.exists() else {}
    for folder in sorted({name for tier in TIERS.values() for name in tier}):
        stale = {}
        for path in sorted((copy / "tests" / folder).glob("test_*.py")):
            name, digest = str(path.relative_to(copy)), hashlib.sha1(path.read_bytes()).hexdigest()
            if known.get(name, {}).get("sha1") != digest:
                stale[name] = digest
        if not stale:
            continue
        say.stage(f"which lines the tests of {folder} run")
        part = out / "part.json"
        status, told = run_tests(
            copy,
            ["-p", "mutation_map", "--continue-on-collection-errors", *stale],
            3600,
            **{mutation_map.OUT: str(part)},
        )
        if status not in (0, 1):
            raise RuntimeError(f"the tests of {folder} do not run in the copy {copy}:\n{told}")
        found = json.loads(part.read_text())
        for name, digest in stale.items():
            known[name] = {"sha1": digest, "tests": found.get(name, {})}
        kept.write_text(json.dumps(known))
    return known


def tests_for(mutant: Mutant, known: dict[str, dict[str, Any]]) -> tuple[list[str], int, float]:
    """The tests of its tier that run its lines, its own file's first, then the cheapest; how many
    are left out; and the processor seconds that they take without a mistake."""
    tier = TIERS[mutant.path.split("/")[1]]
    files = {}
    for name, file in known.items():
        if name.split("/")[1] in tier:
            touching = {
                test: each["s"]
                for test, each in file["tests"].items()
                if mutant.path in each["lines"]
            }
            exact = {
                test: seconds
                for test, seconds in touching.items()
                if not mutant.lines.isdisjoint(file["tests"][test]["lines"][mutant.path])
            }
            files[name] = (exact, touching)
    # What runs on import alone, as a setting's default, is run by whatever runs the file.
    column = 0 if any(exact for exact, _ in files.values()) else 1
    chosen: list[str] = []
    left_out, spent = 0, 0.0
    own = f"test_{Path(mutant.path).stem}.py"
    order = sorted(
        files, key=lambda name: (Path(name).name != own, sum(files[name][column].values()))
    )
    for tests in (files[name][column] for name in order):
        for test, seconds in sorted(tests.items(), key=lambda item: item[1]):
            if spent + seconds > WORTH_S:
                left_out += 1
            else:
                chosen.append(test)
                spent += seconds
    return chosen, left_out, spent


def staged(tests: Sequence[str]) -> list[list[str]]:
    """The first two files' tests, which catch most, and the rest: collecting takes time as well."""
    files = list(dict.fromkeys(test.split("::")[0] for test in tests))
    first = [test for test in tests if test.split("::")[0] in files[:2]]
    return [some for some in (first, [test for test in tests if test not in first]) if some]


def tried(mutant: Mutant, copy: Path, known: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """What became of a mutant."""
    tests, left_out, spent_s = tests_for(mutant, known)
    row: dict[str, Any] = {"mutant": mutant.name, "tests": len(tests), "left_out": left_out}
    file = copy / mutant.path
    source = file.read_bytes()
    file.with_suffix(RIGHT).write_bytes(source)
    file.write_bytes(mutant.applied(source))
    status, told = 0, ""
    try:
        for some in staged(tests):
            status, told = run_tests(copy, ["-x", *some], 60 + 2 * spent_s)
            if status != 0:
                break
        else:  # what measures times, and starts processes of its own, which no map sees
            alone = [
                str(path.relative_to(copy))
                for name in TIERS[mutant.path.split("/")[1]]
                for path in (copy / "tests" / name).glob("test_*.py")
                if "mark.alone" in path.read_text()
            ]
            if alone:
                status, told = run_tests(copy, ["-x", "-m", "alone", *alone], 120)
    finally:
        file.with_suffix(RIGHT).replace(file)
    failed = [line for line in told.splitlines() if line.startswith(("FAILED", "ERROR"))]
    row["by"] = failed[0][:160] if failed else ""
    if status == 0:
        return {**row, "outcome": "survived"}
    if status in (1, 2, 4):  # 4: nothing could be collected
        return {**row, "outcome": "caught"}
    return {**row, "outcome": "out of time" if status in (-1, -24, -9) else f"stopped by {status}"}


def main(
    count: int = 150,
    seed: int = 0,
    out: Path = Path("runs/mutation"),
    again: bool = False,
    show: bool = False,
) -> None:
    """Try the first mutants of the sample that were not tried yet, and sum up.

    Args:
        count: How many of the sample.
        seed: Which sample.
        out: Folder of the copy, of what the tests run and of the results.
        again: Try those that survived again, with the tests of today.
        show: Sum up alone.
    """
    out = out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    results = out / "results.jsonl"
    rows = {}
    for line in results.read_text().splitlines() if results.exists() else ():
        row = json.loads(line)
        rows[row["mutant"]] = row  # a later one overrides
    copy = copied(out / "copy", again)
    mutants = sample(copy, count, seed)
    listed = json.loads(EQUIVALENT.read_text())
    equivalent = {
        mutant.name
        for mutant in mutants
        if mutant.is_one_of(listed, (copy / mutant.path).read_bytes())
    }
    if not show:
        say = Progress()
        known = map_tests(copy, out, say)
        todo = [
            mutant
            for mutant in mutants
            if mutant.name not in rows
            or (
                again
                and rows[mutant.name]["outcome"] == "survived"
                and mutant.name not in equivalent
            )
        ]
        say.stage("mutants")
        for done, mutant in enumerate(todo):
            say(done, len(todo))
            rows[mutant.name] = tried(mutant, copy, known)
            with results.open("a") as file:
                file.write(json.dumps(rows[mutant.name]) + "\n")
        say(len(todo), len(todo))
    had = [rows[mutant.name] for mutant in mutants if mutant.name in rows]
    survived = [row["mutant"] for row in had if row["outcome"] == "survived"]
    same = [name for name in survived if name in equivalent]
    print(dict(Counter(row["outcome"] for row in had)))
    for name in survived:
        print(f"  {'equivalent' if name in equivalent else 'SURVIVED  '} {name}")
    different = max(len(had) - len(same), 1)
    print(f"{len(had)} mutants, {len(same)} of them equivalent; "
          f"{1 - (len(survived) - len(same)) / different:.1%} of the others caught")  # fmt: skip


if __name__ == "__main__":
    assert Path(pneumorph.__file__).is_relative_to(REPOSITORY), "another pneumorph is imported"
    tyro.cli(main, description=__doc__)
