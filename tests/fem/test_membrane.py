"""Sheets of either element: area, flat and curved, and the pull across an edge."""

import dataclasses

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.element_cases import ORDERS, irregular_box
from helpers.law_cases import SHEET_LAWS
from helpers.round_mesh import rounded

from pneumorph.fem.law_registry import make_law
from pneumorph.fem.material import Material
from pneumorph.fem.membrane import membrane_group
from pneumorph.geometry.quadratic import quadratic_mesh

THICKNESS = 0.3


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("law", SHEET_LAWS)
def test_pull_across_an_edge_is_stress_times_width_times_thickness(law, order):
    """An even strain of an irregular flat sheet 4 x 4 mm, seen from any of its turned places."""
    mesh, material = irregular_box(order), Material(100.0, 0.4, law)
    sheet = membrane_group(mesh.nodes, mesh.surface_connectivity("middle"), material, THICKNESS)
    gradient = np.diag([1.2, 0.9, 0.7])
    gradient[1, 0], gradient[2, 0] = 0.1, 0.3
    forces = sheet.forces(mesh.nodes @ gradient.T, "polar")
    right = np.abs(mesh.nodes[sheet.connectivity, 0] - 4.0) < 1e-9
    stress = make_law(material, 2).stress(gradient[:, :2, None])[:, 0, 0]
    # Rounding of forces of 100 mN.
    np.testing.assert_allclose(forces[right].sum(axis=0), -stress * 4.0 * THICKNESS, atol=1e-11)


@pytest.mark.parametrize(("quadratic", "order"), [(False, 2), (True, 4)])
def test_area_of_a_sphere_converges(quadratic, order):
    """Flat triangles err by h^2. Curved ones through midside nodes on the sphere, and their rule
    of degree 2, err by h^4: odd terms cancel between neighbours."""
    errors = []
    for cells in (4, 8):
        box = box_mesh((2.0, 2.0, 2.0), (cells,) * 3)
        box = quadratic_mesh(box) if quadratic else box
        mesh = dataclasses.replace(box, nodes=rounded(box.nodes - 1.0, 3))
        sheet = membrane_group(
            mesh.nodes, mesh.surface_connectivity("skin"), Material(100.0, 0.3), THICKNESS
        )
        errors.append(abs(sheet.measure.sum() / THICKNESS / (4.0 * np.pi) - 1.0))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)


def test_frames_of_a_curved_sheet_are_tangent_to_it():
    """Where F is the frame itself, at rest, its normal is the sphere's up to the mesh's error."""
    box = quadratic_mesh(box_mesh((2.0, 2.0, 2.0), (6, 6, 6)))
    mesh = dataclasses.replace(box, nodes=rounded(box.nodes - 1.0, 3))
    sheet = membrane_group(
        mesh.nodes, mesh.surface_connectivity("skin"), Material(100.0, 0.3), THICKNESS
    )
    frame = np.moveaxis(sheet.deformation_gradients(mesh.nodes), 2, 0)
    np.testing.assert_allclose(frame, sheet.rest_frame, atol=1e-12)
    normal = np.cross(frame[:, :, 0], frame[:, :, 1])
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-12)
    centre = mesh.nodes[sheet.connectivity[:, :3]].mean(axis=1)
    outward = centre / np.linalg.norm(centre, axis=1, keepdims=True)
    # Points lie up to h / 3 = 0.1 from their triangle's centre.
    assert np.min(np.sum(normal * outward, axis=1)) > np.cos(0.15)
