"""The bend of a reduction with every mode and element is the full model's."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.base.artefact import ArtefactError
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.study.bend_error import compare_bend


@pytest.fixture(scope="module")
def full() -> PartModel:
    mesh = box_mesh((20.0, 12.0, 9.0), (3, 3, 3), hollow=True)
    mesh = dataclasses.replace(
        mesh,
        node_sets={"attachment": mesh.node_sets["left"], "outer_end_face": mesh.node_sets["right"]},
    )
    sheet = Membrane("bottom", Material(600.0, 0.4), 1.0)
    return PartModel(mesh, Material(300.0, 0.2), 0.02, (sheet,), "cavity")


@pytest.fixture(scope="module")
def every_mode(full: PartModel) -> ReducedPart:
    """Each free coordinate of each node is a mode of its own."""
    count = len(full.mesh.nodes)
    free = np.setdiff1d(np.arange(count), full.mesh.node_set("attachment"))
    coordinates = (3 * free[:, None] + np.arange(3)).ravel()
    modes = np.zeros((3 * count, len(coordinates)))
    modes[coordinates, np.arange(len(coordinates))] = 1 / np.sqrt(full.node_mass[0])
    return assemble_reduced_part(full, modes.reshape(count, 3, -1))


def test_every_mode_bends_as_the_full_model(full: PartModel, every_mode: ReducedPart) -> None:
    bend = compare_bend(full, every_mode, (5.0, 10.0))
    assert (np.diff(bend.full_deg) > 0).all()
    # Both searches stop at a relative residual of 1e-8 or less.
    assert bend.error_percent < 1e-4


def test_pressures_must_rise_and_meshes_agree(full: PartModel, every_mode: ReducedPart) -> None:
    with pytest.raises(ValueError, match="expected rising from above 0"):
        compare_bend(full, every_mode, (10.0, 5.0))
    other = PartModel(
        dataclasses.replace(full.mesh, nodes=1.01 * full.mesh.nodes),
        Material(300.0, 0.2), 0.02, full.membranes, "cavity",
    )  # fmt: skip
    with pytest.raises(ArtefactError, match="made from the mesh"):
        compare_bend(other, every_mode, (5.0,))
