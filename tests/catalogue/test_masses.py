"""What robots weigh: published, cast or weighed, the same in both models."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.base.layers import layered
from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.catalogue.leg_kinds import load_default_leg, paper_leg_mesh
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.masses import (
    PRINTED_HUB,
    CastDensities,
    Masses,
    cast_leg_mass_kg,
)
from pneumorph.catalogue.paper_robot import paper_hub, paper_robot
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.leg_model import leg_model
from pneumorph.fem.material import LegMaterials, MassLumping
from pneumorph.fem.part_ingredients import ingredients
from pneumorph.fem.rigid_hub import RigidHub
from pneumorph.fem.soft_hub import SoftHub
from pneumorph.geometry.mass_properties import MassProperties
from pneumorph.geometry.mesh import MeshError
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.simulation.reference_mass import hub_moments, mass_matrix, mount_moments

DESIGN = "1.0.0.2.2.0.0.1"
CAST_LEG_KG = 1e-6 * (43072.0 * 1.08 + 115.0 * 32.0 * 1e-3 * 80.0)
"""Boxes of the leg's shape, and a sheet of 115 x 32 mm."""


def masses_of(spec: RobotSpec) -> list[tuple[float, float]]:
    """Mass of a leg and of the hub in both models [kg], hubs soft and rigid."""
    robot = spec.assembly(DESIGN)
    full = [spec.hub.full(model) for model in ("soft", "rigid")]
    assert isinstance(full[0], SoftHub)
    assert isinstance(full[1], RigidHub)
    leg = float(spec.module.full.node_mass.sum())
    # A rigid translation of the mounted leg moves its whole mass.
    moments = mount_moments(robot.mounts[0], np.zeros(robot.mounts[0].part.mode_count))
    np.testing.assert_allclose(mass_matrix(moments)[:3, :3], leg * np.eye(3), atol=1e-12)
    return [
        (robot.mounts[0].part.mass, robot.hub.mass),
        (leg, float(full[0].part.node_mass.sum())),
        (leg, full[1].mass_kg),
    ]


@pytest.mark.parametrize(
    ("leg", "masses", "leg_kg", "hub_kg"),
    [
        ("published", None, 0.105, 0.075),
        ("published", Masses("cast"), CAST_LEG_KG, PRINTED_HUB.mass_kg),
        ("hyperelastic", None, CAST_LEG_KG, PRINTED_HUB.mass_kg),
        ("hyperelastic", Masses("published"), 0.105, 0.075),
        ("hyperelastic", Masses("cast", leg_mass_g=42.0), 0.042, PRINTED_HUB.mass_kg),
        ("published", Masses(hub_mass_g=30.0), 0.105, 0.030),
    ],
)
def test_both_models_weigh_what_is_asked_for(leg, masses, leg_kg, hub_kg) -> None:
    for found in masses_of(paper_robot(leg, masses=masses)):
        assert found == pytest.approx((leg_kg, hub_kg), rel=1e-12)


def test_a_cast_leg_is_its_volume_and_its_sheet() -> None:
    mesh = paper_leg_mesh()
    assert cast_leg_mass_kg(mesh) == pytest.approx(CAST_LEG_KG, rel=1e-9)
    light = CastDensities(silicone_g_per_ml=0.54, sheet_g_per_m2=0.0)
    assert cast_leg_mass_kg(mesh, light) == pytest.approx(43072.0 * 0.54e-6, rel=1e-9)
    assert cast_leg_mass_kg(quadratic_mesh(mesh)) == pytest.approx(CAST_LEG_KG, rel=1e-9)
    with pytest.raises(MeshError, match="sheet"):
        cast_leg_mass_kg(box_mesh())


def test_a_cast_leg_by_volume_has_the_inertia_of_its_shape() -> None:
    """Even masses depend on the mesh: those of this one turn a sixth too easily (measured)."""
    mesh = paper_leg_mesh()
    shape = MassProperties.of_tetrahedra(mesh.nodes, mesh.tetrahedra, 1.0).weighing(0.0468)

    def lumped(lumping: MassLumping) -> MassProperties:
        leg = leg_model(mesh, LegMaterials(mass_kg=0.0468, mass_lumping=lumping))
        assert ingredients(leg).get("mass_lumping", "even") == lumping
        mass = leg.node_mass
        moments = mass @ mesh.nodes, mesh.nodes.T @ (mass[:, None] * mesh.nodes)
        return MassProperties.of_moments(float(mass.sum()), *moments)

    by_volume, even = lumped("volume"), lumped("even")
    np.testing.assert_allclose(by_volume.centre_mm, shape.centre_mm, atol=1e-9)
    # Corners carry what is spread between them, so a lumped mass has a little more inertia.
    ratios = np.diag(by_volume.inertia) / np.diag(shape.inertia)
    np.testing.assert_allclose(ratios, 1.0, atol=0.05)
    assert even.inertia[2, 2] < 0.85 * shape.inertia[2, 2]


def test_hubs_of_both_models_have_the_printed_inertia() -> None:
    spec = paper_hub(Masses("cast"))
    expected = PRINTED_HUB
    rigid = spec.full("rigid")
    assert isinstance(rigid, RigidHub)
    np.testing.assert_allclose(rigid.rest_centre, expected.centre_mm, rtol=1e-12)
    np.testing.assert_allclose(rigid.inertia, expected.inertia, rtol=1e-12)
    reduced = MassProperties.of_moments(
        spec.rigid.mass, spec.rigid.first_moment, spec.rigid.second_moment
    )
    np.testing.assert_allclose(reduced.inertia, expected.inertia, rtol=1e-9)
    moments = hub_moments(spec.rigid)
    assert moments.mass == expected.mass_kg
    np.testing.assert_allclose(moments.first, expected.first_moment)

    soft = spec.full("soft")
    assert isinstance(soft, SoftHub)
    mass, nodes = soft.part.node_mass, soft.part.rest_nodes
    assert mass.min() > 0.0
    found = MassProperties.of_moments(
        float(mass.sum()), mass @ nodes, nodes.T @ (mass[:, None] * nodes)
    )
    np.testing.assert_allclose(found.centre_mm, expected.centre_mm, atol=1e-9)
    assert found.inertia[2, 2] == pytest.approx(expected.inertia[2, 2], rel=1e-9)
    # The disk's nodes lie on two levels 18 mm apart, which sets their spread in height.
    assert found.inertia[0, 0] == pytest.approx(expected.inertia[0, 0], rel=0.05)


def test_a_weighed_hub_keeps_its_shape() -> None:
    hub = paper_hub(Masses("cast", hub_mass_g=15.0)).full("rigid")
    assert isinstance(hub, RigidHub)
    factor = 0.015 / PRINTED_HUB.mass_kg
    np.testing.assert_allclose(hub.inertia, factor * PRINTED_HUB.inertia, rtol=1e-12)
    heavier = paper_hub(Masses("cast")).scaled(2.0).full("rigid")
    assert isinstance(heavier, RigidHub)
    np.testing.assert_allclose(heavier.inertia, 2.0 * PRINTED_HUB.inertia, rtol=1e-12)


def test_a_leg_brings_its_masses_and_older_runs_keep_theirs(tmp_path: Path) -> None:
    def model(*layers: dict[str, object]) -> str:
        return layered(RobotOptions.of("published"), layers).masses.model

    assert model() == "published"
    assert layered(RobotOptions(), []).masses.model == "cast"
    assert model({"leg": "hyperelastic"}) == "cast"
    assert model({"leg": "hyperelastic", "masses": {"model": "published"}}) == "published"
    assert model({"masses": {"model": "cast"}}) == "cast"
    # A run that was saved before there was a choice walked with the published masses.
    older = {**settings_to_dict(RobotOptions.of("published")), "leg": "hyperelastic"}
    del older["masses"]
    assert settings_from_dict(RobotOptions, json.loads(json.dumps(older))).masses == Masses()
    assert model(older) == "published"


def test_a_reduced_leg_of_another_mesh_has_to_be_weighed() -> None:
    """Its volume is not known; the one that ships is recognised by its mesh."""
    part = load_default_leg("published")
    assert module_of_leg(
        "published", part=part, masses=Masses("cast")
    ).reduced.mass == pytest.approx(CAST_LEG_KG)
    other = load_default_leg("hyperelastic")
    with pytest.raises(ValueError, match=r"give full\.mesh, or a weighed masses\.leg_mass_g"):
        _ = module_of_leg("published", part=other, masses=Masses("cast")).reduced
    weighed = module_of_leg("published", part=other, masses=Masses("cast", leg_mass_g=42.0)).reduced
    assert weighed.mass == pytest.approx(0.042)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Masses(leg_mass_g=0.0), r"leg_mass_g must be positive, got 0\.0"),
        (lambda: Masses(hub_mass_g=-30.0), r"hub_mass_g must be positive, got -30\.0"),
        (
            lambda: CastDensities(silicone_g_per_ml=-1.08),
            r"silicone_g_per_ml must be positive, got -1\.08",
        ),
        (
            lambda: CastDensities(sheet_g_per_m2=-1.0),
            r"sheet_g_per_m2 must be at least 0, got -1\.0",
        ),
        (
            lambda: Masses(densities=CastDensities(silicone_g_per_ml=1.2)),
            r"densities are .*1\.2.*nothing looks at them where model is not \"cast\"",
        ),
        (
            lambda: module_of_leg("measured", masses=Masses("cast", leg_mass_g=0.042)).reduced,
            r"the leg, of masses\.leg_mass_g .*, weighs 0\.042 g .* expected 0\.02 to 25: ",
        ),
        (
            lambda: paper_hub(Masses("cast", hub_mass_g=81_000.0)),
            r"the disk of masses\.hub_mass_g weighs 8\.1e\+04 g .* expected 0\.02 to 25",
        ),
        (lambda: Masses("iron"), "model must be one of published, cast, got 'iron'"),
    ],
)
def test_masses_that_cannot_be_are_refused(make, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(("size", "mass_g"), [(3.0, 1300.0), (0.25, 0.8)])
def test_a_weighed_leg_is_held_against_its_own_volume(size: float, mass_g: float) -> None:
    mesh = paper_leg_mesh().scaled(size)
    leg = module_of_leg("published", mesh=mesh, masses=Masses("cast", leg_mass_g=mass_g))
    assert leg.full.mass_kg == pytest.approx(1e-3 * mass_g)
