"""How to repeat a run: its command, its source, its settings."""

from __future__ import annotations

import shlex

from pneumorph import __version__
from pneumorph.base.provenance import Provenance
from pneumorph.report import page
from pneumorph.report.page import Section
from pneumorph.study.finished_run import FinishedRun


def repeat_section(run: FinishedRun) -> Section:
    """Return the commands that repeat a run and look further, its source and its settings."""
    verb, made = run.verb, run.made_by
    settings = shlex.quote(str(run.folder / "settings.json"))
    lines = [made.command] if made is not None and made.command is not None else []
    if run.own_task is None:
        lines.append(f"pneumorph {verb} --settings {settings} --out runs/again")
    if verb in ("coopt", "demo") and run.of_summary("pairs", list):
        lines.append(
            f"pneumorph evaluate {shlex.quote(str(run.folder))} --model full --pair-count 1"
        )
        lines.append(f"pneumorph explore {shlex.quote(str(run.folder))}")
    body = page.command_lines(lines)
    body += page.paragraph(_source(made, run.own_task), "note") + _calibration(run)
    return Section("How to repeat it", body + page.folded("All settings", dict(run.settings)))


def _source(made: Provenance | None, own_task: str | None) -> str:
    if made is None:
        return f"Made by an earlier pneumorph; page by pneumorph {__version__}."
    source = f"commit {made.commit}" if made.commit else "an installed release"
    python = f", Python {made.python}" if made.python else ""
    said = f"Made by pneumorph {made.version}, {source}{python} on {made.machine}."
    if own_task is not None:
        return (
            f"{said} The task {own_task} is no setting: pneumorph.train is given it to repeat this."
        )
    if made.command is None:
        return said
    return (
        f"{said} The first command is the one that was typed; the second repeats the run from its "
        "settings."
    )


def _calibration(run: FinishedRun) -> str:
    used = run.calibration
    if used is None:
        return ""
    measured = ", ".join(
        f"{name.replace('_', ' ')} {value:.4g}"
        for name in ("modulus_factor", "stiffness_damping_s", "friction")
        if (value := getattr(used, name)) is not None
    )
    line = f"{used.slope:.4f} p {used.intercept_kPa:+.2f} kPa"
    text = f"Pressures: {used.said}, {line}" + (f"; {measured}" if measured else "")
    return page.paragraph(f"{text}.", "note")
