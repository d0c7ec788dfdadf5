"""The tutorials' blocks run, in their order, in an empty folder.

`bash` and `python` blocks are run; other blocks show what takes longer. A comment before a block,
``<!-- when tested: VERB FLAGS -->``, adds flags to the lines of that verb, to make it small; what
Python trains after `coopt` has these flags too.
"""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from pneumorph.cli import VERBS, _parsed, run
from pneumorph.study.training_options import PRESETS

DOCS = Path(__file__).parent.parent / "docs"
BLOCK = re.compile(r"((?:<!-- when tested: .*? -->\n)*)```(bash|python)\n(.*?)```", re.DOTALL)


def run_blocks(page: str) -> list[str]:
    """Run the blocks of a page where one stands; return the verbs that were run."""
    verbs: list[str] = []
    small: dict[str, str] = {}
    for comments, language, text in BLOCK.findall((DOCS / page).read_text()):
        added = dict(
            comment.split(" ", 1) for comment in re.findall(r"when tested: (.*?) -->", comments)
        )
        assert set(added) <= set(VERBS)
        if language == "python":
            verb = import_module("pneumorph.command.coopt").VERB
            quick = _parsed("coopt", verb, "", shlex.split(small.get("coopt", "")))[0]
            with pytest.MonkeyPatch.context() as patch:
                patch.setitem(PRESETS, "quick", partial(replace, quick))
                exec(compile(text, page, "exec"), {"__name__": "__tutorial__"})
            continue
        small |= added
        for line in text.strip().splitlines():
            program, verb, *flags = shlex.split(line)
            assert program == "pneumorph", line
            assert run([verb, *flags, *shlex.split(added.get(verb, ""))]) == 0, line
            verbs.append(verb)
    return verbs


def summary(folder: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(Path("runs", folder, "summary.json").read_text())
    return content


def test_the_tutorial_ends_with_a_robot_that_crawls(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert set(run_blocks("tutorial.md")) == {
        "simulate", "report", "baseline", "coopt", "explore", "evaluate",
    }  # fmt: skip
    assert "completed" in capsys.readouterr().out
    first, baseline, quick = summary("first"), summary("baseline"), summary("quick")
    # Rounding moves such walks by less than this.
    assert first["distance_cm"] == pytest.approx(2.18, abs=0.2)
    # Its best phase of four is that of the first walk.
    assert baseline["baseline_best_phase_deg"] == 60.0
    assert baseline["baseline_best_distance_cm"] == pytest.approx(first["distance_cm"], abs=0.2)
    # So short a training learns nothing; what it found goes through all that follows.
    certificate = quick["certificate"]
    assert (certificate["world_count"], len(certificate["pairs"])) == (6, 2)
    assert quick["median_cm"] == certificate["pairs"][0]["band"]["median_cm"]
    slippery, worlds = summary("slippery"), summary("worlds")
    assert slippery["design"] == quick["best_design"]
    assert slippery["simulated_s"] == pytest.approx(4.0)
    walked = quick["replayed_distance_cm"]
    assert abs(slippery["distance_cm"] - walked) > 1e-3  # another friction is another walk
    first_pair = worlds["pairs"][0]
    assert first_pair["reported_distance_cm"] == quick["best_distance_cm"]
    for again in (first_pair["distance_cm"], certificate["pairs"][0]["nominal_cm"]):
        assert again == pytest.approx(walked, abs=0.05)
    assert worlds["robustness"]["world_count"] == 4
    for page in (
        "first/report/page.html",
        "quick/report/page.html",
        "quick/explorer/explorer.html",
    ):
        assert Path("runs", page).stat().st_size > 100_000


def test_a_leg_of_ones_own_comes_to_a_gait(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("netgen")
    monkeypatch.chdir(tmp_path)
    verbs = run_blocks("own_leg.md")
    assert [verb for verb in verbs if verb not in ("report", "explore")] == [
        "mesh", "reduce", "simulate", "coopt",
    ]  # fmt: skip
    mesh, leg = summary("own-mesh"), summary("own-leg")
    # Six chambers of 6 x 15 x 14 and a channel of 92 x 4 x 3 mm, less what they share: the
    # first and the last chamber reach 2 mm beyond the channel.
    shared = (4 + 4 * 6 + 4) * 4 * 3
    assert mesh["cavity_volume_mm3"] == pytest.approx(6 * 1260 + 1104 - shared, rel=1e-6)
    assert mesh["contact_point_count"] > 30
    # 0.2 percent with 8 snapshots.
    assert leg["bend_error_percent"] < 2.0
    assert leg["sampling_converged"]
    walk, learned = summary("own-walk"), summary("own-coopt")
    assert walk["leg"]["mesh_digest"] == mesh["digest"]
    # It slides back; another mesh of the same size may change a walk by 15 percent.
    assert walk["distance_cm"] == pytest.approx(-1.0, abs=0.5)
    assert (walk["physics"]["friction"], walk["physics"]["stiffness_damping_s"]) == (0.55, 0.0)
    assert learned["best_distance_cm"] > 1.0  # of drawn gaits of 4 s, the best of 40
    nominal = learned["certificate"]["pairs"][0]["nominal_cm"]
    assert learned["replayed_distance_cm"] == pytest.approx(nominal, abs=0.05)


def test_what_the_other_pages_show_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run_blocks("look.md")
    assert (tmp_path / "design.pdf").exists()
