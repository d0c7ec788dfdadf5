"""The table of silicones against what else is known of them."""

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.catalogue.leg_kinds import MEASURED_MATERIALS, load_default_leg
from pneumorph.fem.material import Material
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.silicones import (
    BEAM_RELAXATION,
    BULK_OVER_SHEAR,
    SILICONES,
    TEST_RATE_PER_S,
    TEST_STRAIN,
    silicone,
    silicone_of,
)
from pneumorph.fem.yeoh_constants import (
    STEADY_INVARIANT,
    tension_stress,
    turning_invariant,
    yeoh_material,
)


def test_dragon_skin_30_has_the_secant_moduli_of_its_test():
    """443, 428 and 437 kPa at 25, 50 and 100 %; the misfit of 0.3 % of the stress at 100 %, 426
    kPa, is 1.3 kPa, at 25 % over a strain of 0.25 some 5 kPa."""
    rubber = silicone("Dragon Skin 30")
    strain = np.array([0.25, 0.5, 1.0])
    stress = tension_stress(1.0 + strain, rubber.c1_kPa, rubber.c2_kPa, rubber.c3_kPa)
    assert stress / strain == pytest.approx([443.0, 428.0, 437.0], rel=0.04)


FITTED_KPA = {
    "Dragon Skin 10 Medium": (26.7, 53.0, 111.9),
    "Dragon Skin 20": (73.2, 148.9, 315.3),
    "Dragon Skin 30": (110.9, 213.6, 434.4),
    "Ecoflex 00-30": (9.0, 16.4, 29.2),
    "Ecoflex 00-50": (12.3, 22.6, 40.4),
    "Mold Star 16 Fast": (51.1, 94.4, 185.1),
    "Sorta-Clear 40": (171.8, 306.8, 564.2),
}
"""Force over area at rest at 25, 50 and 100 % strain, as the constants were kept."""


@pytest.mark.parametrize("name", SILICONES)
def test_the_constants_are_those_that_were_fitted(name):
    """A table of three constants each has no other guard; rounded to 0.1 kPa."""
    rubber = silicone(name)
    strain = np.array([0.25, 0.5, 1.0])
    stress = tension_stress(1.0 + strain, rubber.c1_kPa, rubber.c2_kPa, rubber.c3_kPa)
    assert stress == pytest.approx(FITTED_KPA[name], abs=0.06)
    assert 1.06e-6 < rubber.density_kg_per_mm3 < 1.2e-6


@pytest.mark.parametrize("name", SILICONES)
def test_stress_rises_with_strain_in_range(name):
    rubber = silicone(name)
    assert turning_invariant(rubber.c1_kPa, rubber.c2_kPa, rubber.c3_kPa) > STEADY_INVARIANT
    material = rubber.material()
    assert material.lame_mu == pytest.approx(rubber.young_modulus_kPa / 3.0)
    assert material.dilatation == "mean"


@pytest.mark.parametrize(
    "series",
    [
        BEAM_RELAXATION,
        PronySeries((0.0281, 0.2132001), (0.65, 0.03)),
        PronySeries((0.1,), (1.0,)),
        PronySeries((0.2,), (5.0,)),
        PronySeries((0.3,), (2.0,)),
        PronySeries((0.5,), (10.0,)),
        PronySeries((0.2, 0.3), (0.01, 3.0)),
    ],
)
def test_a_rubber_that_relaxes_has_the_stress_of_its_test(series):
    """A bar that keeps its volume, pulled at the test's rate: with S the stress of the branches,
    the force over area at rest is stretch S_11 - S_22 / stretch^2 beside the law's. The strain
    between two of the thousand steps is off by less than (0.0005)^2 / 8."""
    rubber = silicone("Dragon Skin 30")
    material = rubber.material(relaxation=series)
    c1 = 0.5 * material.lame_mu
    constants = c1, c1 * material.yeoh_c2_over_c1, c1 * material.yeoh_c3_over_c1
    count = 1000
    rest = TEST_STRAIN / TEST_RATE_PER_S / count / np.array(series.times_s)
    spring, strain = np.zeros((2, len(rest))), np.zeros((2, 1))  # along and across, of each branch
    for stretch in 1.0 + TEST_STRAIN * np.arange(1, count + 1) / count:
        now = 0.5 * np.array([[stretch**2 - 1.0], [1.0 / stretch - 1.0]])
        spring = np.exp(-rest) * spring - np.expm1(-rest) / rest * (now - strain)
        strain = now
    along, across = 2.0 * material.lame_mu * spring @ series.branch_ratios
    pulled = stretch * along - across / stretch**2
    asked = tension_stress(np.array([stretch]), rubber.c1_kPa, rubber.c2_kPa, rubber.c3_kPa)
    elastic = tension_stress(np.array([stretch]), *constants)
    assert elastic + pulled == pytest.approx(asked, rel=1e-6)
    assert elastic < 0.99 * asked


def test_the_leg_that_ships_keeps_the_constants_it_was_made_with():
    """Those of the beam's branches at small strain, to the bit."""
    rubber = silicone("Dragon Skin 30")
    ratio = BEAM_RELAXATION.secant_ratio(TEST_STRAIN, TEST_RATE_PER_S)
    constants = (each / ratio for each in (rubber.c1_kPa, rubber.c2_kPa, rubber.c3_kPa))
    made = rubber.material(relaxation=BEAM_RELAXATION, small_strain=True)
    assert made == yeoh_material(*constants, bulk_over_shear=BULK_OVER_SHEAR)
    assert made == MEASURED_MATERIALS.silicone
    assert load_default_leg().tetrahedron_material == made
    assert rubber.material(relaxation=PronySeries()) == rubber.material()
    assert rubber.material(small_strain=True) == rubber.material()


@pytest.mark.parametrize("name", SILICONES)
def test_the_ratio_at_small_strain_is_lower_by_as_much_as_is_told(name):
    """Of branches that are fast or slow beside the test 1.5 to 2.1 times as much is added at 50 %,
    and the beam's make that 0.9 to 1.5 % of the stress."""
    rubber = silicone(name)

    def ratios(series):
        return rubber.test_ratio(series), series.secant_ratio(TEST_STRAIN, TEST_RATE_PER_S)

    for time_s in (0.003, 0.03, 1.0, 10.0, 100.0):
        exact, small = ratios(PronySeries((0.1,), (time_s,)))
        assert 1.5 < (exact - 1.0) / (small - 1.0) < 2.15
    exact, small = ratios(BEAM_RELAXATION)
    assert 0.009 < exact / small - 1.0 < 0.015


def test_unknown_silicone_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match=r"no silicone 'Dragon Skin 40'.*Dragon Skin 30"):
        silicone("Dragon Skin 40")
    with pytest.raises(ValueError, match=r"did you mean Ecoflex 00-30\?"):
        silicone("Ecoflex 0030")


@pytest.mark.parametrize(
    "name", [name for name in SILICONES if name.startswith(("Dragon", "Sorta"))]
)
def test_harder_silicones_are_stiffer(name):
    """Their names tell the hardness Shore A, S, of which Gent's formula (On the relation between
    indentation hardness and Young's modulus, Rubber Chemistry and Technology 31 (1958) 896) makes
    0.0981 (56 + 7.62336 S) / (0.137505 (254 - 2.54 S)) MPa. It is for filled rubber: these
    silicones have 0.3 to 0.5 of it, one as another."""
    hardness = float(name.split()[-1] if name[-1].isdigit() else name.split()[-2])
    gent_kPa = 98.1 * (56.0 + 7.62336 * hardness) / (0.137505 * (254.0 - 2.54 * hardness))
    assert 0.28 < silicone(name).young_modulus_kPa / gent_kPa < 0.55


@pytest.mark.parametrize("name", SILICONES)
def test_a_silicone_is_known_by_its_law(name: str) -> None:
    """Whatever its modulus is scaled to."""
    assert silicone_of(silicone(name).material()) == name
    relaxed = silicone(name).material(relaxation=BEAM_RELAXATION)
    assert silicone_of(relaxed.stiffer(0.8)) == name
    assert silicone_of(replace(relaxed, yeoh_c3_over_c1=1e-4)) is None
    assert silicone_of(Material(600.0, 0.45, "stable_neo_hookean")) is None
