"""How chambers grow with pressure, as a reduced part says it of itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_part, synthetic_reduced_part

from pneumorph.reduction.chamber_growth import fitted_growth
from pneumorph.reduction.reduce import reduce_part
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings, bend_snapshots

PRESSURE_KPA = np.linspace(5.0, 105.0, 21)


@pytest.mark.parametrize("growth", [(0.016, 0.0, 1e-6), (0.0, 2e-4, 0.0), (0.01, 1e-5, 1e-7)])
def test_a_polynomial_without_negative_numbers_is_found(growth: tuple[float, ...]) -> None:
    """Its numbers have no more digits than are told."""
    ratio = np.polynomial.polynomial.polyval(PRESSURE_KPA, (1.0, *growth))
    found = fitted_growth(PRESSURE_KPA, ratio)
    np.testing.assert_allclose(found, growth, rtol=1e-12, atol=1e-12)


def test_chambers_never_shrink_beyond_their_pressures() -> None:
    """A growth that levels off would be a falling cubic."""
    found = fitted_growth(PRESSURE_KPA, 1.0 + np.tanh(PRESSURE_KPA / 40.0))
    assert min(found) >= 0.0
    assert max(found) > 0.0
    assert fitted_growth(PRESSURE_KPA[:0], PRESSURE_KPA[:0]) == ()


def test_a_reduced_part_grows_as_its_finite_elements_do() -> None:
    """On the modes of all of its free bends, whose volumes the cubic misses by less than 1 %."""
    model = synthetic_part((4, 4, 4))
    bent = bend_snapshots(model, StaticSnapshotSettings(bend_pressure_kPa=60.0, bend_count=6))
    settings = ReductionSettings(
        mode_tolerance=1e-6, mode_limit=60, holdout_every=0, symmetric=False
    )
    part, report = reduce_part(model, bent, settings)
    assert part.chamber_growth == tuple(report.chamber_growth)
    rest = model.cavity_volume(model.rest_nodes)
    for moved, pressure in zip(bent.displacement[1:], bent.pressure_kPa[1:], strict=True):
        volume = model.cavity_volume(model.rest_nodes + moved)
        grown = np.polynomial.polynomial.polyval(pressure, (1.0, *part.chamber_growth))
        assert grown == pytest.approx(volume / rest, rel=0.01)
    assert grown > 1.05


def test_a_part_that_was_not_asked_says_nothing() -> None:
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    assert part.chamber_growth is None
    asked = replace(part, metadata={**part.metadata, "report": {"chamber_growth": []}})
    assert asked.chamber_growth is None
