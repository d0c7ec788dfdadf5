"""What tests on a bench found of the numbers that worlds differ in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from pneumorph.catalogue.calibration_check import RELATIVE_TO, relative_to
from pneumorph.catalogue.idle_numbers import reasons_of_idle
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.calibration import Calibration
from pneumorph.study.bench_readings import (
    beyond_usual_worlds,
    hub_mass_notes,
    measured_numbers,
    one_leg_notes,
    read_bench_readings,
)
from pneumorph.study.calibration_provenance import provenance
from pneumorph.study.calibration_settings import CalibrationSettings
from pneumorph.study.fitted_valves import AIR_FACTORS

MODULUS, DAMPING = "modulus_factor", "damping_factor"


def with_bench(
    calibration: Calibration,
    settings: CalibrationSettings,
    spec: RobotSpec,
    say: Callable[[str], None],
) -> Calibration:
    """The calibration with what a table of bench tests found, which replaces what was known.

    Raises:
        ValueError: A reading is of no test that is known, or of valves that are fitted as well.
        FileNotFoundError: The table is missing.
    """
    bench = settings.bench
    assert bench is not None
    readings = read_bench_readings(bench)
    found = measured_numbers(readings, spec)
    both = ", ".join(name for name in found if name in AIR_FACTORS)
    if both and settings.air is not None:
        raise ValueError(
            f"{bench} has readings of {both}, which --air fits as well: they are relative to the "
            "valves before that fit; leave one of both out"
        )
    for told in (*one_leg_notes(readings), *hub_mass_notes(readings)):
        say(told)
    idle = reasons_of_idle(spec, measured_worlds())
    for name, (value, deviation) in found.items():
        if (before := calibration.measured.get(name)) is not None:
            say(
                f"{name} was {before[0]:.4g} +- {before[1]:.2g}: these readings replace it; give "
                "all readings in one file to have them count together"
            )
        say(f"measured {name}: {value:.4g} +- {deviation:.2g}")
        if name in idle:
            say(
                f"the test of {name} changes nothing of this robot in worlds that are drawn as "
                f"usual: {idle[name]}"
            )
        if (note := beyond_usual_worlds(name, value, deviation)) is not None:
            say(note)
    measured = {**calibration.measured, **found}
    earlier = calibration.source.get("bench", {}).get(RELATIVE_TO, {})
    legs = {name: leg for name, leg in earlier.items() if name in measured} | relative_to(
        found, spec.modules
    )
    said = provenance(bench, spec) | ({RELATIVE_TO: legs} if legs else {})
    return replace(calibration, measured=measured, source={**calibration.source, "bench": said})


def without(name: str, calibration: Calibration, say: Callable[[str], None]) -> Calibration:
    """The calibration without what a bench test found of a factor before: the leg that it was
    relative to has changed, and it would count twice."""
    if name not in calibration.measured:
        return calibration
    say(
        f"the {name} that a bench test found before was relative to the leg as it was: it is "
        "left out; measure it again beside this calibration"
    )
    others = {each: v for each, v in calibration.measured.items() if each != name}
    return replace(calibration, measured=others)
