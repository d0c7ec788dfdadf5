"""A hub that a symmetry of its robot turns into another one is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.catalogue.hub_description import HubDescription
from pneumorph.catalogue.hub_images import check_hub_images
from pneumorph.catalogue.hub_spec import HubSpec
from pneumorph.catalogue.paper_robot import paper_hub
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.fem.material import Material
from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.simple_solids import box_solid

AHEAD, ASIDE = np.array([5.0, 0.0, 0.0]), np.array([0.0, 5.0, 0.0])


@pytest.fixture
def plate() -> HubSpec:
    mesh = box_solid(100.0, 100.0, 10.0, 30.0)
    mass = MassProperties.of_tetrahedra(mesh.nodes, mesh.tetrahedra, 1.0)
    corners = mesh.nodes[np.abs(np.abs(mesh.nodes[:, :2]).sum(axis=1) - 100.0) < 1e-9]
    return HubSpec(mesh, Material(1e6, 0.3), mass, np.array([0.0, 0.0, 40.0]), corners)


def test_a_square_plate_and_the_disk_of_the_paper_are_their_own_images(plate):
    check_hub_images(plate, mirror=True, same=("90", "mirror", "180"))
    check_hub_images(paper_hub(), mirror=True, same=("120",))


@pytest.mark.parametrize(
    ("change", "mirror", "same", "told"),
    [
        (lambda hub: {"tracked_point": hub.tracked_point + ASIDE}, True, (), "tracked point"),
        (lambda hub: {"tracked_point": hub.tracked_point + AHEAD}, False, ("180",), "10 mm"),
        (
            lambda hub: {"mass": replace(hub.mass, centre_mm=np.array([0.0, 4.0, 35.0]))},
            False,
            ("mirror",),
            "centre of mass, which comes 8 mm",
        ),
        (
            lambda hub: {
                "mass": replace(
                    hub.mass, inertia=hub.mass.inertia + np.diag([0.0, 20.0, 20.0])
                )
            },
            False,
            ("90",),
            "inertia",
        ),
        (lambda hub: {"contact_points": hub.contact_points[:3]}, True, (), "100 mm from any"),
    ],
)  # fmt: skip
def test_what_a_symmetry_turns_into_something_else_is_named(plate, change, mirror, same, told):
    other = replace(plate, **change(plate))
    with pytest.raises(ValueError, match=rf"^\[hub\]: designs\..*{told}"):
        check_hub_images(other, mirror, same)


def test_points_far_apart_are_compared_by_what_they_stand_for(plate):
    """Points that were spread over a hub's nodes have none further away than that, wherever the
    spreading began; a corner without a point is still found."""
    shifted = plate.contact_points + np.array([0.0, 8.0, 0.0])
    apart = replace(plate, contact_points=shifted)
    with pytest.raises(
        ValueError, match=r"one comes 16 mm from any.*contact_spacing_mm;.*\"mesh\""
    ):
        check_hub_images(apart, mirror=True, same=())
    check_hub_images(apart, mirror=True, same=(), spacing_mm=10.0)
    lacking = replace(plate, contact_points=plate.contact_points[:3])
    with pytest.raises(ValueError, match="100 mm from any"):
        check_hub_images(lacking, mirror=True, same=(), spacing_mm=20.0)


_PENTAGON = """
name = "penta"
mounting_tolerance_mm = 4.0
[physics]
based_on = "measured"
floor_height_mm = 0
[hub]
shape = "mesh"
mesh = "hub.npz"
density_g_per_ml = 0.3
contact = "spread"
contact_spacing_mm = {spacing}
[modules.leg]
leg = "measured"
size_factor = 0.75
[[sites]]
position_mm = [41, 0, 36]
pitch_deg = 15
[[sites]]
position_mm = [-33.1697, 24.0992, 36]
yaw_deg = 144
pitch_deg = 15
[[sites]]
position_mm = [-33.1697, -24.0992, 36]
yaw_deg = 216
pitch_deg = 15
[designs]
minimum_legs = 3
options = ["0 a*", "0 a*", "0 a*"]
same = ["mirror"]
"""


@pytest.mark.parametrize("spacing", [5, 20])
def test_a_pentagon_of_a_mesher_is_its_own_image_at_any_spacing(spacing, tmp_path: Path) -> None:
    """The mesh has no exact image, and points far apart come where the spreading took them."""
    occ = pytest.importorskip("netgen.occ")
    corner_mm = 40.0 / np.cos(np.pi / 5.0)
    plane = occ.WorkPlane(occ.Axes((0, 0, 28), n=occ.Z, h=occ.X))
    angles = np.pi / 5.0 * (1 + 2 * np.arange(5))
    for place, angle in enumerate(angles):
        corner = corner_mm * np.cos(angle), corner_mm * np.sin(angle)
        plane.LineTo(*corner) if place else plane.MoveTo(*corner)
    plane.Close()
    made = occ.OCCGeometry(plane.Face().Extrude(16)).GenerateMesh(maxh=20)
    cells = made.Elements3D().NumPy()["nodes"][:, [0, 1, 3, 2]] - 1
    Mesh(np.array(made.Coordinates()), cells).save(tmp_path / "hub.npz")
    (tmp_path / "penta.toml").write_text(_PENTAGON.format(spacing=spacing))
    RobotDescription.read(tmp_path / "penta.toml").spec()


def test_what_a_symmetry_leaves_as_it_is_is_taken(plate):
    ahead = replace(plate, tracked_point=plate.tracked_point + AHEAD)
    check_hub_images(ahead, mirror=True, same=())
    check_hub_images(replace(plate, contact_points=np.zeros((0, 3))), mirror=True, same=("90",))


def test_what_is_tracked_of_a_mesh_lies_above_its_centre_of_volume(tmp_path: Path) -> None:
    """Of a wedge whose width falls evenly to a third from back to front: at 5/12 of its length, the
    first moment of 1 - 2 x / 3 over its integral, (1/2 - 2/9) / (2/3) = 5/12. Its box has half."""
    box = box_mesh((120.0, 60.0, 10.0), (6, 4, 2))
    nodes = np.array(box.nodes)
    nodes[:, 1] = (nodes[:, 1] - 30.0) * (1.0 - nodes[:, 0] / 180.0)
    replace(box, nodes=nodes).save(tmp_path / "hub.npz")
    hub = HubDescription("mesh", mesh="hub.npz", mass_kg=0.1, payload_g=20.0, contact="none")
    made = hub.spec(tmp_path)
    np.testing.assert_allclose(made.tracked_point, [50.0, 0.0, 10.0], atol=1e-9)
    np.testing.assert_allclose(made.mass.centre_mm[:2], [50.0, 0.0], atol=1e-9)
