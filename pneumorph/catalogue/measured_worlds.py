"""Worlds that the paper's robot may turn out to live in: what nobody has measured of it, as ranges.

They are the width of not knowing, written down before any robot was trained in them. A range
becomes narrower by a measurement of the robot, not because results look better then.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from pneumorph.catalogue.paper_robot import SURFACES
from pneumorph.physics.surfaces import SKIN_SURFACE
from pneumorph.simulation.randomisation import Randomisation


@dataclass(frozen=True)
class Uncertainty:
    """A range, and whose word it is."""

    distribution: str
    """As `Randomisation` takes it."""
    source: str


UNCERTAINTIES = {
    "friction": Uncertainty(
        SURFACES[SKIN_SURFACE].distribution,
        "Of surfaces that have no range of their own: bare silicone's, see "
        "pneumorph/physics/surfaces.py.",
    ),
    **{
        f"friction {name}": Uncertainty(surface.distribution, surface.source)
        for name, surface in SURFACES.items()
    },
    "modulus_factor": Uncertainty(
        "U(0.85, 1.15)",
        "The model's bend is within a tenth of the ten implied real bends of one leg on average, "
        "a fifth at worst (reproduce/measured_bend); nominally equal "
        "PneuNets of one laboratory scatter by 15 % in the pressure for 90 degrees, and pressure "
        "over modulus is what bends.",
    ),
    "damping_factor": Uncertainty(
        "LogU(0.67, 1.5)",
        "Damping ratios of Dragon Skin 10 beams from 0.053 to 0.077 over load (DiffPD's "
        "experiments); nobody has measured Dragon Skin 30: half as much again either way is an "
        "assumption.",
    ),
    "mass_factor": Uncertainty(
        "U(0.9, 1.1)",
        "A leg that was weighed has 42 g where its shape and density say 46.8, a tenth less.",
    ),
    "regulator_lag_s": Uncertainty(
        "U(0, 0.1)",
        "Tubes and valves of soft robots have RC times from milliseconds to seconds (Stanley and "
        "others 2020); what is beyond a tenth of a second is left to the law of air.",
    ),
    "filling_factor": Uncertainty(
        "LogU(0.5, 2)",
        "The conductance is from one step of a small PneuNet whose volume and supply are unknown "
        "(GeckoBot experiments): a factor of two either way is an assumption. Counts where air has "
        "a law.",
    ),
    "venting_factor": Uncertainty("LogU(0.5, 2)", "As that of filling."),
    "floor_slope_deg": Uncertainty(
        "N(0, 0.5)", "A table that was not levelled: 9 mm in a metre; an assumption."
    ),
    "mounting_angle_deg": Uncertainty(
        "N(0, 1)",
        "Printed seats and legs pressed in by hand: 1 mm over a leg's half length; an assumption.",
    ),
}
"""By the number's name; ``friction sheet`` is that of the surface ``sheet``."""


def measured_worlds(reductions: tuple[Path, ...] = ()) -> Randomisation:
    """The distribution of worlds of the paper's robot.

    Args:
        reductions: Files of other reductions of its leg, from other meshes or other snapshots, that
            worlds may have as well.
    """
    numbers = {name: each.distribution for name, each in UNCERTAINTIES.items() if " " not in name}
    by_surface = tuple((name, UNCERTAINTIES[f"friction {name}"].distribution) for name in SURFACES)
    return replace(
        Randomisation(friction_by_surface=by_surface, reductions=reductions),
        **numbers,  # type: ignore[arg-type]
    )
