"""The reduced legs that ship are what their presets ask for today."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pytest

from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.study.reduction_options import ReduceOptions, hyperelastic, measured

PRESETS = {"published": ReduceOptions, "hyperelastic": hyperelastic, "measured": measured}


def leaves(content: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Settings by their whole names."""
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{above}{name}.")
        else:
            yield above + name, value


@pytest.mark.parametrize("leg", PRESETS)
def test_the_leg_was_reduced_with_the_settings_of_its_preset(leg: str) -> None:
    """What an earlier version did not know yet is not in its file."""
    kept = dict(leaves(module_of_leg(leg).reduced.metadata["settings"]))
    asked = dict(leaves(settings_to_dict(PRESETS[leg]().reduction)))
    assert len(kept) >= 12
    assert kept == {name: asked[name] for name in kept}


def test_terms_of_volumes_that_vanish_by_symmetry_are_zero() -> None:
    """With s symmetric and t antisymmetric modes (s^3 + 3 s t^2) / (s + t)^3 of the terms of a
    symmetric change of volume are there, and the others of an antisymmetric one."""
    leg = module_of_leg("measured").reduced
    symmetric = leg.metadata["report"]["symmetric_mode_count"]
    other = leg.mode_count - symmetric
    there = (symmetric**3 + 3 * symmetric * other**2) / leg.mode_count**3
    share = (leg.dilatation_3 != 0.0).mean(axis=(1, 2, 3))
    expected = np.where(share > 0.5, max(there, 1.0 - there), min(there, 1.0 - there))
    np.testing.assert_allclose(share, expected, rtol=1e-12)


@pytest.mark.parametrize("leg", PRESETS)
def test_the_leg_saw_the_equilibria_of_its_preset(leg: str) -> None:
    """Evenly spaced in pressure, up to the highest, or to the last that has an equilibrium."""
    report, asked = module_of_leg(leg).reduced.metadata["report"], PRESETS[leg]().snapshots
    static, blocked = asked.static, asked.blocked
    curves = {"bend": (static.bend_pressure_kPa, static.bend_count)}
    if blocked.count > 0:
        curves["blocked"] = (blocked.pressure_kPa, blocked.count)
    for name, (highest_kPa, count) in curves.items():
        expected = np.linspace(0.0, highest_kPa, count + 1)[1:]
        found = report[name]["pressure_kPa"]
        assert len(found) >= count - 1
        assert found == pytest.approx(expected[: len(found)])
