"""The mould of a PneuNet leg: two halves and a core, and the two castings they make.

First the body with its chambers: upper half and core, whose plate closes it from below. Then, the
core taken out, the upper half with the cured body is put on the lower half, in which the paper lies
in the base plate's silicone. All in the leg's frame; both halves open along z.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from pneumorph.base.checked import Checked, Positive
from pneumorph.fabrication.solid import FabricationError, single_solid
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.netgen_mesher import box, open_cascade, union
from pneumorph.geometry.pneunet import Box, PneuNetShape
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.geometry.surface import enclosed_volume


@dataclass(frozen=True)
class MouldSettings(Checked):
    """The mould of the leg: two halves and a core."""

    wall_mm: Positive = 6.0
    """Thickness of the mould's walls around the casting [mm]."""
    core_plate_mm: Positive = 4.0
    """Thickness of the plate that carries the core [mm]."""
    pin_radius_mm: Positive = 2.5
    """Radius of the registration pins [mm]."""
    pin_length_mm: Positive = 8.0
    """Length of the registration pins [mm]; they reach through the core's plate into the lower
    half."""
    clearance_mm: Positive = 0.15
    """Gap around a registration pin [mm]."""
    pour_radius_mm: Positive = 2.0
    """Radius of the pour holes [mm]; less where the base plate's overhang is too narrow."""
    vent_radius_mm: Positive = 0.75
    """Radius of the vent holes [mm]."""
    smallest_wall_mm: Positive = 0.8
    """Thinnest wall of a mould that your printer can make [mm]; thinner walls are refused."""
    smallest_silicone_mm: Positive = 1.5
    """Thinnest wall of the leg that silicone fills reliably [mm]; thinner walls are refused."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.pin_length_mm <= self.core_plate_mm:
            raise ValueError(
                f"pin_length_mm is {self.pin_length_mm}, expected more than the core plate's "
                f"{self.core_plate_mm} mm"
            )


@dataclass(frozen=True)
class LegMould:
    """Solids of a mould, OpenCASCADE shapes in the leg's frame."""

    upper: Any
    """Forms tooth base and teeth; opens upwards (+z)."""
    lower: Any
    """Forms the base plate; opens downwards (-z)."""
    core: Any
    """Forms the cavity in the first casting; is drawn downwards (-z)."""
    body: Any
    """What the first casting makes."""
    plate: Any
    """What the second casting adds."""
    body_volume_mm3: float
    """Volume left between upper half and core, without the holes [mm^3]."""
    plate_volume_mm3: float
    """Volume left in the lower half [mm^3]."""

    @property
    def cast_volume_mm3(self) -> float:
        """Silicone of one leg [mm^3]."""
        return self.body_volume_mm3 + self.plate_volume_mm3


def make_leg_mould(
    shape: PneuNetShape | None = None, settings: MouldSettings | None = None
) -> LegMould:
    """Make the mould of a leg.

    Args:
        shape: Sizes of the leg; those of the paper by default.
        settings: Sizes of the mould.

    Raises:
        ModuleNotFoundError: netgen is not installed.
        FabricationError: The sizes do not fit: a part falls to pieces, or holes cut into the leg.
    """
    shape, settings = shape or PneuNetShape(), settings or MouldSettings()
    plate_size = np.array(shape.base_plate_mm)
    parting, top = plate_size[2], shape.height_mm
    margin = settings.wall_mm + 2.0 * (settings.pin_radius_mm + settings.clearance_mm)
    reach = plate_size[:2] / 2.0 + margin + settings.wall_mm / 2.0

    def slab(low: float, high: float) -> Any:
        return box((-reach[0], -reach[1], low), (2 * reach[0], 2 * reach[1], high - low))

    plate = _boxes(shape.solid_boxes()[:1])
    body_outside = _boxes(shape.solid_boxes()[1:])
    cavity = _boxes(shape.cavity_boxes())
    if shape.middle_wall_mm > 0.0:  # one plate carries the cores of both chambers
        length, wall = float(plate_size[0]), shape.middle_wall_mm
        cavity = cavity - box((-length / 2.0, -wall / 2.0, 0.0), (length, wall, top))
    body = single_solid("the body of the leg", body_outside - cavity)

    pins = _pin_places(reach, settings)
    holes = _vertical(shape, settings, parting - 1.0, top + settings.wall_mm + 1.0)
    pin_solids = _cylinders(
        pins, settings.pin_radius_mm, parting - settings.pin_length_mm, parting + 1.0
    )
    pin_holes = _cylinders(
        pins,
        settings.pin_radius_mm + settings.clearance_mm,
        parting - settings.pin_length_mm - 1.0,
        parting + 1.0,
    )
    floor = min(-settings.wall_mm, parting - settings.pin_length_mm - 1.0 - settings.wall_mm / 2)
    upper = single_solid(
        "the upper half",
        (slab(parting, top + settings.wall_mm) - body_outside - holes) + pin_solids,
    )
    lower = single_solid("the lower half", slab(floor, parting) - plate - pin_holes)
    core = single_solid(
        "the core", (slab(parting - settings.core_plate_mm, parting) - pin_holes) + cavity
    )
    return LegMould(
        upper,
        lower,
        core,
        body,
        plate,
        _space(body_outside, upper, core),
        _space(plate, lower),
    )


def undercut_mm3(
    cast: Any, mould: Any, direction: int, travel_mm: float, step_mm: float = 0.5
) -> float:
    """Largest volume of a mould that is in the casting's way while it is drawn off [mm^3].

    The mould is moved along z in steps and intersected with the casting; 0 means no undercut wider
    than the step.

    Args:
        cast: The casting.
        mould: The part of the mould.
        direction: +1 to draw upwards, -1 downwards.
        travel_mm: How far [mm].
        step_mm: Step [mm], at most half of the narrowest feature.
    """
    occ = open_cascade()
    worst = 0.0
    for shift in np.arange(step_mm, travel_mm + step_mm, step_mm):
        moved = mould.Move(occ.Vec(0.0, 0.0, float(direction * shift)))
        worst = max(worst, _volume(moved * cast))
    return worst


def _volume(shape: Any) -> float:
    return float(sum(solid.mass for solid in shape.solids))


def _space(envelope: Any, *solids: Any) -> float:
    """Volume of an envelope that no solid fills [mm^3]."""
    return _volume(reduce(operator.sub, solids, envelope))


def _boxes(boxes: list[Any]) -> Any:
    return union(box(corner, size) for corner, size in boxes)


def _cylinders(places: list[tuple[float, float]], radius: float, low: float, high: float) -> Any:
    occ = open_cascade()
    return union(occ.Cylinder(occ.Pnt(x, y, low), occ.Z, radius, high - low) for x, y in places)


def _pin_places(reach: np.ndarray, settings: MouldSettings) -> list[tuple[float, float]]:
    """Three corners, and a fourth off its corner: the halves fit one way round only."""
    inset = settings.wall_mm / 2.0 + settings.pin_radius_mm + settings.clearance_mm
    x, y = reach - inset
    return [(-x, -y), (-x, y), (x, -y), (0.8 * x, y)]


def _hole_places(shape: PneuNetShape) -> dict[str, list[tuple[float, float]]]:
    """Where to pour and to vent: over the end teeth, every tooth, and the plate's overhang."""
    length, width, _ = shape.tooth_base_mm
    plate_length, plate_width, _ = shape.base_plate_mm
    end = length / 2.0 - shape.end_tooth_length_mm / 2.0
    side = (width + plate_width) / 4.0
    outer = (length + plate_length) / 4.0
    middle = (shape.inner_tooth_count - 1) / 2.0
    teeth = [(i - middle) * shape.tooth_pitch_mm for i in range(shape.inner_tooth_count)]
    return {
        "pour": [(-end, 0.0), (-end, side)],
        "vent": [(end, 0.0), *((x, 0.0) for x in teeth), (outer, side), (outer, -side),
                 (-outer, -side)],
    }  # fmt: skip


def _vertical(shape: PneuNetShape, settings: MouldSettings, low: float, high: float) -> Any:
    """The holes of the upper half."""
    places = _hole_places(shape)
    fits = _hole_radius_mm(shape, settings)
    wide = _cylinders(places["pour"], min(settings.pour_radius_mm, fits), low, high)
    return wide + _cylinders(places["vent"], min(settings.vent_radius_mm, fits), low, high)


def _hole_radius_mm(shape: PneuNetShape, settings: MouldSettings) -> float:
    """Radius of the widest hole in the middle of the base plate's overhang that leaves a wall
    beside the body.

    Raises:
        FabricationError: There is none.
    """
    overhang = 0.5 * (shape.base_plate_mm[1] - shape.tooth_base_mm[1])
    radius = 0.5 * overhang - settings.smallest_wall_mm
    if radius <= 0.0:
        raise FabricationError(
            f"the base plate reaches {overhang:g} mm beyond the teeth on each side, expected more "
            f"than {2.0 * settings.smallest_wall_mm:g} mm: its holes would cut into the teeth"
        )
    return radius


def check_leg_sizes(shape: PneuNetShape, mesh: Mesh) -> None:
    """Check that a leg that is cast is the one that was meshed, as far as its outside and its
    cavities go: one of other sizes may have the same volume.

    Args:
        shape: The leg.
        mesh: Mesh of the simulated leg.

    Raises:
        FabricationError: They differ by more than 0.5 %.
    """
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    regions = [mesh.surfaces[name] for name in cavity_regions(mesh)]
    inside = mesh.nodes[np.concatenate([region.ravel() for region in regions])]
    outer, inner = _corners_mm(shape.solid_boxes()), _corners_mm(shape.cavity_boxes())
    count = 1 if shape.middle_wall_mm == 0.0 else 2
    compared = [
        ("length, width and height [mm]", np.ptp(outer, axis=0), high - low),
        ("volume of each cavity [mm^3]", np.full(count, shape.cavity_volume_mm3() / count),
         np.array([abs(enclosed_volume(mesh.nodes, region)) for region in regions])),
        ("length, width and height of its cavities [mm]", np.ptp(inner, axis=0),
         np.ptp(inside, axis=0)),
        ("where its cavities begin, from its lowest corner [mm]", inner[0] - outer[0],
         inside.min(axis=0) - low),
    ]  # fmt: skip
    for name, own, meshed in compared:
        if own.shape != meshed.shape or np.any(np.abs(own - meshed) > 0.005 * meshed):
            raise FabricationError(
                f"{name}: the leg to cast has {_told(own)}, the mesh {_told(meshed)}, expected the "
                "same within 0.5 %; the mesh is of another shape: give the leg's sizes (such as "
                "--leg.base-plate-mm) as it was meshed with, or the leg's own mesh (--mesh)"
            )


def _corners_mm(boxes: list[Box]) -> np.ndarray:
    """Lowest and highest corner of boxes [mm], (2, 3)."""
    low, size = np.array(boxes).swapaxes(0, 1)
    return np.array([low.min(axis=0), (low + size).max(axis=0)])


def _told(values: np.ndarray) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def check_leg_mould(mould: LegMould, shape: PneuNetShape, mesh_volume_mm3: float) -> dict[str, Any]:
    """Check that a mould makes the leg that was meshed and lets go of it.

    Args:
        mould: The mould.
        shape: The leg.
        mesh_volume_mm3: Volume of the leg's mesh [mm^3].

    Returns:
        Volumes and undercuts, for a summary.

    Raises:
        FabricationError: The cast volume is off by more than 0.5 %, or a part does not come off.
    """
    error_percent = 100.0 * (mould.cast_volume_mm3 / mesh_volume_mm3 - 1.0)
    if abs(error_percent) > 0.5:
        raise FabricationError(
            f"the mould holds {mould.cast_volume_mm3:.0f} mm^3 of silicone, the mesh "
            f"{mesh_volume_mm3:.0f} mm^3: they differ by {error_percent:.2f} %, expected 0.5 % or "
            "less; the mesh is of another shape: give the leg's sizes, or make it by a robot's "
            "file (--robot), which writes a leg that is a mesh as it is"
        )
    travel = shape.height_mm + 1.0
    step = min(0.5, shape.tooth_gap_mm / 2.0)
    cast = mould.body + mould.plate
    undercuts = {
        "upper": undercut_mm3(cast, mould.upper, +1, travel, step),
        "lower": undercut_mm3(cast, mould.lower, -1, travel, step),
        "core": undercut_mm3(mould.body, mould.core, -1, travel, step),
    }
    for name, volume in undercuts.items():
        if volume > 1e-3:  # [mm^3]; Boolean operations round at 1e-7 mm times the faces' area
            raise FabricationError(
                f"the {name} part of the mould has an undercut: {volume:.2f} mm^3 of it are in the "
                "casting's way"
            )
    return {
        "cast_volume_mm3": mould.cast_volume_mm3,
        "mesh_volume_mm3": mesh_volume_mm3,
        "cast_volume_error_percent": error_percent,
        "undercut_mm3": undercuts,
    }
