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
from pneumorph.report.run_page import RUN_PAGE, page_of_finished
from pneumorph.study.campaign import Campaign, CampaignSettings, campaign
from pneumorph.study.finished_run import FinishedRun


def run(settings: CampaignSettings, folder: RunFolder) -> Campaign:
    """Make the runs, and show each on a page."""
    found = campaign(settings, folder)
    made = [FinishedRun.read(folder.path / each.name) for each in found.runs]
    lacking = [run for run in made if run.settings.get("page", True) and not _has_page(run.folder)]
    if lacking:
        folder.progress.stage("drawing the pages")
    for each in lacking:
        page_of_finished(each, folder.progress)
    return found


def _has_page(place: Path) -> bool:
    """Whether a run has a page that is newer than itself."""
    page = place / RUN_PAGE
    return page.exists() and page.stat().st_mtime_ns >= (place / SUMMARY).stat().st_mtime_ns


VERB = Verb(
    CampaignSettings,
    run,
    {
        name: (lambda preset=preset: CampaignSettings(run=preset()))  # type: ignore[misc]
        for name, preset in COOPT.presets.items()
    },
)
