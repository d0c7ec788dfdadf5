"""The bend of a held leg at rising pressure, as far as there are equilibria."""

from __future__ import annotations

import pytest
from helpers.small_robot import small_leg

from pneumorph.fem.bend import end_face_bend_deg
from pneumorph.fem.bend_curve import bend_curve
from pneumorph.fem.static import StaticSettings, static_equilibrium


def test_bends_are_those_of_the_equilibria() -> None:
    """To the tolerance of the search: each is reached from the one before, or from rest."""
    part, told = small_leg(), []
    curve = bend_curve(
        part, [4.0, 10.0], held="left", face="right", progress=lambda *said: told.append(said)
    )
    assert (curve.converged, curve.reached_kPa) == (True, 10.0)
    assert curve.pressure_kPa == [4.0, 10.0]
    assert told == [(1, 2, "bending the leg"), (2, 2, "bending the leg")]
    for pressure, bend in zip(curve.pressure_kPa, curve.bend_deg, strict=True):
        alone = static_equilibrium(part, pressure, part.mesh.node_set("left"))
        expected = end_face_bend_deg(part.mesh, alone.positions, "right")
        assert bend == pytest.approx(expected, rel=1e-5)
    assert curve.bend_deg[1] > curve.bend_deg[0] > 0.0


def test_a_curve_ends_where_no_equilibrium_is_found() -> None:
    settings = StaticSettings(tolerance=1e-300, iteration_limit=2, halving_limit=0)
    part = small_leg()
    curve = bend_curve(part, [4.0, 10.0], held="left", face="right", settings=settings)
    assert (curve.pressure_kPa, curve.bend_deg) == ([], [])
    assert (curve.converged, curve.reached_kPa) == (False, 0.0)


@pytest.mark.parametrize("pressures", [[], [0.0, 10.0], [10.0, 10.0], [10.0, 4.0]])
def test_pressures_that_do_not_rise_are_refused(pressures: list[float]) -> None:
    with pytest.raises(ValueError, match="pressures_kPa must rise from above 0"):
        bend_curve(small_leg(), pressures, held="left", face="right")
