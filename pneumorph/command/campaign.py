"""Many coopt runs: every seed with every variant of the settings.

A variant is a settings file (JSON or TOML) laid over the preset and the flags. Runs are made one
after another, side by side as processes of this machine (--executor.process-count), or as tasks of
Ray (--executor.backend ray), on this machine or on a cluster (--executor.address) whose machines
must see the same run folder. A run whose worker dies is restarted from its last checkpoint, without
affecting the others. The same command with the same --out resumes a stopped campaign.

Writes VARIANT-SEED/ for each run, as `pneumorph coopt` does, and campaign.json. The pages of the
runs are drawn at the end, unless --no-page is given.

Example: pneumorph campaign --preset fast --seeds 0 1 2 --executor.process-count 2 --out runs/seeds
"""

from __future__ import annotations

from pathlib import Path

from pneumorph.base.run_folder import SUMMARY, RunFolder
from pneumorph.command.coopt import VERB as COOPT
from pneumorph.command.verb import Verb
from pneumorph.report.run_page import write_run_page
from pneumorph.study.campaign import Campaign, CampaignSettings, campaign
from pneumorph.study.finished_run import FinishedRun


def run(settings: CampaignSettings, folder: RunFolder) -> Campaign:
    """Make the runs, and show each on a page."""
    found = campaign(settings, folder)
    folder.progress.stage("drawing the pages")
    for each in found.runs:
        try:
            _draw_page(folder.path / each.name)
        except (OSError, ValueError) as error:  # what was learned is there all the same
            again = f"`pneumorph report {folder.path / each.name}` draws it"
            folder.progress.say(f"no page of {each.name}: {error}; {again}")
    return found


def _draw_page(place: Path) -> None:
    """Draw a run's page, if it asks for one and has none that is newer than itself."""
    made, page = FinishedRun.read(place), place / "report/page.html"
    is_there = page.exists() and page.stat().st_mtime_ns >= (place / SUMMARY).stat().st_mtime_ns
    if made.settings.get("page", True) and not is_there:
        write_run_page(made, page)


VERB = Verb(
    CampaignSettings,
    run,
    {
        name: (lambda preset=preset: CampaignSettings(run=preset()))  # type: ignore[misc]
        for name, preset in COOPT.presets.items()
    },
)
