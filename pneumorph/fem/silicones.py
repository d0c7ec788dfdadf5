"""Silicones that soft robots are cast of, as measured: constants of Yeoh's law and densities.

The constants are least squares of the force over area at rest in a tension test, by the formula of
`pneumorph.fem.yeoh_constants.tension_stress`, between strains of 4.5 and 100 %. The tests: ASTM
D412 at 450 mm/min (0.23/s) with the strain of the crosshead, one curve for each rubber, from the
Soft Robotics Materials Database of L. Marechal, L. Lindenroth and others, Univ. Savoie Mont Blanc
(Open Database License; github.com/LucMarechal/Soft-Robotics-Materials-Database). Densities are the
supplier's data sheets'.

One curve says nothing of the scatter between batches or laboratories: for Dragon Skin 30, Young's
moduli of 450 to 1160 kPa are in use.

How a silicone relaxes was measured of Dragon Skin 10 alone: `reproduce/released_beam`.
"""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from types import MappingProxyType

import numpy as np

from pneumorph.fem.material import Material
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.yeoh_constants import tension_stress, yeoh_material

BULK_OVER_SHEAR = 200.0
"""K / mu of a silicone: Poisson's ratio 0.4975."""

TEST_RATE_PER_S = 0.23
"""Strain rate of the tension tests [1/s]."""
TEST_STRAIN = 0.5
"""Strain at which a rubber that relaxes has the secant modulus of its test."""

BEAM_RELAXATION = PronySeries((0.0281, 0.2132), (0.65, 0.03))
"""Branches of 0.037 and 0.281 times the relaxed modulus, fitted to a beam of Dragon Skin 10 that
swings at 3 to 8 Hz (`reproduce/released_beam`); of other silicones an assumption."""

_RAMP_STEPS = 2000
"""Steps of the simulated test; the strain between them is off by a square of one, 1e-8."""


@dataclass(frozen=True)
class Silicone:
    """A silicone rubber."""

    c1_kPa: float
    """C1 [kPa]; Young's modulus at rest is 6 C1."""
    c2_kPa: float
    """C2 [kPa]."""
    c3_kPa: float
    """C3 [kPa]."""
    density_kg_per_mm3: float
    """Density [kg/mm^3]."""
    misfit_percent: float
    """Root mean square of what the law misses, of the stress at 100 % strain [%]."""

    @property
    def young_modulus_kPa(self) -> float:
        """Young's modulus at rest if incompressible [kPa]."""
        return 6.0 * self.c1_kPa

    @property
    def density_g_per_ml(self) -> float:
        """Density [g/ml], with the digits of the data sheet."""
        return round(1e6 * self.density_kg_per_mm3, 9)

    def material(
        self,
        bulk_over_shear: float = BULK_OVER_SHEAR,
        relaxation: PronySeries | None = None,
        *,
        small_strain: bool = False,
    ) -> Material:
        """The rubber as a material whose elements take its change of volume as wholes.

        Args:
            bulk_over_shear: K / mu.
            relaxation: How it relaxes. Its constants are then the relaxed ones, so much lower that
                it has the secant modulus of the test at `TEST_STRAIN` and the test's rate; see
                `test_ratio`.
            small_strain: Take the ratio of moduli at small strain, `PronySeries.secant_ratio`, as
                legs that ship were made: with `BEAM_RELAXATION` it is 0.9 to 1.5 % lower, and the
                stress so much above the test's.

        Raises:
            ValueError: K / mu is below 2/3.
        """
        series = relaxation or PronySeries()
        constants = np.array([self.c1_kPa, self.c2_kPa, self.c3_kPa])
        if small_strain:
            constants /= series.secant_ratio(TEST_STRAIN, TEST_RATE_PER_S)
        else:
            constants /= self.test_ratio(series)
        return yeoh_material(*constants.tolist(), bulk_over_shear=bulk_over_shear)

    def test_ratio(self, series: PronySeries) -> float:
        """Stress of its test at `TEST_STRAIN` over what relaxed constants alone would have there.

        A bar that keeps its volume is pulled to the stretch s = 1 + `TEST_STRAIN` at the test's
        rate. Its law and its branches, whose springs have q of Green's strain along and across,
        have the force over area at rest

            P(s) + 2 mu sum_i k_i (s q_11 - q_22 / s^2),   mu = 2 C1.

        Both are in proportion to the constants, so the ratio of this to P(s) depends on their
        proportions alone.

        Args:
            series: How it relaxes.
        """
        stretch = np.linspace(1.0, 1.0 + TEST_STRAIN, _RAMP_STEPS + 1)
        strains = 0.5 * np.stack([stretch**2 - 1.0, 1.0 / stretch - 1.0], axis=1)
        springs = series.ramp_springs(strains, TEST_STRAIN / TEST_RATE_PER_S / _RAMP_STEPS)
        along, across = 4.0 * self.c1_kPa * (series.branch_ratios @ springs)
        end = stretch[-1:]
        pulled = end * along - across / end**2
        return float(1.0 + (pulled / tension_stress(end, self.c1_kPa, self.c2_kPa, self.c3_kPa))[0])


SILICONES = MappingProxyType(
    {
        "Dragon Skin 10 Medium": Silicone(20.45, 4.47, -0.53, 1.07e-6, 0.6),
        "Dragon Skin 20": Silicone(55.36, 14.80, -2.04, 1.08e-6, 0.6),
        "Dragon Skin 30": Silicone(86.56, 13.80, -1.47, 1.08e-6, 0.3),
        "Ecoflex 00-30": Silicone(7.18, 0.62, -0.11, 1.07e-6, 1.2),
        "Ecoflex 00-50": Silicone(9.83, 0.91, -0.16, 1.07e-6, 1.6),
        "Mold Star 16 Fast": Silicone(40.73, 3.58, -0.18, 1.18e-6, 0.5),
        "Sorta-Clear 40": Silicone(139.11, 5.25, 0.09, 1.08e-6, 0.2),
    }
)
"""By the supplier's name."""


def silicone(name: str) -> Silicone:
    """A silicone by its supplier's name.

    Raises:
        ValueError: It is not in the table.
    """
    if name not in SILICONES:
        meant = get_close_matches(name, SILICONES, 1)
        raise ValueError(
            f"no silicone {name!r} in the table, expected one of {', '.join(SILICONES)}"
            + (f" (did you mean {meant[0]}?)" if meant else "")
            + "; make another of its constants with pneumorph.fem.yeoh_constants.yeoh_material"
        )
    return SILICONES[name]


def silicone_of(material: Material) -> str | None:
    """The supplier's name of what has a material's law, whatever its modulus is scaled to; None of
    what is not in the table."""
    ratios = (material.yeoh_c2_over_c1, material.yeoh_c3_over_c1)
    for name, rubber in SILICONES.items():
        known = (rubber.c2_kPa / rubber.c1_kPa, rubber.c3_kPa / rubber.c1_kPa)
        if material.law == "yeoh" and np.allclose(ratios, known, rtol=1e-6, atol=0.0):
            return name
    return None
