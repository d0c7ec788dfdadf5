"""Residual flexibility of contact points: what the modes do not show, and no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.synthetic_part import (
    rubber_part,
    rubber_reduced_part,
    synthetic_part,
    synthetic_reduced_part,
)

from pneumorph.base.artefact import ArtefactError
from pneumorph.fem.interpolation import interpolation_matrix
from pneumorph.reduction.contact_flexibility import contact_flexibility, with_contact_flexibility
from pneumorph.reduction.reduced_part import ReducedPart

LAW = "st_venant_kirchhoff"
MODEL = synthetic_part((4, 4, 4), LAW)


def whole_compliance() -> np.ndarray:
    """H K^-1 H^T by a dense inverse, the mean over directions [mm/mN], (point, point)."""
    stiffness = MODEL.stiffness(MODEL.rest_nodes).toarray()
    held = MODEL.mesh.node_set("attachment")
    free = np.setdiff1d(np.arange(len(stiffness)), (3 * held[:, None] + np.arange(3)).ravel())
    compliance = np.zeros_like(stiffness)
    compliance[np.ix_(free, free)] = np.linalg.inv(stiffness[np.ix_(free, free)])
    count = MODEL.node_count
    by_axis = np.einsum("nama->nm", compliance.reshape(count, 3, count, 3)) / 3.0
    weights = interpolation_matrix(MODEL.mesh, MODEL.mesh.contact_points).toarray()
    return weights @ by_axis @ weights.T


def shown(part: ReducedPart) -> np.ndarray:
    """What of it the modes show."""
    tangent = part.stiffness(np.zeros(part.mode_count))
    modes = part.contact_modes
    return np.einsum("pam,mn,qan->pq", modes, np.linalg.inv(tangent), modes) / 3.0


@pytest.mark.parametrize("mode_count", [6, 12])
def test_it_is_what_the_modes_lack_of_the_whole(mode_count: int) -> None:
    """Of modes and all elements it is positive by itself, so nothing is cut off. Inverses of a
    stiffness whose stiffest motion is 1e6 times its softest keep ten digits, and single precision
    of the modes seven."""
    part = synthetic_reduced_part(mode_count, (4, 4, 4), LAW)
    found = contact_flexibility(MODEL, part)
    whole = whole_compliance()
    np.testing.assert_allclose(found + shown(part), whole, atol=1e-5 * np.abs(whole).max())
    np.testing.assert_array_equal(found, found.T)
    assert 0.01 < np.diag(found).max() / np.diag(whole).max() < 0.9


def test_more_modes_leave_less() -> None:
    few, more = (
        contact_flexibility(MODEL, synthetic_reduced_part(count, (4, 4, 4), LAW))
        for count in (6, 12)
    )
    assert np.linalg.eigvalsh(few - more).min() > -1e-4 * np.diag(few).max()
    assert np.trace(more) < 0.9 * np.trace(few)


def test_of_a_mixed_solid_it_gives_no_energy() -> None:
    """Pressures and stresses by few fields make modes too soft somewhere; that is cut off."""
    part = with_contact_flexibility(rubber_part(), rubber_reduced_part(6, pressures=3, stretches=5))
    flexibility = part.contact_flexibility
    largest = np.linalg.eigvalsh(flexibility)
    assert largest[0] > -1e-6 * largest[-1]
    assert largest[-1] > 0.0


def test_it_is_kept_in_files(tmp_path) -> None:
    part = with_contact_flexibility(MODEL, synthetic_reduced_part(6, (4, 4, 4), LAW))
    again = ReducedPart.load(part.save(tmp_path / "leg.npz"))
    np.testing.assert_array_equal(again.contact_flexibility, part.contact_flexibility)
    assert again.digest() == part.digest()
    bare = replace(part, contact_flexibility=np.zeros((0, 0)))
    assert len(ReducedPart.load(bare.save(tmp_path / "bare.npz")).contact_flexibility) == 0


def test_of_another_part_it_is_refused() -> None:
    with pytest.raises(ArtefactError, match="this reduction was made from the mesh"):
        contact_flexibility(
            synthetic_part((6, 4, 4), LAW), synthetic_reduced_part(6, (4, 4, 4), LAW)
        )
