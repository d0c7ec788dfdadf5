"""The PneuNet leg of the paper: an inflatable comb of teeth on a base plate with a sheet below."""

from __future__ import annotations

import operator
from dataclasses import dataclass, fields, replace
from functools import reduce
from typing import Any

import numpy as np

from pneumorph.base.checked import Checked, Count, NotNegative, Positive
from pneumorph.geometry.contact_grid import box_surface_grid, outside_of_boxes
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.mirror import mirror_half
from pneumorph.geometry.netgen_mesher import MesherSettings, box, meshing, tetrahedralise, union
from pneumorph.geometry.surface import boundary_triangles

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Lowest corner and size of an axis-aligned box [mm]."""
Size = tuple[Positive, Positive, Positive]

_TOUCH_MM = 1e-6
"""Coordinates nearer than this are the same: far above rounding, far below any dimension."""

_LEAST_WALL_MM = 0.01
"""A thinner wall is none: no casting has one [mm]."""


@dataclass(frozen=True)
class PneuNetShape(Checked):
    """Shape of the leg [mm]: x along it, y across, z up; origin at the middle of the base plate's
    underside. It is symmetric in x and y. The sheet lies on the underside, z = 0."""

    base_plate_mm: Size = (115.0, 32.0, 4.0)
    """Length, width and height of the base plate [mm]."""
    tooth_base_mm: Size = (104.0, 20.0, 9.0)
    """Length, width and height of the body between the base plate and the teeth [mm]."""
    tooth_height_mm: Positive = 7.0
    """Height of the teeth above that body [mm]."""
    end_tooth_length_mm: Positive = 11.0
    """Length along x of the solid tooth at each end [mm]."""
    inner_tooth_length_mm: Positive = 8.0
    """Length along x of each tooth with a chamber [mm]."""
    inner_tooth_count: Count = 9
    """Number of teeth with a chamber."""
    tooth_gap_mm: Positive = 1.0
    """Gap between neighbouring teeth [mm]."""
    chamber_mm: Size = (2.0, 14.0, 13.0)
    """Length, width and height of each chamber [mm]. Every inner tooth has one in its middle,
    standing on the base plate."""
    connector_mm: Size = (81.0, 2.0, 2.0)
    """Length, width and height of the channel on the base plate that connects the chambers [mm]."""
    middle_wall_mm: NotNegative = 0.0
    """Thickness of a wall along the leg's middle plane y = 0 [mm], which divides it into a left (y
    > 0) and a right cavity that bend it sideways; 0: one cavity."""
    contact_spacing_mm: Positive = 10.0
    """Largest distance between contact points [mm]. Closer ones find the floor more exactly and
    make each step slower."""

    def __post_init__(self) -> None:
        super().__post_init__()
        teeth = (
            2.0 * self.end_tooth_length_mm
            + self.inner_tooth_count * self.inner_tooth_length_mm
            + (self.inner_tooth_count + 1) * self.tooth_gap_mm
        )
        if abs(teeth - self.tooth_base_mm[0]) > _TOUCH_MM:
            raise ValueError(
                f"the teeth with their gaps are {teeth:g} mm long, the tooth base is "
                f"{self.tooth_base_mm[0]:g} mm: they must agree"
            )
        if self.chamber_mm[0] >= self.inner_tooth_length_mm:
            raise ValueError(
                f"a chamber {self.chamber_mm[0]:g} mm long does not fit into a tooth of "
                f"{self.inner_tooth_length_mm:g} mm"
            )
        if self.chamber_mm[2] >= self.tooth_base_mm[2] + self.tooth_height_mm:
            raise ValueError(
                f"a chamber {self.chamber_mm[2]:g} mm high breaks through the top of the teeth, "
                f"{self.tooth_base_mm[2] + self.tooth_height_mm:g} mm above the plate"
            )
        if max(self.chamber_mm[1], self.connector_mm[1]) >= self.tooth_base_mm[1]:
            raise ValueError(
                f"chambers {self.chamber_mm[1]:g} mm and connector {self.connector_mm[1]:g} mm "
                f"wide must be narrower than the tooth base, {self.tooth_base_mm[1]:g} mm"
            )
        if min(self.chamber_mm[1], self.connector_mm[1]) <= self.middle_wall_mm:
            raise ValueError(
                f"middle_wall_mm is {self.middle_wall_mm:g}, expected less than the widths of "
                f"chambers, {self.chamber_mm[1]:g}, and connector, {self.connector_mm[1]:g}: what "
                "is left of them lies on both sides of it; make the connector wider"
            )

    def check_connector(self) -> None:
        """Refuse a connector that does not connect the chambers or does not stay in the body, a
        base plate that does not close the cavity below, and walls of no thickness.

        Raises:
            ValueError: It is too short, too long or too high, the plate is too short or too narrow,
                or a wall is too thin.
        """
        length, _, height = self.connector_mm
        between = (self.inner_tooth_count - 1) * self.tooth_pitch_mm - self.chamber_mm[0]
        if length <= between + _TOUCH_MM:
            raise ValueError(
                f"connector_mm is {length:g} mm long, expected more than {between:g}, the way from "
                f"the first of {self.inner_tooth_count} chambers to the last: others would be "
                "inflated that no air reaches"
            )
        if length >= self.tooth_base_mm[0] - _TOUCH_MM:
            raise ValueError(
                f"connector_mm is {length:g} mm long, expected less than the tooth base, "
                f"{self.tooth_base_mm[0]:g} mm: it would break through the ends"
            )
        if height >= self.tooth_base_mm[2] - _TOUCH_MM:
            raise ValueError(
                f"connector_mm is {height:g} mm high, expected less than the tooth base, "
                f"{self.tooth_base_mm[2]:g} mm: it would break through between the teeth"
            )
        self._check_plate()
        self._check_walls()

    def _check_plate(self) -> None:
        """Refuse a base plate that does not reach beyond the cavity, of which it is the floor."""
        between = (self.inner_tooth_count - 1) * self.tooth_pitch_mm
        reach = (
            ("long", max(self.connector_mm[0], between + self.chamber_mm[0])),
            ("wide", max(self.connector_mm[1], self.chamber_mm[1])),
        )
        for size, (word, cavity) in zip(self.base_plate_mm, reach, strict=False):
            if size <= cavity + _TOUCH_MM:
                raise ValueError(
                    f"base_plate_mm is {size:g} mm {word}, expected more than {cavity:g}, as "
                    f"{word} as chambers and connector together (chamber_mm, connector_mm): it "
                    "closes them below, and air would leave beside it"
                )

    def _check_walls(self) -> None:
        """Refuse walls that are none but for rounding."""
        top = self.tooth_base_mm[2] + self.tooth_height_mm
        width = max(self.chamber_mm[1], self.connector_mm[1])
        narrow = min(self.chamber_mm[1], self.connector_mm[1])
        walls = {
            "of the teeth along x (inner_tooth_length_mm, chamber_mm)":
                0.5 * (self.inner_tooth_length_mm - self.chamber_mm[0]),
            "above the chambers (tooth_base_mm, tooth_height_mm, chamber_mm)":
                top - self.chamber_mm[2],
            "beside the cavity (tooth_base_mm, chamber_mm, connector_mm)":
                0.5 * (self.tooth_base_mm[1] - width),
            "at the connector's ends (tooth_base_mm, connector_mm)":
                0.5 * (self.tooth_base_mm[0] - self.connector_mm[0]),
            "above the connector (tooth_base_mm, connector_mm)":
                self.tooth_base_mm[2] - self.connector_mm[2],
            "below the cavity (base_plate_mm)": self.base_plate_mm[2],
        }  # fmt: skip
        for where, thickness in walls.items():
            if thickness < _LEAST_WALL_MM:
                raise ValueError(
                    f"the wall {where} is {thickness:.3g} mm thick, expected at least "
                    f"{_LEAST_WALL_MM:g} mm: sizes are in mm"
                )
        thin_mm = {"tooth_gap_mm": self.tooth_gap_mm}
        if self.middle_wall_mm > 0.0:
            thin_mm["middle_wall_mm"] = self.middle_wall_mm
        for name, size in thin_mm.items():
            if size < _LEAST_WALL_MM:
                raise ValueError(
                    f"{name} is {size:.3g}, expected at least {_LEAST_WALL_MM:g} mm: sizes are in "
                    "mm"
                )
        if 0.5 * (narrow - self.middle_wall_mm) < _LEAST_WALL_MM:
            raise ValueError(
                f"middle_wall_mm is {self.middle_wall_mm:.9g} and the narrowest cavity {narrow:g} "
                f"mm wide (chamber_mm, connector_mm), expected at least {_LEAST_WALL_MM:g} mm of "
                "it on both sides of the wall"
            )

    def scaled(self, factor: float) -> PneuNetShape:
        """The same leg in another size.

        Args:
            factor: All its lengths over those of this one.
        """
        lengths: dict[str, Any] = {
            each.name: (
                tuple(factor * size for size in value)
                if isinstance(value, tuple)
                else factor * value
            )
            for each in fields(self)
            if each.name != "inner_tooth_count"
            for value in (getattr(self, each.name),)
        }
        return replace(self, **lengths)

    @property
    def tooth_pitch_mm(self) -> float:
        """Distance from an inner tooth to the next [mm]."""
        return self.inner_tooth_length_mm + self.tooth_gap_mm

    @property
    def height_mm(self) -> float:
        """From the sheet to the top of the teeth [mm]."""
        return self.base_plate_mm[2] + self.tooth_base_mm[2] + self.tooth_height_mm

    def solid_boxes(self) -> list[Box]:
        """Boxes whose union is the leg without its cavity."""
        plate, body = self.base_plate_mm, self.tooth_base_mm
        tooth_bottom = plate[2] + body[2]
        lengths = [
            self.end_tooth_length_mm,
            *[self.inner_tooth_length_mm] * self.inner_tooth_count,
            self.end_tooth_length_mm,
        ]
        boxes = [_centred(0.0, 0.0, plate), _centred(0.0, plate[2], body)]
        start = -body[0] / 2.0
        for length in lengths:
            tooth = (length, body[1], self.tooth_height_mm)
            boxes.append(_centred(start + length / 2.0, tooth_bottom, tooth))
            start += length + self.tooth_gap_mm
        return boxes

    def cavity_boxes(self) -> list[Box]:
        """Boxes whose union is the cavity, a middle wall included: the connector, then the
        chambers."""
        floor = self.base_plate_mm[2]
        return [
            _centred(0.0, floor, self.connector_mm),
            *(_centred(centre, floor, self.chamber_mm) for centre in self._chamber_centres_mm()),
        ]

    def _chamber_centres_mm(self) -> list[float]:
        """Of each chamber along x."""
        middle = (self.inner_tooth_count - 1) / 2.0
        return [(index - middle) * self.tooth_pitch_mm for index in range(self.inner_tooth_count)]

    def cavity_volume_mm3(self) -> float:
        """Volume of the cavity at rest, of both where a wall parts it; 3528 mm^3 for the paper's
        leg."""
        wall = np.array([0.0, self.middle_wall_mm, 0.0])
        chamber, connector = self.chamber_mm - wall, self.connector_mm - wall
        ends = 0.5 * np.array([-chamber[0], chamber[0]])
        along = np.add.outer(self._chamber_centres_mm(), ends)  # the first may reach beyond it
        shared = np.ptp(np.clip(along, -0.5 * connector[0], 0.5 * connector[0]), axis=1).sum()
        overlap = shared * np.prod(np.minimum(chamber, connector)[1:])
        chambers = self.inner_tooth_count * np.prod(chamber)
        return float(np.prod(connector) + chambers - overlap)

    def solid_volume_mm3(self) -> float:
        """Volume of the leg's material at rest, 43072 mm^3 for the paper's leg."""
        outside = sum(np.prod(size) for _, size in self.solid_boxes())
        return float(outside) - self.cavity_volume_mm3()

    def contact_points_mm(self) -> np.ndarray:
        """Points that may touch the ground, (point, 3): base plate and one box for the teeth."""
        plate = _centred(0.0, 0.0, self.base_plate_mm)
        body, height = self.tooth_base_mm, self.tooth_base_mm[2] + self.tooth_height_mm
        teeth = _centred(0.0, self.base_plate_mm[2], (body[0], body[1], height))
        points = [box_surface_grid(*each, self.contact_spacing_mm) for each in (plate, teeth)]
        outside = outside_of_boxes(np.concatenate(points), [plate, teeth])
        unique: np.ndarray = np.unique(np.round(outside, 9) + 0.0, axis=0)
        return unique


def mesh_pneunet(shape: PneuNetShape | None = None, settings: MesherSettings | None = None) -> Mesh:
    """Mesh a leg, exactly symmetric in y.

    Regions: surfaces ``cavity``, or ``cavity_left`` and ``cavity_right``, ``sheet`` (bottom face of
    the base plate), ``skin``; node sets ``attachment`` (four corners of the inner tooth face),
    ``inner_end_face``, ``outer_end_face``.

    Args:
        shape: Sizes; those of the paper by default.
        settings: How finely to mesh.

    Raises:
        ModuleNotFoundError: netgen is not installed.
        ValueError: The connector does not connect the chambers, or a cavity breaks through the
            outside.
        MeshError: The mesher fails, or the mesh that came out is faulty.
    """
    shape = shape or PneuNetShape()
    settings = settings or MesherSettings()
    shape.check_connector()
    with meshing("leg"):
        nodes, tetrahedra = tetrahedralise(_half_solid(shape), settings)
    whole = mirror_half(nodes, tetrahedra)
    half = whole.tetrahedra[: len(tetrahedra)]
    boundary = boundary_triangles(half)
    boundary = boundary[np.any(whole.nodes[boundary][:, :, 1] > 0.0, axis=1)]

    in_cavity = _within(whole.nodes[boundary].mean(axis=1), shape.cavity_boxes())
    skin = boundary[~in_cavity]
    on_bottom = np.all(np.abs(whole.nodes[skin][:, :, 2]) < _TOUCH_MM, axis=1)

    # A boundary's normals leave the solid; those of a cavity are to enter it.
    hollow = whole.mirrored(boundary[in_cavity][:, ::-1])
    left, right = np.split(hollow, 2)
    parted = shape.middle_wall_mm > 0.0
    cavities = {"cavity_left": left, "cavity_right": right} if parted else {"cavity": hollow}

    x = whole.nodes[:, 0]
    half_length = shape.base_plate_mm[0] / 2.0
    mesh = Mesh(
        nodes=whole.nodes,
        tetrahedra=whole.tetrahedra,
        surfaces={
            **cavities,
            "sheet": whole.mirrored(skin[on_bottom]),
            "skin": whole.mirrored(skin),
        },
        node_sets={
            "attachment": _attachment_nodes(whole.nodes, shape),
            "inner_end_face": np.flatnonzero(np.abs(x + half_length) < _TOUCH_MM),
            "outer_end_face": np.flatnonzero(np.abs(x - half_length) < _TOUCH_MM),
        },
        contact_points=shape.contact_points_mm(),
        mirror_nodes=whole.mirror_nodes,
    )
    check_mesh(
        mesh, (*cavities, "sheet", "skin"), ("attachment", "inner_end_face", "outer_end_face")
    )
    return mesh


def _centred(x: float, bottom: float, size: tuple[float, float, float]) -> Box:
    return (x - size[0] / 2.0, -size[1] / 2.0, bottom), size


def _half_solid(shape: PneuNetShape) -> Any:
    def half(boxes: list[Box], start: float = 0.0) -> list[Any]:
        return [
            box((corner[0], start, corner[2]), (size[0], size[1] / 2.0 - start, size[2]))
            for corner, size in boxes
        ]

    # Holes one after another: the mesh depends on the order of the solid's faces.
    holes = half(shape.cavity_boxes(), shape.middle_wall_mm / 2.0)
    return reduce(operator.sub, holes, union(half(shape.solid_boxes())))


def _within(points: np.ndarray, boxes: list[Box]) -> np.ndarray:
    inside = np.zeros(len(points), dtype=bool)
    for corner, size in boxes:
        low, high = np.array(corner) - _TOUCH_MM, np.add(corner, size) + _TOUCH_MM
        inside |= np.all((points >= low) & (points <= high), axis=1)
    return inside


def _attachment_nodes(nodes: np.ndarray, shape: PneuNetShape) -> np.ndarray:
    length, width, _ = shape.tooth_base_mm
    corners = [
        (-length / 2.0, side * width / 2.0, height)
        for side in (1.0, -1.0)
        for height in (shape.base_plate_mm[2], shape.height_mm)
    ]
    distance = np.linalg.norm(nodes[:, None] - np.array(corners)[None], axis=2)
    assert distance.min(axis=0).max() < _TOUCH_MM, "corners of the solid are nodes of its mesh"
    nearest: np.ndarray = np.argmin(distance, axis=0)
    return nearest
