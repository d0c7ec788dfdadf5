"""Moulds and walls against volumes and thicknesses that are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

occ = pytest.importorskip("netgen.occ")


from pneumorph.base.run_folder import RunFolder  # noqa: E402
from pneumorph.catalogue.leg_kinds import paper_leg_mesh  # noqa: E402
from pneumorph.fabrication.fabricated_solid import checked_surface, made_solids  # noqa: E402
from pneumorph.fabrication.fabrication_settings import FabricationSettings  # noqa: E402
from pneumorph.fabrication.leg_mould import (  # noqa: E402
    LegMould,
    MouldSettings,
    check_leg_mould,
    check_leg_sizes,
    make_leg_mould,
    undercut_mm3,
)
from pneumorph.fabrication.solid import (  # noqa: E402
    ClosedSurface,
    FabricationError,
    posed,
    surface_of,
    write_step,
)
from pneumorph.fabrication.wall_thickness import wall_thickness_mm  # noqa: E402
from pneumorph.geometry.mounting import RadialMounting  # noqa: E402
from pneumorph.geometry.netgen_mesher import box  # noqa: E402
from pneumorph.geometry.pneunet import PneuNetShape  # noqa: E402
from pneumorph.geometry.surface import write_stl  # noqa: E402


def test_a_leg_of_two_chambers_has_one_core_for_both() -> None:
    """The wall between them is cast as thick as it is simulated."""
    shape = PneuNetShape(connector_mm=(81.0, 8.0, 2.0), middle_wall_mm=2.0)
    made = make_leg_mould(shape)
    assert made.cast_volume_mm3 == pytest.approx(shape.solid_volume_mm3(), rel=1e-9)
    found = check_leg_mould(made, shape, shape.solid_volume_mm3())
    assert max(found["undercut_mm3"].values()) < 1e-3
    assert wall_thickness_mm(surface_of(made.body + made.plate)).min() == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("name", "flag"),
    [
        ("hub", "--hub.smallest-wall-mm"),
        ("short_leg", "--mould.smallest-silicone-mm"),
        ("short_mould_upper", "--mould.smallest-wall-mm"),
    ],
)
def test_a_thin_wall_is_told_with_the_flag_that_allows_it(name: str, flag: str) -> None:
    thin = box(np.zeros(3), np.array([10.0, 10.0, 0.4]))
    with pytest.raises(FabricationError, match=rf"0\.40 mm .* by {flag} 0\.36") as error:
        checked_surface(name, thin, 0.6, 4.0)
    assert ("hollow hub" in str(error.value)) == (name == "hub")
    assert checked_surface(name, thin, 0.36, 4.0)[1] == pytest.approx(0.4)


def test_where_one_part_cannot_be_made_none_is_written(tmp_path: Path) -> None:
    thick = box(np.zeros(3), np.array([10.0, 10.0, 4.0]))
    folder = RunFolder(tmp_path, "fabricate")
    with pytest.raises(FabricationError, match="hub has a wall of"):
        made_solids({"leg": (thick, 1.0), "hub": (thick, 5.0)}, FabricationSettings(), folder)
    assert not list(tmp_path.iterdir())
    assert set(made_solids({"leg": (thick, 1.0)}, FabricationSettings(), folder)) == {"leg"}
    assert {each.name for each in tmp_path.iterdir()} == {"leg.step", "leg.stl"}


def test_holes_beside_a_small_leg_do_not_cut_into_it() -> None:
    """Of a leg of three quarters the usual hole would leave a wall of a quarter of a millimetre."""
    small = PneuNetShape().scaled(0.75)
    settings = MouldSettings(smallest_wall_mm=0.7)  # the gaps of its teeth are 0.75 mm
    upper = surface_of(make_leg_mould(small, settings).upper)
    assert wall_thickness_mm(upper).min() > 0.7 - 1e-6
    narrow = replace(PneuNetShape(), base_plate_mm=(115.0, 23.0, 4.0))
    with pytest.raises(FabricationError, match=r"reaches 1\.5 mm beyond the teeth on each side"):
        make_leg_mould(narrow)


@pytest.fixture(scope="module")
def mould() -> LegMould:
    return make_leg_mould()


def test_the_mould_holds_the_meshed_leg(mould: LegMould) -> None:
    """Space left by the finished solids, against the mesh; boxes are exact to rounding."""
    shape = PneuNetShape()
    assert mould.cast_volume_mm3 == pytest.approx(shape.solid_volume_mm3(), rel=1e-9)
    found = check_leg_mould(mould, shape, float(paper_leg_mesh().volumes.sum()))
    assert abs(found["cast_volume_error_percent"]) < 0.5
    assert max(found["undercut_mm3"].values()) < 1e-3


def test_a_mould_of_another_leg_is_refused(mould: LegMould) -> None:
    with pytest.raises(FabricationError, match=r"differ by .* the mesh is of another shape"):
        check_leg_mould(mould, PneuNetShape(), 1.006 * 43072.0)


@pytest.mark.parametrize(
    ("sizes", "why"),
    [
        ({"base_plate_mm": (128.0, 28.75, 4.0)}, r"cast has 128, 28\.75, 20, the mesh 115, 32, 20"),
        ({"chamber_mm": (2.0, 13.0, 14.0)}, "cavities .* has 81, 13, 14, the mesh 81, 14, 13"),
        ({"connector_mm": (81.0, 2.4, 2.0)}, r"volume of each cavity .* has 3578, the mesh 3528"),
        ({"base_plate_mm": (115.0, 32.0, 5.0), "tooth_base_mm": (104.0, 20.0, 8.0)},
         "cavities begin, .* has 17, 9, 5, the mesh 17, 9, 4"),
    ],
)  # fmt: skip
def test_a_leg_of_the_same_volume_and_other_sizes_is_refused(sizes: Any, why: str) -> None:
    """The first holds as much silicone as the mesh has, to the last digit."""
    check_leg_sizes(PneuNetShape(), paper_leg_mesh())
    with pytest.raises(FabricationError, match=f"{why}, expected the same within"):
        check_leg_sizes(replace(PneuNetShape(), **sizes), paper_leg_mesh())


def test_the_halves_meet_and_do_not_overlap(mould: LegMould) -> None:
    def overlap(a: Any, b: Any) -> float:
        return float(sum(solid.mass for solid in (a * b).solids))

    assert overlap(mould.upper, mould.lower) < 1e-6
    assert overlap(mould.upper, mould.core) < 1e-6
    assert overlap(mould.upper, mould.body) < 1e-6
    assert overlap(mould.core, mould.body) < 1e-6
    assert overlap(mould.lower, mould.plate) < 1e-6
    # Turned about z the pins do not find their holes: the halves fit one way round only.
    turned = mould.upper.Rotate(occ.Axis(occ.Pnt(0, 0, 0), occ.Z), 180.0)
    assert overlap(turned, mould.lower) > 1.0


def test_an_undercut_is_found() -> None:
    """A hook over a block: drawing it upwards meets 4 x 10 x 2 mm^3 of the block."""
    block = box((0, 0, 0), (10, 10, 10)) - box((0, 0, 4), (4, 10, 2))
    hook = box((-5, 0, 0), (5, 10, 12)) + box((-1, 0, 4), (5, 10, 2))
    assert undercut_mm3(block, hook, +1, 12.0) == pytest.approx(4 * 10 * 2, rel=1e-6)
    straight = box((-5, 0, 0), (5, 10, 12))
    assert undercut_mm3(block, straight, +1, 12.0) == 0.0


def test_walls_of_the_leg_are_three_millimetres(mould: LegMould) -> None:
    """Roof 20 - 17, sides (20 - 14) / 2 and ends (8 - 2) / 2 are all 3 mm in the paper's leg."""
    surface = surface_of(mould.body + mould.plate)
    assert surface.volume_mm3 == pytest.approx(43072.0, rel=1e-9)  # flat faces only
    assert wall_thickness_mm(surface).min() == pytest.approx(3.0, abs=1e-9)


def test_thickness_of_a_tube_and_a_wedge() -> None:
    tube = occ.Cylinder(occ.Pnt(0, 0, 0), occ.Z, 10, 20) - occ.Cylinder(
        occ.Pnt(0, 0, -1), occ.Z, 8.5, 22
    )
    surface = surface_of(tube, 3.0)
    thickness = wall_thickness_mm(surface)
    # Chords of the facets lie inside the circles by at most e^2 / 8 r.
    sagitta = 3.0**2 / (8 * 8.5)
    assert thickness.min() == pytest.approx(1.5, abs=2 * sagitta)
    # No triangle of the round faces is left out.
    middles = surface.nodes[surface.triangles].mean(axis=1)
    round_faces = (middles[:, 2] > 1e-6) & (middles[:, 2] < 20.0 - 1e-6)
    assert round_faces.sum() > 500
    np.testing.assert_allclose(thickness[round_faces], 1.5, atol=2 * sagitta)
    # A block's edges are no walls.
    assert wall_thickness_mm(surface_of(box((0, 0, 0), (30, 30, 30)))).min() == np.inf


def test_solids_sit_where_the_simulated_legs_do() -> None:
    mounting = RadialMounting(location_count=5)
    low, size = np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0])
    for location in range(5):
        placed = posed(box(tuple(low), tuple(size)), mounting.pose(location))
        centre = mounting.pose(location).apply(low + size / 2.0)
        np.testing.assert_allclose([placed.center.x, placed.center.y, placed.center.z], centre)


def test_open_and_inverted_surfaces_are_refused() -> None:
    surface = surface_of(box((0, 0, 0), (10, 10, 10)))
    with pytest.raises(FabricationError, match="is not watertight"):
        ClosedSurface(surface.nodes, surface.triangles[:-1])
    with pytest.raises(FabricationError, match="inside out"):
        ClosedSurface(surface.nodes, surface.triangles[:, ::-1])


def test_files_read_back(mould: LegMould, tmp_path: Path) -> None:
    import meshio
    from netgen.occ import OCCGeometry

    surface = surface_of(mould.lower)
    stl = meshio.read(write_stl(tmp_path / "lower.stl", surface.nodes, surface.triangles))
    assert len(stl.cells_dict["triangle"]) == len(surface.triangles)
    np.testing.assert_allclose(stl.points.max(axis=0), surface.nodes.max(axis=0), rtol=1e-6)
    step = write_step(tmp_path / "lower.step", mould.lower)
    assert OCCGeometry(str(step)).shape.mass == pytest.approx(mould.lower.mass, rel=1e-9)
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith("tmp")] == []


def test_sizes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match=r"pin_length_mm is 3\.0, expected more than"):
        MouldSettings(pin_length_mm=3.0)
