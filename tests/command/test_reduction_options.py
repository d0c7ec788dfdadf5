"""What a leg of one's own is reduced as: in the measured physics, unless the published one is asked
for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.paper_leg import leg_kind, paper_leg
from pneumorph.command.mesh import VERB as MESH
from pneumorph.command.mesh import MeshOptions
from pneumorph.command.reduce import VERB as REDUCE
from pneumorph.fem.silicones import BEAM_RELAXATION, SILICONES
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.robot.scaled_part import scaled_part
from pneumorph.study.reduction_options import (
    PRESETS,
    ReduceOptions,
    hyperelastic,
    measured,
    reduce_as_asked,
)

DIGITS = 1e-12


def asked(*layers: dict[str, Any], preset: str | None = None) -> ReduceOptions:
    """What is reduced where layers are set over a preset."""
    return layered(REDUCE.preset(preset), layers)


def own_mesh(quadratic: bool) -> Mesh:
    """A hollow box with a sheet under it, 40 x 12 x 9 mm."""
    box = box_mesh((40.0, 12.0, 9.0), (6, 3, 3), hollow=True)
    mesh = Mesh(
        box.nodes,
        box.tetrahedra,
        {**box.surfaces, "sheet": box.surfaces["bottom"]},
        {"attachment": box.node_sets["left"], "outer_end_face": box.node_sets["right"]},
        contact_points=np.array([[40.0, 0.0, 0.0], [40.0, 12.0, 0.0]]),
    )
    return quadratic_mesh(mesh) if quadratic else mesh


def test_measured_is_what_is_asked_for_where_nothing_is() -> None:
    assert REDUCE.preset(None) == measured()
    assert MESH.preset(None) == MeshOptions(
        quadratic=True, face_tied=True, leg_mesher=MESH.preset(None).leg_mesher
    )
    quick = PRESETS["quick"]()
    assert (quick.materials, quick.masses, quick.hub) == (
        measured().materials, measured().masses, "rigid"
    )  # fmt: skip


@pytest.mark.parametrize(
    ("content", "quadratic", "face_tied"),
    [({}, True, True), ({"file": "own.msh"}, True, False), ({"part": "disk"}, False, False)],
)
def test_a_mesh_is_quadratic_where_silicone_needs_it(
    content: dict[str, Any], quadratic: bool, face_tied: bool
) -> None:
    """A file says by its own node sets how it is tied."""
    found = layered(MESH.preset(None), [content])
    assert (found.quadratic, found.face_tied) == (quadratic, face_tied)
    assert not layered(MESH.preset("paper"), [content]).quadratic
    assert not layered(MESH.preset(None), [content, {"quadratic": False}]).quadratic


def test_a_leg_brings_all_of_the_preset_that_made_it(tmp_path: Path) -> None:
    assert asked({"leg": "published"}) == ReduceOptions()
    assert asked({"leg": "hyperelastic"}, preset="paper") == hyperelastic()
    assert asked({"leg": "measured"}, preset="paper") == measured()
    # But for what is set beside it, or was before.
    kept = asked(
        {"mesh": str(own_mesh(False).save(tmp_path / "mesh.npz"))},
        {"leg": "published", "snapshots": {"static": {"bend_count": 3}}},
    )
    assert kept.mesh == tmp_path / "mesh.npz"
    assert kept.snapshots.static.bend_count == 3
    assert kept.materials == ReduceOptions().materials


def test_a_silicone_by_its_name_brings_its_law_and_density() -> None:
    """The tested secant modulus at the test's rate, as the preset's own silicone has it."""
    assert asked({"silicone": "Dragon Skin 30"}).materials == measured().materials
    soft = asked({"silicone": "Ecoflex 00-30"}, preset="quick")
    rubber = SILICONES["Ecoflex 00-30"]
    assert soft.materials.silicone == rubber.material(relaxation=BEAM_RELAXATION)
    assert soft.materials.sheet == measured().materials.sheet
    assert soft.masses.densities.silicone_g_per_ml == pytest.approx(1.07, rel=DIGITS)
    weighed = asked({"silicone": "Ecoflex 00-30", "masses": {"leg_mass_g": 40.0}})
    assert weighed.masses == Masses("cast", leg_mass_g=40.0)
    with pytest.raises(ValueError, match="no silicone 'Ecoflex 30' in the table, expected one of"):
        asked({"silicone": "Ecoflex 30"})
    with pytest.raises(ValueError, match="silicone is 'Dragon Skin 20', expected none of a leg"):
        asked({"silicone": "Dragon Skin 20"}, preset="paper")


def test_a_largest_pressure_takes_all_pressures_with_it() -> None:
    """In proportion, as those of a leg of another stiffness would be."""
    found, usual = asked({"largest_pressure_kPa": 40.0}).snapshots, measured().snapshots
    assert found.walk.amplitude_kPa == 40.0
    for now, before in (
        (found.static.bend_pressure_kPa, usual.static.bend_pressure_kPa),
        (found.static.load_pressure_kPa, usual.static.load_pressure_kPa),
        (found.blocked.pressure_kPa, usual.blocked.pressure_kPa),
        (found.walk.pressure_rate_kPa_per_s, usual.walk.pressure_rate_kPa_per_s),
    ):
        assert now == pytest.approx(0.4 * before, rel=DIGITS)
    own = {"snapshots": {"blocked": {"pressure_kPa": 30.0}}}
    assert asked({"largest_pressure_kPa": 40.0, **own}).snapshots.blocked.pressure_kPa == 30.0
    for wrong, why in ((-1.0, "largest_pressure_kPa"), ("much", "largest_pressure_kPa")):
        with pytest.raises(ValueError, match=why):
            asked({"largest_pressure_kPa": wrong})


def test_linear_tetrahedra_of_measured_silicone_are_refused(tmp_path: Path) -> None:
    """They lock; in the published physics they are what was published."""
    mesh = {"mesh": str(own_mesh(False).save(tmp_path / "mesh.npz"))}
    with pytest.raises(ValueError, match=r"mesh\.npz has linear tetrahedra, which lock .*--quadra"):
        reduce_as_asked(asked(mesh), RunFolder(tmp_path / "run", "reduce"))
    assert not (tmp_path / "run").exists()


def test_a_leg_that_was_cast_weighs_that_wherever_it_walks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its reduction says so: nobody is asked for its mesh again. Its finite elements are of its own
    silicone."""
    mesh = own_mesh(True)
    options = asked(
        {"mesh": str(mesh.save(tmp_path / "mesh.npz")), "silicone": "Ecoflex 00-50"},
    )
    told: dict[str, Any] = {}
    monkeypatch.setattr(
        "pneumorph.study.reduction_options.reduce",
        lambda robot, folder, settings, metadata, **_: told.update(metadata, robot=robot),
    )
    reduce_as_asked(options, RunFolder(tmp_path / "run", "reduce"))
    full = told.pop("robot").module.full
    paper_kg = 80e-9 * 40.0 * 12.0
    assert full.mass_kg == pytest.approx(1.07e-6 * float(mesh.volumes.sum()) + paper_kg, rel=1e-9)
    shipped = paper_leg("measured").reduced
    scaled = scaled_part(shipped, 1.0, full.mass_kg / shipped.mass)
    own = replace(scaled, metadata={**shipped.metadata, **told})
    leg = paper_leg("measured", part=own, mesh=mesh, masses=Masses("cast"))
    assert leg.reduced.mass == own.mass
    assert leg.full.mass_kg == full.mass_kg
    assert leg.full.material == options.materials.silicone
    assert leg_kind("measured").materials.silicone != leg.full.material
