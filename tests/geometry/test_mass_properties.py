"""Mass, centre and inertia against closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.geometry.surface import boundary_triangles

DENSITY = 1.08


def cuboid_inertia(mass: float, size: np.ndarray) -> np.ndarray:
    """m/12 (b^2 + c^2) about the axis along a, and so on."""
    return np.diag(mass / 12.0 * (np.sum(size**2) - size**2))


def test_a_cuboid_filled_and_as_a_surface() -> None:
    """Away from the origin and turned: exact for any tetrahedra, to rounding."""
    size, place = np.array([10.0, 6.0, 4.0]), np.array([30.0, -20.0, 7.0])
    mesh = box_mesh(size, (3, 2, 2))
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    nodes = (mesh.nodes - size / 2.0) @ turn.T + place
    mass = 1e-6 * DENSITY * 240.0
    expected = turn @ cuboid_inertia(mass, size) @ turn.T
    for found in (
        MassProperties.of_tetrahedra(nodes, mesh.tetrahedra, DENSITY),
        MassProperties.of_surface(nodes, boundary_triangles(mesh.tetrahedra), DENSITY),
    ):
        assert found.mass_kg == pytest.approx(mass, rel=1e-12)
        np.testing.assert_allclose(found.centre_mm, place, rtol=1e-12)
        np.testing.assert_allclose(found.inertia, expected, atol=1e-10 * mass * 240.0)


def test_a_hollow_box_by_differences() -> None:
    """A shell is the outer cuboid less the inner one; both have the same centre."""
    mesh = box_mesh((10.0, 10.0, 10.0), (5, 5, 5), hollow=True)
    found = MassProperties.of_tetrahedra(mesh.nodes, mesh.tetrahedra, DENSITY)
    outer, inner = np.full(3, 10.0), np.full(3, 6.0)
    mass = [1e-6 * DENSITY * np.prod(size) for size in (outer, inner)]
    assert found.mass_kg == pytest.approx(mass[0] - mass[1], rel=1e-12)
    np.testing.assert_allclose(found.centre_mm, [5.0, 5.0, 5.0], rtol=1e-12)
    expected = cuboid_inertia(mass[0], outer) - cuboid_inertia(mass[1], inner)
    np.testing.assert_allclose(found.inertia, expected, atol=1e-12 * mass[0] * 100.0)


def box_of(size: np.ndarray, place: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass and first and second moment about the origin of a cuboid about a place."""
    mass = 1e-6 * DENSITY * float(np.prod(size))
    second = mass * (np.diag(size**2) / 12.0 + np.outer(place, place))
    return mass, mass * place, second


@pytest.mark.parametrize("wall_mm", [1.0, 1.2, 2.0, 3.0, 4.0, 5.5])
def test_walls_of_a_box_lie_inside_it(wall_mm: float) -> None:
    """Exact: the cuboid less one that is two walls smaller each way, of elements coarser and finer
    than the wall, and turned."""
    size, middle = np.array([130.0, 60.0, 16.0]), np.array([65.0, 30.0, 8.0])
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    whole, hole = box_of(size, middle), box_of(size - 2.0 * wall_mm, middle)
    expected = MassProperties.of_moments(*(a - b for a, b in zip(whole, hole, strict=True)))
    for cells in ((4, 2, 1), (13, 12, 8)):
        mesh = box_mesh(size, cells)
        skin = boundary_triangles(mesh.tetrahedra)
        found = MassProperties.of_shell(mesh.nodes @ turn.T, skin, wall_mm, DENSITY)
        assert found.mass_kg == pytest.approx(expected.mass_kg, rel=1e-9)
        np.testing.assert_allclose(found.centre_mm, turn @ expected.centre_mm, rtol=1e-9)
        inertia = turn @ expected.inertia @ turn.T
        np.testing.assert_allclose(found.inertia, inertia, atol=1e-9 * inertia.max())


@pytest.mark.parametrize("wall_mm", [1.0, 2.0, 4.0])
def test_walls_of_an_l_prism_lie_inside_it(wall_mm: float) -> None:
    """Arms of 20 mm along 60 mm, 16 mm high: also round the corner that points inwards."""
    mesh = box_mesh(
        (60.0, 60.0, 16.0), (6, 6, 2), keep=lambda cell: bool(cell[0] < 2 or cell[1] < 2)
    )

    def prism(inset: float) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """An arm along x, and what of the one along y is not in it."""
        low, wide, high = inset, 20.0 - inset, 60.0 - inset
        corners = [((low, low), (high, wide)), ((low, wide), (wide, high))]
        return [
            box_of(
                np.array([*np.subtract(end, start), 16.0 - 2.0 * inset]),
                np.array([*(0.5 * np.add(start, end)), 8.0]),
            )
            for start, end in corners
        ]

    whole, hole = ([sum(each) for each in zip(*prism(t), strict=True)] for t in (0.0, wall_mm))
    expected = MassProperties.of_moments(*(a - b for a, b in zip(whole, hole, strict=True)))
    skin = boundary_triangles(mesh.tetrahedra)
    found = MassProperties.of_shell(mesh.nodes, skin, wall_mm, DENSITY)
    assert found.mass_kg == pytest.approx(expected.mass_kg, rel=1e-9)
    np.testing.assert_allclose(found.centre_mm, expected.centre_mm, rtol=1e-9)
    np.testing.assert_allclose(found.inertia, expected.inertia, atol=1e-9 * expected.inertia.max())


@pytest.mark.parametrize("size", [(130.0, 60.0, 16.0), (130.0, 16.0, 16.0), (16.0, 16.0, 16.0)])
@pytest.mark.parametrize("wall_mm", [8.0, 10.0, 31.0, 70.0])
def test_walls_that_meet_are_refused(size: tuple[float, ...], wall_mm: float) -> None:
    """Also where two or three sizes have turned inside out."""
    mesh = box_mesh(size, (2, 2, 2))
    skin = boundary_triangles(mesh.tetrahedra)
    assert MassProperties.of_shell(mesh.nodes, skin, 7.99, DENSITY).mass_kg > 0.0
    with pytest.raises(ValueError, match=f"wall_mm is {wall_mm:g}, expected less than 8: "):
        MassProperties.of_shell(mesh.nodes, skin, wall_mm, DENSITY)


def test_two_boxes_by_the_parallel_axis_theorem() -> None:
    """I = sum (I_k + m_k (d^2 1 - d d^T)): the moments of parts add up about one origin."""
    parts, size = [], np.array([4.0, 3.0, 2.0])
    mesh = box_mesh(size, (1, 1, 1))
    places = [np.array([0.0, 0.0, 0.0]), np.array([10.0, 5.0, -3.0])]
    for place in places:
        parts.append(MassProperties.of_tetrahedra(mesh.nodes + place, mesh.tetrahedra, DENSITY))
    whole = MassProperties.of_moments(
        sum(part.mass_kg for part in parts),
        sum(part.first_moment for part in parts),
        sum(part.second_moment for part in parts),
    )
    arm = 0.5 * (places[1] - places[0])
    steiner = 2.0 * parts[0].mass_kg * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    expected = 2.0 * cuboid_inertia(parts[0].mass_kg, size) + steiner
    np.testing.assert_allclose(whole.inertia, expected, rtol=1e-10, atol=1e-18)


def test_a_tube_exactly_and_as_a_surface() -> None:
    """I_z = m/2 (R^2 + r^2), I_x = m/12 (3 (R^2 + r^2) + h^2); chords lose up to e^2 / 8 r."""
    occ = pytest.importorskip("netgen.occ")
    from pneumorph.fabrication.solid import surface_of

    outer, inner, height = 20.0, 15.0, 30.0
    solid = occ.Cylinder(occ.Pnt(5, 0, 0), occ.Z, outer, height) - occ.Cylinder(
        occ.Pnt(5, 0, -1), occ.Z, inner, height + 2
    )
    mass = 1e-6 * DENSITY * np.pi * (outer**2 - inner**2) * height
    square = outer**2 + inner**2
    across = mass / 12.0 * (3.0 * square + height**2)
    exact = MassProperties.of_solid(solid, DENSITY)
    assert exact.mass_kg == pytest.approx(mass, rel=1e-9)
    np.testing.assert_allclose(exact.centre_mm, [5.0, 0.0, 15.0], atol=1e-6)
    np.testing.assert_allclose(
        exact.inertia, np.diag([across, across, mass / 2.0 * square]), atol=1e-6 * mass * square
    )
    surface = surface_of(solid, 3.0)
    faceted = MassProperties.of_surface(surface.nodes, surface.triangles, DENSITY)
    # Outer chords lose and inner ones fill up to e^2 / 12 r of the radius in the mean.
    np.testing.assert_allclose(faceted.inertia, exact.inertia, atol=0.02 * mass * square)
    assert faceted.mass_kg == pytest.approx(mass, rel=0.02)


def test_a_weighed_body_has_the_same_shape() -> None:
    mesh = box_mesh((4.0, 3.0, 2.0), (1, 1, 1))
    body = MassProperties.of_tetrahedra(mesh.nodes, mesh.tetrahedra, DENSITY)
    weighed = body.weighing(3.0 * body.mass_kg)
    np.testing.assert_allclose(weighed.inertia, 3.0 * body.inertia, rtol=1e-12)
    np.testing.assert_array_equal(weighed.centre_mm, body.centre_mm)


MESH = box_mesh((1.0, 1.0, 1.0), (1, 1, 1))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: MassProperties.of_tetrahedra(MESH.nodes, MESH.tetrahedra, -1.2),
            r"density_g_per_ml must be positive and finite, got -1\.2",
        ),
        (
            lambda: MassProperties.of_surface(MESH.nodes, MESH.surfaces["skin"], 0.0),
            r"density_g_per_ml must be positive and finite, got 0\.0",
        ),
        (
            lambda: MassProperties.of_solid(None, float("nan")),
            "density_g_per_ml must be positive and finite, got nan",
        ),
        (
            lambda: MassProperties(0.0, np.zeros(3), np.eye(3)),
            r"mass_kg must be positive and finite, got 0\.0",
        ),
        (
            lambda: MassProperties(1.0, np.zeros(3), np.eye(3)).weighing(-0.03),
            r"mass_kg must be positive and finite, got -0\.03",
        ),
        (
            lambda: MassProperties(1.0, np.zeros(3), np.diag([1.0, 1.0, 2.5])),
            r"principal moments 1, 1, 2\.5 kg mm\^2, which no body has",
        ),
        (
            lambda: MassProperties(1.0, np.zeros(2), np.eye(3)),
            r"centre_mm must be finite of shape \(3,\), got \(2,\)",
        ),
    ],
)
def test_bodies_that_cannot_be_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


def test_walls_that_meet_in_one_part_alone_are_refused() -> None:
    """A plate of 4 mm with a post of 20 mm: the plate's hollow turned inside out counted as less
    than nothing, so that it weighed more than solid."""
    mesh = box_mesh(
        (60.0, 60.0, 40.0), (3, 3, 10),
        keep=lambda cell: bool(cell[2] == 0 or (cell[0] == 1 and cell[1] == 1)),
    )  # fmt: skip
    skin = boundary_triangles(mesh.tetrahedra)
    walls = MassProperties.of_shell(mesh.nodes, skin, 1.5, 1.0)
    hollow = 57.0 * 57.0 * 1.0 + 17.0 * 17.0 * 36.0  # up to 1.5 mm below both tops
    assert walls.mass_kg == pytest.approx(1e-6 * (60.0 * 60.0 * 4.0 + 400.0 * 36.0 - hollow))
    for wall_mm in (2.1, 2.5, 3.0):
        with pytest.raises(ValueError, match=r"less than half of the thickness.*walls meet at \("):
            MassProperties.of_shell(mesh.nodes, skin, wall_mm, 1.0)
