"""What a leg of one's own is reduced as: in the measured physics, unless the published one is asked
for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.leg_kinds import leg_kind, paper_leg_mesh
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.masses import Masses
from pneumorph.command.mesh import VERB as MESH
from pneumorph.command.mesh import MeshOptions
from pneumorph.command.reduce import VERB as REDUCE
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.silicones import BEAM_RELAXATION, SILICONES
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.netgen_mesher import MesherSettings
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


def test_measured_is_what_is_asked_for_where_nothing_is() -> None:
    assert REDUCE.preset(None) == measured()
    assert MESH.preset(None) == MeshOptions(
        quadratic=True, face_tied=True, leg_mesher=MesherSettings(6.0, 0.9)
    )
    quick = PRESETS["quick"]()
    assert (quick.materials, quick.masses, quick.hub) == (
        measured().materials, measured().masses, "rigid"
    )  # fmt: skip


@pytest.mark.parametrize(
    ("content", "quadratic", "face_tied"),
    [
        ({}, True, True),
        ({"file": "own.msh"}, True, False),
        ({"file": "hub.msh", "surfaces": []}, False, False),
        ({"part": "disk"}, False, False),
    ],
)
def test_a_mesh_is_quadratic_where_silicone_needs_it(
    content: dict[str, Any], quadratic: bool, face_tied: bool
) -> None:
    """A file says by its own node sets how it is tied."""
    found = layered(MESH.preset(None), [content])
    assert (found.quadratic, found.face_tied) == (quadratic, face_tied)
    assert not layered(MESH.preset("paper"), [content]).quadratic
    assert not layered(MESH.preset(None), [content, {"quadratic": False}]).quadratic


def test_a_leg_brings_all_of_the_preset_that_made_it(mesh_file: Path) -> None:
    assert asked({"leg": "published"}) == ReduceOptions()
    assert asked({"leg": "hyperelastic"}, preset="paper") == hyperelastic()
    assert asked({"leg": "measured"}, preset="paper") == measured()
    # But for what is set beside it, or was before.
    kept = asked(
        {"mesh": str(mesh_file)},
        {"leg": "published", "snapshots": {"static": {"bend_count": 3}}},
    )
    assert kept.mesh == mesh_file
    assert (kept.snapshots.static.bend_count, kept.reduction.rotation) == (3, "polar")
    published = ReduceOptions().materials
    weight_kg = (
        published.mass_kg * Mesh.load(mesh_file).volumes.sum() / paper_leg_mesh().volumes.sum()
    )
    assert kept.materials.mass_kg == pytest.approx(weight_kg, rel=DIGITS)
    assert replace(kept.materials, mass_kg=0.105) == published
    with pytest.raises(ValueError, match="silicone is 'Dragon Skin 20', expected none"):
        asked({"silicone": "Dragon Skin 20"}, {"leg": "published"})


def pressures(options: ReduceOptions) -> tuple[float, ...]:
    """All that its snapshots are of, of the rate too."""
    static, walk = options.snapshots.static, options.snapshots.walk
    blocked_kPa = options.snapshots.blocked.pressure_kPa
    inflated = (static.bend_pressure_kPa, static.load_pressure_kPa, blocked_kPa)
    return (*inflated, walk.amplitude_kPa, walk.pressure_rate_kPa_per_s)


def test_a_silicone_by_its_name_brings_its_law_and_density() -> None:
    """The tested secant modulus at the test's rate, as the preset's own silicone has it. Pressures
    and forces are in proportion to the modulus: so it bends as far."""
    assert asked({"silicone": "Dragon Skin 30"}) == replace(measured(), silicone="Dragon Skin 30")
    soft = asked({"silicone": "Ecoflex 00-30"}, preset="quick")
    rubber = SILICONES["Ecoflex 00-30"]
    as_shipped = rubber.material(relaxation=BEAM_RELAXATION, small_strain=True)
    assert soft.materials.silicone == as_shipped
    assert soft.materials.sheet == measured().materials.sheet
    assert soft.masses.densities.silicone_g_per_ml == pytest.approx(1.07, rel=DIGITS)
    softer = rubber.c1_kPa / SILICONES["Dragon Skin 30"].c1_kPa
    expected = [softer * each for each in pressures(PRESETS["quick"]())]
    assert pressures(soft) == pytest.approx(expected, rel=1e-9)
    assert soft.snapshots.static.load_limit_mN == pytest.approx(1000.0 * softer, rel=1e-9)
    # Branches of one's own are those that its secant modulus is at the test's rate with.
    series = PronySeries((0.5,), (0.03,))
    own = {"materials": {"relaxation": {"weights": [0.5], "times_s": [0.03]}}}
    found = asked({"silicone": "Ecoflex 00-30", **own}).materials
    assert (found.silicone, found.relaxation) == (rubber.material(relaxation=series), series)
    for layers in (
        [{"silicone": "Ecoflex 00-30", "masses": {"leg_mass_g": 40.0}}],
        [{"silicone": "Ecoflex 00-30"}, {"masses": {"leg_mass_g": 40.0}}],
    ):
        assert asked(*layers).masses == Masses("cast", leg_mass_g=40.0)
    with pytest.raises(ValueError, match="no silicone 'Ecoflex 30' in the table, expected one of"):
        asked({"silicone": "Ecoflex 30"})
    with pytest.raises(ValueError, match="silicone is 'Dragon Skin 20', expected none of a leg"):
        asked({"silicone": "Dragon Skin 20"}, preset="paper")


def test_a_largest_pressure_takes_all_pressures_with_it() -> None:
    """In proportion, whatever the silicone is."""
    expected = [0.4 * each for each in pressures(measured())]
    for layers in (
        [{"largest_pressure_kPa": 40.0}],
        [{"largest_pressure_kPa": 40.0, "silicone": "Dragon Skin 20"}],
        [{"largest_pressure_kPa": 40.0}, {"silicone": "Dragon Skin 20"}],
        [{"silicone": "Dragon Skin 20"}, {"largest_pressure_kPa": 40.0}],
    ):
        assert pressures(asked(*layers)) == pytest.approx(expected, rel=1e-9)
    # Loads and walks go to it, free bends, where gaits end, 5 % further.
    static = asked({"largest_pressure_kPa": 40.0}).snapshots.static
    assert (static.load_pressure_kPa, static.bend_pressure_kPa) == pytest.approx((40.0, 42.0))
    own = {"snapshots": {"blocked": {"pressure_kPa": 30.0}, "walk": {"amplitude_kPa": 0.0}}}
    found = asked({"largest_pressure_kPa": 40.0, **own})
    assert pressures(found)[2:4] == (30.0, 0.0)
    assert pressures(found)[:2] == pytest.approx(expected[:2], rel=DIGITS)
    for wrong in ({"largest_pressure_kPa": -1.0}, {"largest_pressure_kPa": "much"}):
        with pytest.raises(ValueError, match="largest_pressure_kPa"):
            asked(wrong)
    with pytest.raises(ValueError, match="materials: expected a table of silicone"):
        asked({"silicone": "Dragon Skin 20", "materials": "soft"})


def test_linear_tetrahedra_of_measured_silicone_are_refused(
    mesh_file: Path, tmp_path: Path
) -> None:
    """They lock; in the published physics they are what was published."""
    mesh = {"mesh": str(mesh_file)}
    with pytest.raises(ValueError, match=r"mesh\.npz has linear tetrahedra, which lock .*--quadra"):
        reduce_as_asked(asked(mesh), RunFolder(tmp_path / "run", "reduce"))
    assert not (tmp_path / "run").exists()


def test_a_leg_that_was_cast_weighs_that_wherever_it_walks(
    mesh_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its reduction says so: nobody is asked for its mesh again. Its finite elements are of its own
    silicone."""
    mesh = quadratic_mesh(Mesh.load(mesh_file))
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
    shipped = module_of_leg("measured").reduced
    scaled = scaled_part(shipped, 1.0, full.mass_kg / shipped.mass)
    own = replace(scaled, metadata={**shipped.metadata, **told})
    leg = module_of_leg("measured", part=own, mesh=mesh, masses=Masses("cast"))
    assert leg.reduced.mass == own.mass
    assert leg.full.mass_kg == full.mass_kg
    assert leg.full.material == options.materials.silicone
    assert leg_kind("measured").materials.silicone != leg.full.material
