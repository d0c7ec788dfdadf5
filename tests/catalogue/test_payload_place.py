"""A payload's place: far from the hub, below the floor, or in another unit, it is told."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from pneumorph.catalogue.description_notes import description_notes
from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.geometry.simple_solids import box_solid
from pneumorph.physics.ground import Ground, Steps

HERE = Path()
EXAMPLE = RobotDescription.read(Path(__file__).parents[2] / "examples/tasks/payload.toml")
Place = tuple[float, float, float]


def plate(place: Place, bottom_mm: float = 31.0) -> HubDescription:
    """A plate of 150 x 90 x 10 mm that carries 20 g."""
    return HubDescription(
        "box", length_mm=150.0, width_mm=90.0, height_mm=10.0, bottom_mm=bottom_mm,
        density_g_per_ml=0.6, payload_g=20.0, payload_mm=place,
    )  # fmt: skip


@pytest.mark.parametrize(
    "place",
    [
        (0.0, 0.0, 71.0),  # on a pole of 30 mm
        (0.0, 0.0, 441.0),  # of 400 mm
        (180.0, 0.0, 36.0),  # on an arm
        (0.0, 0.0, 36.0),  # inside
        (20.0, 0.0, 5.0),  # beneath, between the legs
    ],
)
def test_places_that_can_be_built_are_taken_without_a_word(place: Place) -> None:
    hub = plate(place)
    payload = hub.spec(HERE).payload
    assert payload is not None
    assert payload.place_mm.tolist() == list(place)
    assert hub.payload_note(HERE) is None


@pytest.mark.parametrize(
    ("place", "away"),
    [((180.0, 0.0, 510.0), "481"), ((0.0, 0.0, 710.0), "669"), ((18e3, 0.0, 46e3), "49331")],
)
def test_a_place_beyond_three_sizes_of_the_hub_is_refused(place: Place, away: str) -> None:
    told = (
        f"{away} mm away from the hub, expected at most 450: 3 times the longest side of the hub, "
        "150 mm, are enough for a mast; it is in mm"
    )
    with pytest.raises(ValueError, match=re.escape(told)):
        plate(place).spec(HERE)


def test_a_smaller_hub_carries_it_less_far(tmp_path: Path) -> None:
    """The bound is of the hub, also of one that is a mesh; what counts is the distance from it."""
    box_solid(50.0, 50.0, 20.0, 20.0).save(tmp_path / "hub.npz")
    hub = HubDescription(
        "mesh", mesh=Path("hub.npz"), mass_kg=0.04, payload_g=20.0, payload_mm=(0.0, 0.0, 180.0)
    )
    assert hub.spec(tmp_path).payload is not None
    with pytest.raises(ValueError, match="160 mm away from the hub, expected at most 150"):
        replace(hub, payload_mm=(0.0, 0.0, 200.0)).spec(tmp_path)


def test_a_place_in_metres_is_refused_outside_of_the_hub_and_noted_inside() -> None:
    place = (0.018, 0.0, 0.046)
    told = "in metres it would be (18, 0, 46) mm"
    with pytest.raises(ValueError, match=re.escape(told)):
        plate(place).spec(HERE)
    around_origin = plate(place, bottom_mm=-5.0)
    assert around_origin.spec(HERE).payload is not None
    note = around_origin.payload_note(HERE)
    assert note is not None
    assert "metres for (18, 0, 46) mm?" in note


def test_a_place_that_may_be_in_cm_is_noted() -> None:
    hub = plate((1.8, 0.0, 4.6))
    assert hub.spec(HERE).payload is not None
    note = hub.payload_note(HERE)
    assert note is not None
    assert "26.4 mm away from the hub and lower than it" in note
    assert "cm for (18, 0, 46) mm?" in note


def test_the_example_walks_and_the_note_is_among_those_of_a_robot() -> None:
    spec = EXAMPLE.spec()
    assert spec.hub.payload is not None
    notes = description_notes(EXAMPLE, None, spec.physics)
    assert not any("payload" in note for note in notes)
    in_cm = replace(EXAMPLE, hub=replace(EXAMPLE.hub, payload_mm=(0.0, 0.0, 7.1)))
    assert any("payload_mm" in note for note in description_notes(in_cm, None, spec.physics))


def test_a_payload_below_the_floor_is_refused() -> None:
    below = replace(EXAMPLE, hub=replace(EXAMPLE.hub, payload_mm=(0.0, 0.0, -80.0)))
    with pytest.raises(ValueError, match=r"payload_mm of \[hub\] is at a height of -80 mm"):
        below.spec()
    lifted = replace(below.acting, start=replace(below.acting.start, lift_mm=100.0))
    assert below.spec(lifted).hub.payload is not None


def test_a_payload_below_uneven_ground_is_refused_with_the_design_that_carries_it() -> None:
    """The ground is put below the robot, so nothing is known of its height before."""
    below = replace(EXAMPLE, hub=replace(EXAMPLE.hub, payload_mm=(0.0, 0.0, -40.0)))
    uneven = replace(below.acting, ground=Ground(steps=Steps(5.0, start_mm=300.0)))
    spec = below.spec(uneven)
    for make in (spec.assembly, spec.reduced):
        with pytest.raises(ValueError, match=r"height of -40 mm at rest and the floor at -12\.797"):
            make(below.usual_design)
    raised = replace(uneven, start=replace(uneven.start, lift_mm=40.0))
    assert below.spec(raised).assembly(below.usual_design).mounts
