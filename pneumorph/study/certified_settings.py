"""What decides the new legs of a certificate; a folder with legs of other settings is refused."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.run_folder import SETTINGS, SUMMARY, read_settings
from pneumorph.catalogue.robot_identity import reduction_digest, touching_identity
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.simulation.randomised_simulator import reduction_digests
from pneumorph.study.certified_candidates import Candidates, CertificateSettings, RoundSettings
from pneumorph.study.finished_run import Pair
from pneumorph.study.reduce_settings import ReduceSettings
from pneumorph.study.study_once import refuse_others

SAID_NOW = (
    *("certificate", "physics", "leg", "contact_points", "reductions"),
    *("hub_mass", "hub_model", "mounting_angle_deg", "full_order", "ground", "settling_step_count"),
    "pairs",
)
"""What new legs of earlier versions do not say."""
_COUNTS = ("pair_count", "world_count", "world_seed", "tuning_world_count", "worst_world_count")


def made_of_settings(
    candidates: Candidates,
    settings: CertificateSettings,
    spec: RobotSpec,
    reduction: ReduceSettings,
) -> dict[str, Any]:
    """What decides how new legs are made and which walks they are made from.

    Raises:
        FileNotFoundError: No file of the ground.
        ValueError: It is no grid of heights.
    """
    drawn, full_order = settings.randomisation, spec.full_order.by_name()
    del full_order["thread_count"]  # changes no bit
    walked = replace(
        settings,
        cycle_s=CertificateSettings.cycle_s,
        rounds=RoundSettings(),
        randomisation=replace(drawn, reductions=()),
    )
    return {
        "certificate": walked,
        "physics": spec.physics,
        "leg": reduction_digest(spec),
        "contact_points": touching_identity(spec, drawn) or None,
        "reductions": sorted(reduction_digests(drawn).values()),
        "reduction": reduction,
        "hub_mass": spec.hub.mass_numbers(),
        "hub_model": spec.hub_model,
        "mounting_angle_deg": spec.mounting_angle_deg,
        "full_order": full_order,
        "ground": spec.physics.ground.file_identity(),
        "settling_step_count": candidates.task.settling_step_count,
        "pairs": {f"L{rank}": _told_apart(pair) for rank, pair in enumerate(candidates.pairs, 1)},
    }


def _told_apart(pair: Pair) -> str:
    """A design and a digest of its gait, wherever that lies."""
    gait = pair.gait
    content = np.concatenate([gait.start_s, gait.held_kPa.ravel(), [gait.duration_s]])
    return f"{pair.design} {hashlib.sha256(content.tobytes()).hexdigest()[:12]}"


def refuse_other_legs(folder: Path, made_of: Mapping[str, Any]) -> None:
    """Refuse a folder whose first new leg is of something else.

    Raises:
        ValueError: It is; names the first setting that differs.
    """
    first = folder / "round_1"
    if not (first / SUMMARY).exists():
        return
    refuse_others(first, made_of, later=SAID_NOW)
    if "certificate" in read_settings(first) or not (folder / SUMMARY).exists():
        return
    if (folder / SETTINGS).exists():  # of an earlier version: the verb's say how many walked
        said = read_settings(folder).get("certificate", {})
        kept = {name: said[name] for name in _COUNTS if name in said}
        asked = {name: getattr(made_of["certificate"], name) for name in kept}
        if kept != asked:
            raise ValueError(
                f"{folder} holds new legs of a certificate of other settings ({kept}), expected "
                f"the same ({asked}); choose another folder"
            )
