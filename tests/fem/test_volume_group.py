"""The volumes of whole elements: exact, with exact derivatives, and what they are to a part."""

import numpy as np
import pytest
from helpers.element_cases import ORDERS, box_part, irregular_box, wobbled
from helpers.law_cases import MEAN, case_material

from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.quadrature import shape_gradients
from pneumorph.fem.volume_group import VolumeGroup

GAUSS = np.polynomial.legendre.leggauss(4)


def integrated_volumes(x: np.ndarray, connectivity: np.ndarray) -> np.ndarray:
    """int det(dx/dxi) over the reference tetrahedron, by Gauss points of a collapsed cube."""
    place, weight = 0.5 + 0.5 * GAUSS[0], 0.5 * GAUSS[1]
    total = np.zeros(len(connectivity))
    for a, wa in zip(place, weight, strict=True):
        for b, wb in zip(place, weight, strict=True):
            for c, wc in zip(place, weight, strict=True):
                r, s, t = a, b * (1.0 - a), c * (1.0 - a) * (1.0 - b)
                share = wa * wb * wc * (1.0 - a) ** 2 * (1.0 - b)
                point = np.array([[1.0 - r - s - t, r, s, t]])
                slopes = shape_gradients(point, connectivity.shape[1])[0]
                jacobian = np.einsum("eki,kd->eid", x[connectivity], slopes)
                total += share * np.linalg.det(jacobian)
    return total


@pytest.mark.parametrize("order", ORDERS)
def test_volume_is_exact_for_curved_elements_far_from_the_origin(order):
    mesh = irregular_box(order)
    group = VolumeGroup.of_solid(mesh.nodes, mesh.connectivity, Material(1.0, 0.4))
    np.testing.assert_allclose(group.rest_volume, mesh.volumes, rtol=1e-12)
    x = mesh.nodes + np.random.default_rng(0).uniform(-0.1, 0.1, mesh.nodes.shape)
    exact = integrated_volumes(x, mesh.connectivity)
    assert np.abs(exact - mesh.volumes).max() > 0.05
    np.testing.assert_allclose(group.volumes(x), exact, rtol=1e-12)
    # Coordinates of 1000 mm are rounded to 1e-13 mm, elements are some mm^3.
    np.testing.assert_allclose(group.volumes(x + 1000.0), exact, atol=1e-11)


@pytest.mark.parametrize("order", ORDERS)
def test_mixed_fields_are_the_second_and_third_derivatives_of_volumes(order):
    """Along x + s y volumes are cubics of s, whose derivatives differences have exactly: the second
    with a step of any size, and the third with steps of one and two."""
    mesh = irregular_box(order)
    group = VolumeGroup.of_solid(mesh.nodes, mesh.connectivity, Material(1.0, 0.4))
    y = np.random.default_rng(1).uniform(-0.1, 0.1, mesh.nodes.shape)
    volumes = [group.volumes(mesh.nodes + s * y) for s in (-2.0, -1.0, 0.0, 1.0, 2.0)]
    second = volumes[3] - 2.0 * volumes[2] + volumes[1]
    third = 0.5 * (volumes[4] - 2.0 * volumes[3] + 2.0 * volumes[1] - volumes[0])
    at_rest, moved = group.volume_field(mesh.nodes), group.volume_field(y)
    for expected, first in ((second, at_rest), (third, moved)):
        found = np.einsum("nie,nie->e", moved.corners, first.mixed(moved))
        assert np.abs(expected).max() > 1e-4
        np.testing.assert_allclose(found, expected, atol=1e-10)


@pytest.mark.parametrize("law", ["yeoh", "stable_neo_hookean"])
def test_linear_elements_are_the_same_with_either_dilatation(law):
    """One integration point: its volume is the element's."""
    whole, split = box_part(law, "linear"), box_part(law + MEAN, "linear")
    x = wobbled(whole, 0.08)
    split = PartModel(split.mesh, split.material, 0.001, whole.membranes)
    force = whole.internal_force(x, "polar")
    # Rounding of stresses of lambda.
    np.testing.assert_allclose(split.internal_force(x, "polar"), force, atol=1e-10)
    assert split.elastic_energy(x) == pytest.approx(whole.elastic_energy(x), rel=1e-12)
    tangent = whole.tangent(x, rotation="polar")
    assert np.abs(split.tangent(x, rotation="polar") - tangent).max() < 1e-9


def test_volume_group_takes_part_in_a_tangent_without_symmetry():
    """With an edge-based sheet the part's tangent is assembled from whole matrices."""
    mesh = irregular_box("quadratic")
    sheet = Membrane("middle", Material(10.0, 0.3), 0.1)
    part = PartModel(mesh, case_material("yeoh" + MEAN), 0.1, (sheet,))
    x, step = wobbled(part, 0.03), 1e-6
    assert not part.has_potential("edge")
    direction = np.random.default_rng(3).normal(size=x.shape)
    change = part.internal_force(x + step * direction) - part.internal_force(x - step * direction)
    expected = -part.tangent(x) @ direction.ravel()
    tolerance = 1e-6 * np.abs(expected).max()
    np.testing.assert_allclose(change.ravel() / (2.0 * step), expected, atol=tolerance)


def test_pressures_are_those_of_an_even_change_of_volume():
    mesh, material = irregular_box("quadratic"), case_material("yeoh" + MEAN)
    group = PartModel(mesh, material, 0.1).volume_group
    expected = material.lame_lambda * (1.0 - 0.95**3)
    np.testing.assert_allclose(group.pressures(0.95 * mesh.nodes), expected, rtol=1e-10)


@pytest.mark.parametrize("law", ["corotational", "st_venant_kirchhoff"])
def test_laws_whose_energy_does_not_fall_apart_are_refused(law):
    material = Material(100.0, 0.4, law, dilatation="mean")
    with pytest.raises(ValueError, match=f"alone, such as yeoh or stable_neo_hookean, got '{law}'"):
        PartModel(irregular_box("quadratic"), material, 0.1)
