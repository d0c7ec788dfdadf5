"""Which region a contact point lies on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.catalogue.leg_kinds import load_default_leg, paper_leg_mesh
from pneumorph.geometry.contact_surfaces import ContactSurfaces, surfaces_at

SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
FACES = {"low": np.array([[0, 1, 2]]), "high": np.array([[0, 2, 3], [4, 5, 6]])}
FAR = SQUARE[:3] + 5.0 * np.eye(3)[2]


def named(*points: tuple[float, float, float]) -> list[str]:
    nodes = np.concatenate([SQUARE, FAR])
    return surfaces_at(nodes, FACES, np.array(points)).names.tolist()


def test_the_nearest_region_names_a_point():
    assert named((0.8, 0.1, 0.0), (0.1, 0.8, 0.0)) == ["low", "high"]
    # Beside a triangle its edge is nearest, above it its plane, beyond a corner the corner.
    assert named((0.8, -2.0, 0.5), (0.7, 0.3, 2.4), (0.7, 0.3, 2.6)) == ["low", "low", "high"]
    assert named((3.0, -1.0, 2.4), (3.0, -1.0, 2.6)) == ["low", "high"]


def test_a_point_on_two_regions_belongs_to_the_smaller():
    assert named((0.5, 0.5, 0.0)) == ["low"]
    mesh = box_mesh((10.0, 6.0, 4.0), hollow=True)
    mesh = replace(mesh, contact_points=mesh.nodes[np.unique(mesh.surface("skin"))])
    surfaces, low = mesh.contact_surfaces, mesh.contact_points[:, 2] == 0.0
    np.testing.assert_array_equal(surfaces.names, np.where(low, "bottom", "skin"))
    assert surfaces.area_mm2[low].sum() == pytest.approx(60.0)
    assert surfaces.area_mm2[~low].sum() == pytest.approx(2.0 * (60.0 + 24.0 + 40.0))
    assert mesh.skin_area_mm2 == pytest.approx(2.0 * (60.0 + 24.0 + 40.0))


def test_a_mesh_without_regions_is_one_surface_without_a_name():
    mesh = box_mesh((10.0, 6.0, 4.0))
    mesh = replace(mesh, surfaces={}, contact_points=mesh.nodes[:5])
    assert mesh.contact_surfaces.names.tolist() == [""] * 5
    assert mesh.contact_surfaces.area_mm2.sum() == pytest.approx(248.0)
    assert mesh.contact_surfaces.known_names() == []


def test_the_underside_of_the_papers_leg_is_its_sheet():
    """The legs that ship know it too, as the meshes that they were made from say."""
    mesh = paper_leg_mesh()
    low = mesh.contact_points[:, 2] == 0.0
    for surfaces in (mesh.contact_surfaces, load_default_leg("published").contact_surfaces):
        np.testing.assert_array_equal(surfaces.names, np.where(low, "sheet", "skin"))
    plate = np.ptp(mesh.contact_points[low], axis=0)
    assert mesh.contact_surfaces.area_mm2[low].sum() == pytest.approx(plate[0] * plate[1])
    np.testing.assert_array_equal(
        load_default_leg("published").contact_surfaces.area_mm2, mesh.contact_surfaces.area_mm2
    )


def test_areas_fit_their_names():
    with pytest.raises(ValueError, match=r"area_mm2 must have shape \(2,\), .* got \(1,\)"):
        ContactSurfaces(np.array(["a", "b"]), np.zeros(1))
    with pytest.raises(ValueError, match="finite and not negative"):
        ContactSurfaces(np.array(["a"]), np.array([np.nan]))
