"""A hub as a robot's description has it: a box, a disk or a mesh, its mass from what it is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from scipy.spatial import ConvexHull

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.checked import Bounds, Checked, Positive
from pneumorph.catalogue.density_check import check_density
from pneumorph.catalogue.hub_spec import HubModel, HubPayload, HubSpec
from pneumorph.catalogue.hub_units import payload_unit_note, refuse_distant, refuse_inertia
from pneumorph.catalogue.paper_robot import DISK_MATERIAL
from pneumorph.fem.material import Material
from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.mesh_checks import check_elements
from pneumorph.geometry.simple_solids import box_solid, cone_solid
from pneumorph.geometry.spread_points import spread_points
from pneumorph.geometry.surface import boundary_triangles
from pneumorph.physics.surfaces import HUB_SURFACE

HubShape = Literal["box", "disk", "mesh"]
MassOver = Literal["shape", "nodes"]
HubContact = Literal["rims", "spread", "mesh", "none"]
Vector = tuple[float, float, float]
Density = Annotated[float, Bounds(above=0.0, most=25.0, why="in g/ml, of which water has 1")]
Payload = Annotated[float, Bounds(least=0.0, most=1e4, why="in g; these legs carry some 100")]

LEAST_PAYLOAD_G = 0.1
"""A payload of less is in another unit [g]."""
_ON_EDGE_MM = 1e-6
_BESIDE_MM = 1e-3
_OF_ENVELOPE_G_PER_ML = (0.005, 100.0)
"""Of all that a hub encloses or carries: between a frame and valves on a thin plate."""
_LEAST_ACROSS_MM, _MOST_ACROSS_MM = 5.0, 5000.0
"""Sizes of a mesh beyond which its unit is not mm."""
_SIZES = {
    "box": ("length_mm", "width_mm", "height_mm", "bottom_mm"),
    "disk": ("radius_mm", "height_mm", "bottom_mm"),
    "mesh": ("mesh",),
}


@dataclass(frozen=True)
class HubDescription(Checked):
    """What carries the modules; z is up, x forward, the origin anywhere."""

    shape: HubShape
    """A `box` or a `disk` (a truncated cone) about the z axis, or a `mesh` in the robot's frame."""
    length_mm: Positive | None = None
    """Of a box, along x [mm]."""
    width_mm: Positive | None = None
    """Of a box, along y [mm]."""
    radius_mm: Positive | None = None
    """Of a disk's lower face [mm]."""
    top_radius_mm: Positive | None = None
    """Of a disk's upper face [mm]; that of the lower one by default."""
    height_mm: Positive | None = None
    """Of a box or a disk [mm]."""
    bottom_mm: float | None = None
    """Height of the lower face of a box or a disk in the robot's frame [mm]."""
    mesh: Path | None = None
    """Mesh file, as `pneumorph mesh` writes it."""
    density_g_per_ml: Density | None = None
    """What it is made of [g/ml]; its mass, centre and inertia follow from its shape."""
    wall_mm: Positive | None = None
    """Thickness of its walls, of a hollow one [mm]; by default it is solid. Walls lie inside its
    outside. Where the inertia is given, walls only say how it is printed."""
    mass_kg: Positive | None = None
    """Its mass, in place of the density [kg], with centre and inertia of its shape unless they are
    given."""
    mass_over: MassOver = "shape"
    """What mass_kg is spread over: its `shape`, or of a mesh evenly over its `nodes`, as the
    authors' simulation has it, whatever they are like."""
    centre_mm: Vector | None = None
    """Centre of mass that goes with mass_kg and inertia_kg_mm2 [mm]."""
    inertia_kg_mm2: tuple[Vector, Vector, Vector] | None = None
    """Inertia about the centre that goes with mass_kg and centre_mm, three rows [kg mm^2]; one that
    no hub of such a size and mass has is refused."""
    payload_g: Payload = 0.0
    """What the hub carries besides, as a point [g]."""
    payload_mm: Vector | None = None
    """Where it lies [mm]; by default at the tracked point. It is at most three of the hub's longest
    sides away from it."""
    contact: HubContact = "rims"
    """What of it may touch the floor: the outlines of its lower and upper faces (`rims`), nodes of
    its skin contact_spacing_mm apart (`spread`), the mesh's own contact points, or nothing."""
    contact_spacing_mm: Positive = 15.0
    """Distance between points of `spread` [mm]."""
    surface: str = HUB_SURFACE
    """What these points lie on, where friction is given by surface."""
    tracked_point_mm: Vector | None = None
    """Point whose travel counts [mm]; by default the middle of the upper face."""
    model: HubModel = "rigid"
    """The hub of full-order robots: of finite elements (`soft`), or rigid."""
    young_modulus_kPa: Positive = DISK_MATERIAL.young_modulus_kPa
    """Of a soft hub [kPa]."""
    poisson_ratio: Annotated[float, Bounds(least=0.0, below=0.5)] = DISK_MATERIAL.poisson_ratio
    """Of a soft hub."""

    def __post_init__(self) -> None:
        super().__post_init__()
        every = {name for names in _SIZES.values() for name in names} | {"top_radius_mm"}
        asked = set(_SIZES[self.shape]) | ({"top_radius_mm"} if self.shape == "disk" else set())
        for name in sorted(every):
            given = getattr(self, name) is not None
            if given and name not in asked:
                raise ValueError(f"{name} is given, expected none of a {self.shape}")
            if not given and name in _SIZES[self.shape]:
                raise ValueError(f"{name} is missing: a {self.shape} has one")
        weighed = self.mass_kg is not None
        if weighed == (self.density_g_per_ml is not None):
            raise ValueError(
                "expected either density_g_per_ml or mass_kg, got "
                + ("both" if weighed else "neither")
            )
        if (self.centre_mm is None) != (self.inertia_kg_mm2 is None) or (
            self.centre_mm is not None and not weighed
        ):
            raise ValueError("centre_mm and inertia_kg_mm2 go together, and with mass_kg")
        if self.mass_over == "nodes" and (
            self.shape != "mesh" or not weighed or self.centre_mm or self.wall_mm
        ):
            raise ValueError(
                'mass_over is "nodes", expected it of a mesh with mass_kg and without wall_mm, '
                "centre_mm and inertia_kg_mm2"
            )
        if self.payload_g > 0.0 and self.model == "soft":
            raise ValueError(
                f"payload_g is {self.payload_g:g} and model is soft, expected rigid: a point would "
                "hang on one node"
            )
        if 0.0 < self.payload_g < LEAST_PAYLOAD_G:
            raise ValueError(
                f"payload_g is {self.payload_g:g}, expected 0 or at least {LEAST_PAYLOAD_G:g}: it "
                "is in grams"
            )
        least = self._least_size_mm()
        if self.wall_mm is not None and self.wall_mm >= 0.5 * least:
            raise ValueError(
                f"wall_mm is {self.wall_mm:g}, expected less than half of every size, of which the "
                f"least is {least:g}: all are in mm"
            )

    def refuse_misplaced(self, mirror: bool, same: tuple[str, ...]) -> None:
        """Refuse a place of no payload, and points that a symmetry of the robot takes elsewhere.

        Args:
            mirror: Whether the robot is taken for its own mirror image.
            same: What else is said to leave it as it is, of which turns about z are looked at.

        Raises:
            ValueError: There is no payload, or payload, tracked point or centre of mass are beside
                the forward axis of a mirror image, or beside the middle of what is turned.
        """
        if self.payload_mm is not None and self.payload_g == 0.0:
            raise ValueError(
                "[hub]: payload_mm is given, expected payload_g with it: how much lies there"
            )
        turns = [each for each in same if each != "mirror"]
        for name in ("payload_mm", "tracked_point_mm", "centre_mm"):
            place = getattr(self, name)
            if place is None:
                continue
            if mirror and abs(place[1]) > _BESIDE_MM:
                raise ValueError(
                    f"[hub]: {name} is {place[1]:g} mm to the left of the forward axis, and "
                    "designs.mirror is true, expected 0 there, or mirror = false: the robot's "
                    "mirror image is another"
                )
            if turns and np.hypot(*place[:2]) > _BESIDE_MM:
                raise ValueError(
                    f"[hub]: {name} is at ({place[0]:g}, {place[1]:g}) mm, and designs.same has "
                    f'"{turns[0]}", expected (0, 0), or leave that out: turned, the robot is '
                    "another"
                )

    def spec(self, folder: Path) -> HubSpec:
        """The hub.

        Args:
            folder: Where a mesh file's path starts.

        Raises:
            FileNotFoundError: The mesh file is missing.
            ValueError: The mesh has inverted, flat or doubled elements, nothing is left to touch
                the floor or to weigh, mass or inertia are none of a hub of this size, or a point is
                too far away from it or in metres.
        """
        mesh = self._shape_mesh(folder)
        refuse_distant(self.payload_mm, self.tracked_point_mm, self.centre_mm, mesh)
        return HubSpec(
            mesh,
            Material(self.young_modulus_kPa, self.poisson_ratio),
            self._loaded(self._mass(mesh), mesh),
            np.array(self._tracked_point(mesh)),
            self._contact_points(mesh),
            self.surface,
            self._payload(mesh),
        )

    def payload_note(self, folder: Path) -> str | None:
        """What to say of a payload's place that looks like one in another unit and need not be one;
        None of any other.

        Args:
            folder: Where a mesh file's path starts.
        """
        place = self.payload_mm
        if place is None or self.payload_g == 0.0:
            return None
        return payload_unit_note(place, self._shape_mesh(folder))

    def _shape_mesh(self, folder: Path) -> Mesh:
        if self.mesh is None:
            return self._solid(0.0)
        file = folder / self.mesh
        if not file.exists():
            raise FileNotFoundError(f"mesh of [hub]: {file} does not exist")
        try:
            mesh = Mesh.load(file)
        except ArtefactError as error:
            # Only a file of another program is told the way to become a mesh.
            rest = " --surfaces --node-sets (a hub needs none of a leg's regions)"
            way = rest if "pneumorph mesh" in str(error) else ""
            raise ArtefactError(f"mesh of [hub]: {error}{way}") from error
        across_mm = mesh.longest_side_mm
        if not _LEAST_ACROSS_MM <= across_mm <= _MOST_ACROSS_MM:
            raise ArtefactError(
                f"mesh of [hub]: {file} is {across_mm:.3g} mm across, expected "
                f"{_LEAST_ACROSS_MM:g} to {_MOST_ACROSS_MM:g}: its file may be in another unit; "
                "make it again with pneumorph mesh --scale, the file's unit in mm (1000 for metres)"
            )
        try:
            check_elements(mesh)
        except MeshError as error:
            raise ArtefactError(f"mesh of [hub]: {file}: {error}") from error
        return mesh

    def _solid(self, wall_mm: float) -> Mesh:
        """The box or the disk without so much of its outside."""
        low, high = self.bottom_mm, self.height_mm
        assert low is not None
        assert high is not None
        low, high = low + wall_mm, high - 2.0 * wall_mm
        if self.shape == "box":
            assert self.length_mm is not None
            assert self.width_mm is not None
            return box_solid(
                self.length_mm - 2.0 * wall_mm, self.width_mm - 2.0 * wall_mm, high, low
            )
        return cone_solid(*self.radii_mm(wall_mm), high, low)

    def radii_mm(self, wall_mm: float) -> tuple[float, float]:
        """Radii of a disk's lower and upper face without so much of its outside [mm]: the flank
        moves inwards at right angles to itself."""
        assert self.radius_mm is not None
        assert self.height_mm is not None
        bottom, top = self.radius_mm, self.top_radius_mm or self.radius_mm
        slope = (top - bottom) / self.height_mm
        inwards = wall_mm * float(np.hypot(1.0, slope))
        return bottom + slope * wall_mm - inwards, top - slope * wall_mm - inwards

    def _least_size_mm(self) -> float:
        """The least of the sizes of a box, or of the height and the diameters of a disk."""
        sizes = (self.length_mm, self.width_mm, self.height_mm)
        radii = (self.radius_mm, self.top_radius_mm)
        every = [*(each for each in sizes if each), *(2.0 * each for each in radii if each)]
        return min(every, default=float("inf"))

    def _mass(self, mesh: Mesh) -> float | MassProperties:
        if self.mass_kg is not None:
            check_density(
                "mass_kg of [hub]", self.mass_kg, float(mesh.volumes.sum()), _OF_ENVELOPE_G_PER_ML,
                "it is in kg, so 42 g are 0.042, and sizes are in mm",
            )  # fmt: skip
            if self.centre_mm is not None:
                centre, inertia = np.array(self.centre_mm), np.array(self.inertia_kg_mm2)
                given = MassProperties(self.mass_kg, centre, inertia)
                refuse_inertia(given, mesh)
                return given
            if self.mass_over == "nodes":
                return self.mass_kg
            return self._of_shape(mesh, 1.0).weighing(self.mass_kg)
        assert self.density_g_per_ml is not None
        return self._of_shape(mesh, self.density_g_per_ml)

    def _loaded(self, empty: float | MassProperties, mesh: Mesh) -> float | MassProperties:
        """With the payload; a mass alone is spread over the mesh's nodes."""
        if self.payload_g == 0.0:
            return empty
        if not isinstance(empty, MassProperties):
            mean = empty / len(mesh.nodes)
            empty = MassProperties.of_moments(
                empty, mean * mesh.nodes.sum(axis=0), mean * mesh.nodes.T @ mesh.nodes
            )
        place, mass_kg = np.array(self.payload_place_mm(mesh)), 1e-3 * self.payload_g
        return MassProperties.of_moments(
            empty.mass_kg + mass_kg,
            empty.first_moment + mass_kg * place,
            empty.second_moment + mass_kg * np.outer(place, place),
        )

    def _payload(self, mesh: Mesh) -> HubPayload | None:
        if self.payload_g == 0.0:
            return None
        return HubPayload(1e-3 * self.payload_g, np.array(self.payload_place_mm(mesh)))

    def payload_place_mm(self, mesh: Mesh) -> Vector:
        """Where the payload lies [mm].

        Args:
            mesh: The hub's.
        """
        return self.payload_mm or self._tracked_point(mesh)

    def material_ml(self, mesh: Mesh) -> float:
        """Volume of what it is made of, its walls or all of it [ml].

        Args:
            mesh: The hub's.
        """
        return 1e3 * self._of_shape(mesh, 1.0).mass_kg  # of 1 g/ml

    def _of_shape(self, mesh: Mesh, density_g_per_ml: float) -> MassProperties:
        if self.wall_mm is None:
            return MassProperties.of_tetrahedra(mesh.nodes, mesh.tetrahedra, density_g_per_ml)
        if self.shape == "mesh":
            skin = boundary_triangles(mesh.tetrahedra)
            try:
                return MassProperties.of_shell(mesh.nodes, skin, self.wall_mm, density_g_per_ml)
            except ValueError as error:
                raise ValueError(f"[hub]: {error}") from error
        hole = self._solid(self.wall_mm)
        outside, inside = (
            MassProperties.of_tetrahedra(each.nodes, each.tetrahedra, density_g_per_ml)
            for each in (mesh, hole)
        )
        return MassProperties.of_moments(
            outside.mass_kg - inside.mass_kg,
            outside.first_moment - inside.first_moment,
            outside.second_moment - inside.second_moment,
        )

    def _tracked_point(self, mesh: Mesh) -> Vector:
        if self.tracked_point_mm is not None:
            return self.tracked_point_mm
        low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
        middle = 0.5 * (low + high)
        if self.shape == "mesh":  # the box about it may lie to one side of it
            middle = MassProperties.of_tetrahedra(mesh.nodes, mesh.tetrahedra, 1.0).centre_mm
        return float(middle[0]), float(middle[1]), float(high[2])

    def _contact_points(self, mesh: Mesh) -> np.ndarray:
        if self.contact == "none":
            return np.zeros((0, 3))
        if self.contact == "mesh":
            return mesh.contact_points
        if self.contact == "rims":
            return rim_points(mesh)
        skin = mesh.nodes[np.unique(boundary_triangles(mesh.tetrahedra))]
        chosen: np.ndarray = skin[spread_points(skin, self.contact_spacing_mm)]
        return chosen


def rim_points(mesh: Mesh) -> np.ndarray:
    """Nodes on the outlines of the faces ``bottom`` and ``top`` of a mesh [mm], (point, 3).

    Raises:
        ValueError: The mesh has no such node sets.
    """
    points = []
    lacking = [name for name in ("bottom", "top") if name not in mesh.node_sets]
    if lacking:
        raise ValueError(
            f"contact is rims and the hub's mesh has no node set {' and '.join(lacking)}, expected "
            'both, or contact = "spread", "mesh" (its own contact points) or "none"'
        )
    for name in ("bottom", "top"):
        face = mesh.nodes[mesh.node_set(name)]
        hull = ConvexHull(face[:, :2])
        # Rows (a, b, c) of lines a x + b y + c = 0 of unit normal.
        height = face[:, :2] @ hull.equations[:, :2].T + hull.equations[:, 2]
        points.append(face[height.max(axis=1) > -_ON_EDGE_MM])
    return np.concatenate(points)
