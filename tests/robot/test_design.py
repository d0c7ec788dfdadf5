"""A design is told by its content, and its canonical form, mirror image and one-hot follow."""

import numpy as np
import pytest

from pneumorph.robot.design import Design

BASELINE = "1.0.0.2.2.0.0.1"


def test_text_round_trip() -> None:
    assert str(Design.parse(BASELINE)) == BASELINE
    assert Design.parse(BASELINE) == Design((1, 0, 0, 2, 2, 0, 0, 1))


def test_legs_and_angles() -> None:
    design = Design.parse(BASELINE)
    assert design.leg_count == 4
    assert design.legs == ((0, 1), (3, 2), (4, 2), (7, 1))
    # Leg k of 8 sits at 45 (k + 1/2) degrees.
    angles = [np.rad2deg(design.angle_rad(location)) for location, _ in design.legs]
    np.testing.assert_allclose(angles, [22.5, 157.5, 202.5, 337.5])


@pytest.mark.parametrize(
    ("raw", "canonical"),
    [
        ("0.3.1.0.3.2.0.0", "0.1.2.0.1.3.0.0"),
        ("2.2.1", "1.1.2"),
        ("1.2.3", "1.2.3"),
        ("3.3.3", "1.1.1"),
    ],
)
def test_canonical_numbers_regulators_by_first_appearance(raw: str, canonical: str) -> None:
    assert str(Design.parse(raw).canonical()) == canonical
    assert str(Design.parse(canonical).canonical()) == canonical


def test_mirror_sends_leg_k_to_seven_minus_k() -> None:
    design = Design.parse("1.0.2.0.0.3.0.0")
    mirrored = design.mirror()
    assert str(mirrored) == "0.0.3.0.0.2.0.1"
    assert mirrored.mirror() == design
    # The mirror image of direction theta about the x axis is -theta.
    for location, regulator in design.legs:
        image = design.location_count - 1 - location
        assert mirrored.assignment[image] == regulator
        np.testing.assert_allclose(
            np.exp(1j * mirrored.angle_rad(image)),
            np.conj(np.exp(1j * design.angle_rad(location))),
            atol=1e-15,  # rounding of two complex exponentials
        )


def test_one_hot_has_one_block_per_location() -> None:
    one_hot = Design.parse(BASELINE).one_hot(3)
    assert one_hot.shape == (32,)
    assert one_hot.dtype == np.float32
    np.testing.assert_array_equal(one_hot.reshape(8, 4).argmax(axis=1), [1, 0, 0, 2, 2, 0, 0, 1])
    np.testing.assert_array_equal(one_hot.reshape(8, 4).sum(axis=1), np.ones(8))


@pytest.mark.parametrize("text", ["", "1.0.x", "1..2", "1,0,2", "-1.0.2", "1.0.2."])
def test_text_that_is_no_design_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not whole numbers joined by dots"):
        Design.parse(text)


def test_unknown_regulator_is_refused() -> None:
    with pytest.raises(ValueError, match=r"location 2 to regulator 4, expected 1 to 3"):
        Design.parse("1.2.4.0.0.0.0.0").one_hot(3)


def test_numbers_that_are_no_regulator_are_refused() -> None:
    with pytest.raises(ValueError, match=r"assignment\[1\] is -1"):
        Design((1, -1, 2))
    with pytest.raises(ValueError, match=r"assignment\[0\] is 1\.0"):
        Design((1.0, 2, 3))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no locations"):
        Design(())
