"""How to repeat a run: its command, its source, its settings."""

from __future__ import annotations

import shlex

from pneumorph import __version__
from pneumorph.report import page
from pneumorph.report.page import Section
from pneumorph.study.finished_run import FinishedRun


def repeat_section(run: FinishedRun) -> Section:
    """Return the commands that repeat a run and look further, its source and its settings."""
    verb = str(run.summary["verb"])
    made = run.summary.get("made_by", {})
    settings = shlex.quote(str(run.folder / "settings.json"))
    lines = [made["command"]] if "command" in made else []
    lines.append(f"pneumorph {verb} --settings {settings} --out runs/again")
    if run.summary.get("pairs") and verb in ("coopt", "demo"):
        lines.append(
            f"pneumorph evaluate {shlex.quote(str(run.folder))} --model full --pair-count 1"
        )
        lines.append(f"pneumorph explore {shlex.quote(str(run.folder))}")
    body = page.command_lines(lines)
    body += page.paragraph(_source(made), "note") + _calibration(run)
    return Section("How to repeat it", body + page.folded("All settings", dict(run.settings)))


def _source(made: dict[str, str]) -> str:
    if not made:
        return f"Made by an earlier pneumorph; page by pneumorph {__version__}."
    commit = made.get("commit")
    source = f"commit {commit}" if commit else "an installed release"
    python = f", Python {made['python']}" if "python" in made else ""
    return (
        f"Made by pneumorph {made['version']}, {source}{python} on {made['machine']}. The first "
        "command is the one that was typed; the second repeats the run from its settings."
    )


def _calibration(run: FinishedRun) -> str:
    used = run.summary.get("calibration")
    if not isinstance(used, dict):
        return ""
    measured = ", ".join(
        f"{name.replace('_', ' ')} {used[name]:.4g}"
        for name in ("modulus_factor", "stiffness_damping_s", "friction")
        if name in used
    )
    line = f"{used['slope']:.4f} p {used['intercept_kPa']:+.2f} kPa"
    text = f"Pressures: {used['file']}, {line}" + (f"; {measured}" if measured else "")
    return page.paragraph(f"{text}.", "note")
