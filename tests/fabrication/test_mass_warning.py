"""What is said where built and simulated masses differ."""

from __future__ import annotations

import pytest

from pneumorph.fabrication.mass_warning import mass_warning


@pytest.mark.parametrize("simulated", [(46.8, 30.1), (51.0, 32.5), (42.6, 27.6)])
def test_masses_that_agree_within_a_tenth_are_silent(simulated: tuple[float, float]) -> None:
    leg, hub = simulated
    assert mass_warning({"": (46.8, leg)}, (30.1, hub)) is None


def test_the_published_masses_are_far_from_what_is_built() -> None:
    warning = mass_warning({"": (46.8, 105.0)}, (30.1, 75.0))
    assert warning == (
        "masses differ: leg: 46.8 g as built, 105.0 g in the simulation (+124 %); hub: 30.1 g as "
        "built, 75.0 g in the simulation (+149 %); distances depend on them: simulate and learn "
        "with --masses.model cast"
    )


def test_parts_that_are_no_usual_ones_are_told_by_their_mass() -> None:
    """A hub with thicker walls is not the one that `cast` knows."""
    warning = mass_warning({"": (46.8, 46.8)}, (55.0, 30.1))
    assert warning is not None
    assert "leg:" not in warning
    assert warning.endswith("with --masses.hub-mass-g 55.0")
    both = mass_warning({"": (80.0, 105.0)}, (55.0, 75.0))
    assert both is not None
    assert both.endswith("with --masses.leg-mass-g 80.0 --masses.hub-mass-g 55.0")


def test_a_robot_of_a_file_is_told_by_its_fields() -> None:
    legs = {"short": (19.8, 44.3), "long": (46.8, 47.0)}
    warning = mass_warning(legs, (84.7, 60.0), "plate.toml")
    assert warning == (
        "masses differ: leg short: 19.8 g as built, 44.3 g in the simulation (+124 %); hub: 84.7 g "
        "as built, 60.0 g in the simulation (-29 %); distances depend on them: simulate and learn "
        "with mass_g = 19.8 under [modules.short], mass_kg = 0.0847 under [hub] "
        "(in place of a density) of plate.toml, or make the hub hollow (wall_mm, with its density)"
    )
    warning = mass_warning(legs, (84.7, 60.0), "plate.toml", hollow=True)
    assert warning is not None
    assert warning.endswith("or make its walls thinner (wall_mm, with its density)")
    # One that is built lighter than it is simulated is not to become lighter still.
    light = mass_warning({"long": (46.8, 47.0)}, (50.0, 60.0), "plate.toml")
    assert light is not None
    assert light.endswith("of plate.toml")
