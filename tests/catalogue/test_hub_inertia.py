"""An inertia that no hub of its size has is in another unit and is refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.geometry.mass_properties import MassProperties

MASS_KG = 0.081
HERE = Path()


def weighed(moments: Sequence[float], centre_mm: Sequence[float] = (0.0, 0.0, 36.0)):
    """A plate of 150 x 90 x 10 mm with principal moments of inertia [kg mm^2]."""
    x, y, z = map(float, moments)
    return HubDescription(
        "box", length_mm=150.0, width_mm=90.0, height_mm=10.0, bottom_mm=31.0, mass_kg=MASS_KG,
        centre_mm=tuple(centre_mm),
        inertia_kg_mm2=((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)),
    )  # fmt: skip


SOLID = MASS_KG / 12.0 * np.array([90**2 + 10**2, 150**2 + 10**2, 150**2 + 90**2])


def test_the_plates_own_inertia_is_taken_as_it_is() -> None:
    mass = weighed(SOLID).spec(HERE).mass
    assert isinstance(mass, MassProperties)
    np.testing.assert_allclose(np.diag(mass.inertia), SOLID)


@pytest.mark.parametrize(
    ("factor", "value", "radius"),
    [(1e3, "2.066e+05", "1.6e+03"), (1e-6, "0.0002066", "0.0505"), (1e-2, "2.066", "5.05")],
    ids=["g mm^2", "kg m^2", "kg cm^2"],
)
def test_another_unit_is_told_with_value_range_and_cause(
    factor: float, value: str, radius: str
) -> None:
    told = (
        f"largest principal moment of inertia_kg_mm2 is {value} at a mass of 0.081 kg, a radius of "
        f"gyration of {radius} mm, expected 4.6 to 2487 (7.5 to 175 mm) of a hub of 150 x 90 x 10 "
        "mm: it is in kg mm^2; g mm^2 are 1000 times more, kg m^2 a millionth"
    )
    with pytest.raises(ValueError, match=re.escape(told)):
        weighed(SOLID * factor).spec(HERE)


@pytest.mark.parametrize(
    ("radius_mm", "centre_mm"),
    [
        (8.0, (0.0, 0.0, 36.0)),  # all of it in the middle: motors on a thin plate
        (87.0, (0.0, 0.0, 36.0)),  # all of it in the corners
        (150.0, (0.0, 0.0, 186.0)),  # half of it on top of a mast of 300 mm
        (120.0, (0.0, 0.0, 76.0)),  # a tenth of it on top of one of 400 mm
    ],
)
def test_hubs_that_can_be_built_are_not_refused(
    radius_mm: float, centre_mm: tuple[float, float, float]
) -> None:
    most = MASS_KG * radius_mm**2
    weighed((0.6 * most, 0.8 * most, most), centre_mm).spec(HERE)


def test_an_inertia_about_axes_of_its_own_is_judged_by_its_largest_moment() -> None:
    """Each entry of it is small enough, and the largest principal moment is not."""
    usual = weighed(SOLID)
    most = MASS_KG * 170.0**2
    turned = np.array([[most, most / 2, 0.0], [most / 2, most, 0.0], [0.0, 0.0, most]])
    rows = tuple(tuple(row) for row in turned.tolist())
    with pytest.raises(ValueError, match=r"a radius of gyration of 208 mm, expected"):
        HubDescription(**{**vars(usual), "inertia_kg_mm2": rows}).spec(HERE)
