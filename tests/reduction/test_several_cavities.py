"""Parts whose frame is anywhere, and parts of several cavities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_mesh, synthetic_part

from pneumorph.catalogue.leg_kinds import hyperelastic_leg_mesh, paper_leg_mesh
from pneumorph.fem.material import Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import StaticResult
from pneumorph.geometry.pose import rotation_about
from pneumorph.reduction import static_snapshots
from pneumorph.reduction.assemble import assemble_reduced_part
from pneumorph.reduction.errors import reduced_bend
from pneumorph.reduction.reduce import check_settings
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.static_snapshots import (
    GRAVITY_MM_S2,
    StaticSnapshotSettings,
    bend_snapshots,
    load_snapshots,
)


def test_loads_are_on_the_outer_half_wherever_the_origin_is() -> None:
    """Moved by 200 mm in its own frame, a part is loaded and moves alike, to the solver's 1e-6 of
    the loads and what coordinates of 250 mm leave of it."""
    usual = synthetic_part((4, 4, 4))
    far = replace(usual.mesh, nodes=usual.mesh.nodes - [200.0, 0.0, 0.0])
    sheets = usual.membranes
    moved = PartModel(far, usual.material, usual.mass_kg, sheets, cavity="cavity")
    settings = StaticSnapshotSettings(load_count=4, load_pressure_kPa=20.0, load_limit_mN=200.0)
    states = [load_snapshots(part, settings, range(4)).displacement for part in (usual, moved)]
    assert np.abs(states[0]).max() > 0.05
    np.testing.assert_allclose(states[1], states[0], atol=1e-3 * np.abs(states[0]).max())


@pytest.mark.parametrize("surface", ["sheet", "outer_end_face"])
def test_loads_are_on_the_outer_half_of_a_surface_wherever_it_ends(surface: str) -> None:
    """One that ends before the middle of the leg; and one across it, without an outer half."""
    usual = synthetic_part((8, 4, 4))
    mesh = usual.mesh
    x = mesh.nodes[:, 0]
    middle = 0.5 * (x.min() + x.max())
    skin, sheet = mesh.surfaces["skin"], mesh.surfaces["sheet"]
    own = {
        "sheet": sheet[(x[sheet] < middle).all(axis=1)],
        "outer_end_face": skin[(x[skin] > x.max() - 1e-9).all(axis=1)],
    }
    mesh = replace(mesh, surfaces={**mesh.surfaces, "ground": own[surface]})
    part = PartModel(mesh, usual.material, usual.mass_kg, usual.membranes, cavity="cavity")
    settings = StaticSnapshotSettings(
        load_count=2, load_pressure_kPa=20.0, load_limit_mN=200.0, loaded_surface="ground"
    )
    loaded = load_snapshots(part, settings, range(2))
    assert len(loaded) == 2
    assert np.abs(loaded.displacement).max() > 0.01
    nodes = np.unique(own[surface])
    touched, likelihood = static_snapshots._touched(part.rest_nodes, nodes)
    along = x[nodes] - 0.5 * (x[nodes].min() + x[nodes].max())
    expected = nodes[along > 0.0] if surface == "sheet" else nodes
    np.testing.assert_array_equal(touched, expected)
    assert likelihood.sum() == pytest.approx(1.0)
    assert likelihood[np.argmax(x[touched])] == likelihood.max()


@pytest.mark.parametrize("mesh", [paper_leg_mesh, hyperelastic_leg_mesh])
def test_loads_of_legs_that_ship_are_those_that_they_were_reduced_from(mesh) -> None:
    """Their sheet spans them, to the bit: its outer half is the leg's."""
    leg = mesh()
    nodes, along = np.unique(leg.surface("sheet")), leg.nodes[:, 0]
    outwards = along - 0.5 * (along.min() + along.max())
    outer = nodes[outwards[nodes] > 0.0]
    touched, likelihood = static_snapshots._touched(leg.nodes, nodes)
    np.testing.assert_array_equal(touched, outer)
    weight = outwards[outer] ** 2
    np.testing.assert_array_equal(likelihood, weight / weight.sum())


def test_bend_is_compared_at_the_pressure_of_the_cavity_that_was_inflated() -> None:
    """Of two cavities one is inflated at full order, so one of the reduced part's too.

    On the modes of these very snapshots the reduced part can follow them; 1 % leaves room for what
    shapes between them are not in their span. Inflated in both, it bends further by far.
    """
    usual = synthetic_part((8, 4, 4))
    mesh = synthetic_mesh((8, 4, 4), wall=4)
    sheets = tuple(Membrane(s.surface, s.material, s.thickness_mm) for s in usual.membranes)
    part = PartModel(mesh, usual.material, usual.mass_kg, sheets, cavity="cavity")
    bent = bend_snapshots(part, StaticSnapshotSettings(bend_pressure_kPa=60.0, bend_count=6))
    root = np.sqrt(part.node_mass)[:, None]
    weighted = (bent.displacement.astype(float) * root).reshape(len(bent), -1)
    shapes = np.linalg.svd(weighted, full_matrices=False)[2][:4]
    modes = np.moveaxis(shapes.reshape(4, -1, 3) / root, 0, 2)
    reduced = assemble_reduced_part(part, modes)
    assert reduced.cavity_count == 2
    asked = (reduced, mesh, bent.displacement, bent.pressure_kPa)
    one = reduced_bend(*asked, cavities=part.cavity_names)
    both = reduced_bend(*asked)
    assert one.worst_percent < 1.0
    assert both.worst_percent > 20.0


def test_some_of_the_cavities_are_refused_before_snapshots_where_points_give_way() -> None:
    """How they do is found with the whole model, in the end."""
    usual = synthetic_part((4, 4, 4))
    mesh = synthetic_mesh((8, 4, 4), wall=4)
    part = PartModel(mesh, usual.material, usual.mass_kg, usual.membranes, cavity="cavity")
    check_settings(part, ReductionSettings(contact_flexibility=False))
    with pytest.raises(ValueError, match=r"cavity is cavity, expected .*, cavity, cavity_outer: a"):
        check_settings(part, ReductionSettings(contact_flexibility=True))


def test_one_cavity_is_inflated_as_it_always_was() -> None:
    part = synthetic_part((4, 4, 4))
    bent = bend_snapshots(part, StaticSnapshotSettings(bend_pressure_kPa=30.0, bend_count=3))
    modes = np.moveaxis(bent.displacement[-2:].astype(float), 0, 2)
    modes /= np.sqrt(np.einsum("n,nam,nam->m", part.node_mass, modes, modes))
    reduced = assemble_reduced_part(part, modes[:, :, :1])
    asked = (reduced, part.mesh, bent.displacement, bent.pressure_kPa)
    np.testing.assert_array_equal(
        reduced_bend(*asked, cavities=["cavity"]).reduced_deg, reduced_bend(*asked).reduced_deg
    )


def test_a_load_of_a_pitched_part_pushes_up_and_drags_level() -> None:
    """Turned as it is mounted, gravity and the ground's reaction are upright in the world: a part
    of next to no weight feels no more than the friction's share of its load along the level."""
    part = synthetic_part((4, 4, 4))
    settings = StaticSnapshotSettings(
        pitch_deg=40.0, friction=0.5, load_pressure_kPa=0.0, load_limit_mN=100.0
    )
    forces = []

    def noted(*_: object, external_force: np.ndarray, **__: object) -> StaticResult:
        forces.append(external_force)
        return StaticResult(part.rest_nodes, True, 0.0, 0, 0.0)

    weight = -GRAVITY_MM_S2 * part.mass_kg
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(static_snapshots, "static_equilibrium", noted)
        load_snapshots(part, settings, range(40))
    # The part's axes stand 40 degrees from the world's.
    total = np.array(forces).sum(axis=1) @ rotation_about("y", -40.0)
    normal, along, aside = total[:, 2] - weight, total[:, 0], total[:, 1]
    assert (normal > 0.0).all()
    assert normal.max() < 100.0
    drag = np.hypot(along, aside) / normal
    assert drag.max() <= 0.5 + 1e-9
    assert drag.max() > 0.4
