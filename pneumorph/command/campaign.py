"""Many coopt runs: every seed with every variant of the settings.

A variant is a settings file (JSON or TOML) laid over the preset and the flags. Runs are made one
after another, side by side as processes of this machine (--executor.process-count), or as tasks of
Ray (--executor.backend ray), on this machine or on a cluster (--executor.address) whose machines
must see the same run folder. A run whose worker dies is restarted from its last checkpoint, without
affecting the others. The same command with the same --out resumes a stopped campaign.

Writes VARIANT-SEED/ for each run, as `pneumorph coopt` does, and campaign.json.

Example: pneumorph campaign --preset fast --seeds 0 1 2 --executor.process-count 2 --out runs/seeds
"""

from __future__ import annotations

from pneumorph.command.coopt import VERB as COOPT
from pneumorph.command.verb import Verb
from pneumorph.study.campaign import CampaignSettings, campaign

VERB = Verb(
    CampaignSettings,
    campaign,
    {
        name: (lambda preset=preset: CampaignSettings(run=preset()))  # type: ignore[misc]
        for name, preset in COOPT.presets.items()
    },
)
