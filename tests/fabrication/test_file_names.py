"""Files of one kind of leg never replace those of another."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("netgen.occ")

from helpers.box_mesh import box_mesh

from pneumorph.base.run_folder import RunFolder
from pneumorph.fabrication import fabricated_robot
from pneumorph.fabrication.fabricated_robot import fabricate
from pneumorph.fabrication.fabrication_settings import FabricationSettings
from pneumorph.fabrication.file_names import file_names
from pneumorph.fabrication.robot_to_make import HubToMake, LegToMake, RobotToMake
from pneumorph.fabrication.solid import FabricationError
from pneumorph.geometry.netgen_mesher import box
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.simple_solids import box_solid
from pneumorph.robot.design import Design


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ([""], [""]),
        (["short", "long"], ["short", "long"]),
        (["long leg"], ["long-leg"]),
        (["левая", "short"], ["-", "short"]),
        (["long leg", "short", "long_leg"], ["long-leg-1", "short", "long-leg-2"]),
        (["левая", "правая", "ж leg", "ю leg"], ["leg-1", "leg-2", "leg-3", "leg-4"]),
        # One file where small and capital letters are the same, as on a memory stick.
        (["Long", "long"], ["Long-1", "long-2"]),
        # A number that another kind has for its name is left out.
        (["a_b", "a-b-1", "a b", "A-B-3"], ["a-b-2", "a-b-1", "a-b-4", "A-B-3"]),
    ],
)
def test_kinds_are_numbered_where_their_names_would_be_one(
    names: list[str], expected: list[str]
) -> None:
    found = file_names(names)
    assert list(found.items()) == list(zip(names, expected, strict=True))
    assert len({each.lower() for each in found.values()}) == len(names)


def test_every_kind_has_its_own_solids_and_lines_of_the_parts_list(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Moulds here are boxes of another size for each kind, which takes no time to make."""
    sizes = {"long leg": 20.0, "long_leg": 30.0, "левая": 40.0, "правая": 50.0, "short": 60.0}
    legs = tuple(
        LegToMake(name, replace(PneuNetShape(), connector_mm=(size, 8.0, 2.0)), MESH, 1.0, 1)
        for name, size in sizes.items()
    )

    def mould(shape: PneuNetShape, _settings: object) -> SimpleNamespace:
        part = box(np.zeros(3), np.array([shape.connector_mm[0], 10.0, 10.0]))
        lid = box(np.array([0.0, 0.0, 10.0]), np.array([shape.connector_mm[0], 10.0, 20.0]))
        return SimpleNamespace(upper=part, lower=part, core=part, body=part, plate=lid)

    checked = {"cast_volume_mm3": 1000.0, "mesh_volume_mm3": 1000.0, "undercut_mm3": {}}
    monkeypatch.setattr(fabricated_robot, "make_leg_mould", mould)
    monkeypatch.setattr(fabricated_robot, "check_leg_mould", lambda *_: dict(checked))
    monkeypatch.setattr(fabricated_robot, "check_leg_sizes", lambda *_: None)
    hub = HubToMake(None, MESH, 1.0, "a box", 8.0, MESH.nodes, 20.0)
    asked = RobotToMake(Design.parse("1.1.1.1.1"), (), legs, hub, "box", "box.toml")
    made = fabricate(asked, FabricationSettings(), RunFolder(tmp_path, "fabricate"))

    # What is of a leg is of none of several.
    of_one = (made.cast_volume_mm3, made.mesh_volume_mm3, made.cast_volume_error_percent,
              made.leg_mass_g, made.simulated_leg_mass_g)  # fmt: skip
    assert of_one == (None,) * 5
    assert len(made.notes) == 5
    assert made.notes[4].startswith("1 x short: ")
    assert made.notes[4].endswith("1.0 g in the simulation; 1000 mm3 cast, 1000 in its mesh")
    one = fabricate(replace(asked, legs=legs[:1]), FabricationSettings(),
                    RunFolder(tmp_path / "one", "fabricate"))  # fmt: skip
    assert (one.cast_volume_mm3, one.simulated_leg_mass_g, one.notes) == (1000.0, 1.0, ())

    begin = ["long-leg-1", "long-leg-2", "leg-1", "leg-2", "short"]
    solids = ("mould_upper", "mould_lower", "core", "leg")
    expected = {f"{kind}_{solid}" for kind in begin for solid in solids}
    assert set(made.solids) == {*expected, "hub"}
    for kind, size in zip(begin, sizes.values(), strict=True):
        assert made.solids[f"{kind}_core"].volume_mm3 == pytest.approx(100.0 * size)
        assert (tmp_path / f"{kind}_mould_upper.stl").exists()
    rows = list(csv.DictReader((tmp_path / "parts.csv").read_text(encoding="utf-8").splitlines()))
    moulds = {row["name"]: float(row["volume_ml"]) for row in rows if row["name"][:5] == "mould"}
    assert len(moulds) == 15
    assert moulds["mould, long-leg-2_core (long_leg)"] == pytest.approx(3.0)
    assert moulds["mould, leg-2_mould_lower (правая)"] == pytest.approx(5.0)
    assert moulds["mould, short_mould_upper"] == pytest.approx(6.0)


@pytest.mark.parametrize("bad", ["paddle_leg", "hub"])
def test_where_a_mesh_cannot_be_made_nothing_is_written(bad: str, tmp_path: Path) -> None:
    """Two cubes that share an edge alone have no skin."""
    edge = box_mesh((20.0, 20.0, 10.0), (2, 2, 1), keep=lambda cell: cell[0] == cell[1])
    meshes = {"paddle_leg": MESH, "hub": MESH, bad: edge}
    paddle = LegToMake("paddle", None, meshes["paddle_leg"], 1.0, 1)
    hub = HubToMake(None, meshes["hub"], 1.0, "a box", 8.0, MESH.nodes, 20.0)
    asked = RobotToMake(Design.parse("1"), (), (paddle,), hub, "box", "box.toml")
    with pytest.raises(FabricationError, match=f"the mesh of {bad} has no skin .* not watertight"):
        fabricate(asked, FabricationSettings(), RunFolder(tmp_path, "fabricate"))
    assert not list(tmp_path.iterdir())


MESH = box_solid(20.0, 20.0, 20.0, 0.0)
