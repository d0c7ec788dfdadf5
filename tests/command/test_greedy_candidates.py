"""Random robots of the greedy reduction, on the leg that ships."""

from __future__ import annotations

import numpy as np
from held_leg import held_leg

from pneumorph.command.greedy_candidates import (
    CandidateModels,
    CandidateSettings,
    candidate_indicator,
    draw_candidates,
)
from pneumorph.presets import load_default_leg, paper_leg_model
from pneumorph.reduction.assemble import Cubature, assemble_reduced_part
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace

SETTINGS = CandidateSettings(training_count=5, heldout_count=3, duration_s=1.0, state_count=2)


def test_candidates_are_of_the_design_space_and_the_same_again() -> None:
    training, heldout = draw_candidates(SETTINGS)
    assert (len(training), len(heldout)) == (5, 3)
    assert not set(training) & set(heldout)
    assert draw_candidates(SETTINGS) == (training, heldout)
    space = DesignSpace()
    for candidate in (*training, *heldout):
        space.check(Design.parse(candidate.design))
        assert np.shape(candidate.pressures_kPa) == (1, 3)
    # More to choose from leaves the held-out ones as they are.
    more = CandidateSettings(training_count=9, heldout_count=3, duration_s=1.0)
    assert draw_candidates(more)[1] == heldout


def first_modes(leg: ReducedPart, count: int) -> ReducedPart:
    return assemble_reduced_part(
        paper_leg_model(),
        leg.modes[:, :, :count],
        (
            Cubature(leg.tetrahedron_index, leg.tetrahedron_weight),
            Cubature(leg.membrane_index, leg.membrane_weight),
        ),
        leg.contact_modes[:, :, :count],
    )


def test_indicator_of_a_walk_falls_with_the_number_of_modes() -> None:
    models = CandidateModels(paper_leg_model(), SETTINGS)
    candidate = draw_candidates(SETTINGS)[0][0]
    leg = held_leg(paper_leg_model())  # with few modes it needs no mount that gives way
    indicators = [
        candidate_indicator((models, first_modes(leg, count)), candidate) for count in (4, 12, 24)
    ]
    assert indicators[0] > indicators[1] > indicators[2]
    # In step with the paths only if inertia, pressure, contacts and damping are all accounted for:
    # any one left out is of the size of the elastic forces.
    assert indicators[2] < 0.2
    # The leg that ships moves at its attachment too, as that of a soft hub does.
    assert candidate_indicator((models, load_default_leg()), candidate) < 0.05
