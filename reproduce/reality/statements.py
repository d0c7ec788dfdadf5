"""How much of what was measured of the real robot the bands of a simulation contain."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from pneumorph.base.artefact import read_json
from pneumorph.catalogue.leg_kinds import load_default_leg
from pneumorph.catalogue.measured_worlds import UNCERTAINTIES
from pneumorph.simulation.distribution import Distribution

HERE = Path(os.path.relpath(Path(__file__).parent))
BEND = HERE.parent / "measured_bend/bend.json"
REAL_LEG = HERE.parent / "measured_bend/real_leg.json"
BEAM = HERE.parent / "released_beam/beam.json"


def bend_bands() -> list[dict[str, Any]]:
    """Bend of the leg that ships at each pressure, 10th to 90th percentile of its modulus.

    Twice the modulus at twice the pressure bends alike, but for the sheet, which hardly stretches.
    Its finite elements were bent up to 105 kPa; beyond, where only the softest leg at 100 kPa is,
    the curve is extrapolated.
    """
    leg = read_json(REAL_LEG, "JSON")
    bent = load_default_leg("measured").metadata["report"]["bend"]
    curve = PchipInterpolator([0.0, *bent["pressure_kPa"]], [0.0, *bent["full_deg"]])
    modulus = Distribution.parse(UNCERTAINTIES["modulus_factor"].distribution)
    spread = modulus.highest - modulus.lowest  # it is uniform
    stiff, soft = modulus.highest - 0.1 * spread, modulus.lowest + 0.1 * spread
    found = []
    for pressure, real in zip(leg["pressure_kPa"], leg["bend_deg"], strict=True):
        low, high = float(curve(pressure / stiff)), float(curve(pressure / soft))
        found.append(
            {
                "pressure_kPa": pressure,
                "band_deg": [low, high],
                "real_deg": real,
                "contained": low <= real <= high,
            }
        )
    return found


def beam_numbers() -> list[dict[str, Any]]:
    """The nine numbers of the released beam, measured and simulated."""
    found = []
    for load in read_json(BEAM, "JSON")["loads"]:
        for name in ("mean_sag_mm", "frequency_Hz", "damping_ratio"):
            found.append({"weight_N": load["weight_N"], "number": name, **load[name]})
    return found


def summary(expert: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """What the measured physics says and the real robot did; the published physics beside it.

    Args:
        expert: Bands of the expert's robot in each physics, as `expert_in_worlds` makes them.
    """
    bends = bend_bands()
    counted = [each["contained"] for each in bends]
    counted += list(expert["measured"]["contained"].values())
    bend = read_json(BEND, "JSON")["prediction"]
    in_published = expert["published"]["contained"]
    return {
        "bend_slope": bend["bend_slope"],
        "bend_mean_error_percent": bend["bend_mean_error_percent"],
        "beam": beam_numbers(),
        "bends": bends,
        "expert": expert,
        "expert_band_cm": expert["measured"]["bands"]["distance_cm"],
        "expert_band_published_cm": expert["published"]["bands"]["distance_cm"],
        "statements_contained": int(np.sum(counted)),
        "statements_total": len(counted),
        "published_expert_statements_contained": int(sum(in_published.values())),
        "published_expert_statements_total": len(in_published),
    }
