"""Elements of the engine against those of NumPy, which say what they are to be."""

import pickle

import numpy as np
import pneumorph._engine as engine
import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.maxwell_group import ViscousState
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.yeoh_constants import yeoh_material
from pneumorph.geometry.quadratic import quadratic_mesh

SERIES = PronySeries((0.1, 0.2), (0.65, 0.02))
LAWS = {
    "yeoh": yeoh_material(87.0, 14.0, -1.5, bulk_over_shear=200.0),
    "yeoh at every point": yeoh_material(
        87.0, 14.0, -1.5, bulk_over_shear=5.0, dilatation="pointwise"
    ),
    "stable_neo_hookean": Material(520.0, 0.49, "stable_neo_hookean", dilatation="mean"),
    "st_venant_kirchhoff": Material(520.0, 0.3, "st_venant_kirchhoff"),
}
STEP_S = 0.01
PRESSURE_KPA = 30.0
# Forces and tangents are sums of some hundred terms of like size, each of a relative error of
# 1e-16; those of a nearly incompressible solid cancel by a factor of up to K / mu = 200.
ROUNDING = 1e-12


def part(law: str, order: int) -> PartModel:
    """A hollow box of 36 cubes, so that the last of the engine's packs is not full."""
    mesh = box_mesh((12.0, 9.0, 9.0), (5, 3, 3), hollow=True)
    mesh = mesh if order == 1 else quadratic_mesh(mesh)
    sheet = Membrane("bottom", Material(2e5, 0.3, "st_venant_kirchhoff"), 0.1)
    return PartModel(mesh, LAWS[law], 0.02, (sheet,), "cavity", relaxation=SERIES)


def bent(part: PartModel, seed: int = 0) -> np.ndarray:
    """Bent by a radian, far from the origin, and shaken by a hundredth of an element."""
    x, y, z = part.rest_nodes.T
    turned = np.column_stack([(12.0 + z) * np.sin(x / 12.0), y, (12.0 + z) * np.cos(x / 12.0)])
    result: np.ndarray = (
        turned + 100.0 + 0.02 * np.random.default_rng(seed).standard_normal(turned.shape)
    )
    return result


def memory_of(part: PartModel) -> ViscousState:
    """Of a solid that was bent otherwise before, springs stretched by some hundredths."""
    strain = part.branches.relaxed(bent(part, 1)).strain
    spring = 0.03 * np.random.default_rng(2).standard_normal((2, *strain.shape))
    return ViscousState(strain, spring + np.swapaxes(spring, 1, 2))


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("law", LAWS)
def test_forces_and_tangents_are_those_of_numpy(law, order):
    made = part(law, order)
    x, memory = bent(made), memory_of(made)
    state = made.branches.advanced(memory, x, STEP_S)
    force = made.internal_force(x, "polar") + made.pressure_force(x, PRESSURE_KPA)
    force += made.relaxing_force(state, x)
    tangent = made.tangent_data(x, PRESSURE_KPA, "polar")
    tangent += made.assembly.symmetric_data([made.branches.tangent_entries(state, x, STEP_S)])

    relaxing = made.compiled.relaxing_stress(memory, STEP_S)
    data = np.zeros(len(made.assembly.indices))
    with_tangent = made.compiled.force_and_tangent(x, PRESSURE_KPA, relaxing, data, 2.0)
    alone = made.compiled.force(x, PRESSURE_KPA, relaxing)
    np.testing.assert_allclose(alone, force, atol=ROUNDING * np.abs(force).max())
    np.testing.assert_array_equal(with_tangent, alone)
    np.testing.assert_allclose(data, 2.0 * tangent, atol=2.0 * ROUNDING * np.abs(tangent).max())


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("law", LAWS)
def test_tangents_of_foreseen_stresses_are_those_of_numpy(law, order):
    made = part(law, order)
    x = bent(made)
    change = 0.1 * np.random.default_rng(3).standard_normal(x.shape)
    expected = made.tangent_data(x, PRESSURE_KPA, "polar", change=change)
    data = np.zeros(len(made.assembly.indices))
    made.compiled.force_and_tangent(x, PRESSURE_KPA, None, data, 1.0, change)
    np.testing.assert_allclose(data, expected, atol=ROUNDING * np.abs(expected).max())
    usual = made.tangent_data(x, PRESSURE_KPA, "polar")
    assert np.abs(expected - usual).max() > 1e-3 * np.abs(usual).max()


def test_every_instruction_set_agrees():
    made = part("yeoh", 2)
    x = bent(made)
    expected = made.compiled.force(x)
    for name in engine.ELEMENT_INSTRUCTION_SETS:
        made.compiled.use(name)
        found = made.compiled.force(x)
        np.testing.assert_allclose(found, expected, atol=ROUNDING * np.abs(expected).max())
    with pytest.raises(ValueError, match="no instruction set abacus"):
        made.compiled.use("abacus")
    assert "baseline" in engine.ELEMENT_INSTRUCTION_SETS


def test_a_solid_turned_inside_out_has_no_force():
    made = part("yeoh", 2)
    x = made.rest_nodes.copy()
    corner = made.mesh.connectivity[0, 0]
    x[corner] += 3.0 * (made.rest_nodes[made.mesh.connectivity[0, 1:4]].mean(axis=0) - x[corner])
    assert np.isnan(made.compiled.force(x)[corner]).any()
    assert np.isfinite(made.compiled.force(made.rest_nodes)).all()


def test_a_part_that_was_compiled_goes_to_other_processes():
    made = part("yeoh", 2)
    x = bent(made)
    force = made.elastic_force(x)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(made)).elastic_force(x), force)


def test_parts_of_other_laws_stay_with_numpy():
    mesh = box_mesh((12.0, 9.0, 9.0), (5, 3, 3), hollow=True)
    rubber = LAWS["yeoh"]
    assert PartModel(mesh, Material(520.0, 0.3), 0.02).compiled is None
    sheet = Membrane("bottom", Material(520.0, 0.3, "stable_neo_hookean"))
    assert PartModel(mesh, rubber, 0.02, (sheet,)).compiled is None


def test_wrong_arrays_are_refused():
    made = part("yeoh", 1)
    assembly, group = made.assembly, made.element_groups[0]
    gradients, measures = group.material_gradients[:, None].copy(), group.measure[:, None].copy()
    nodes, constants = group.connectivity.astype(np.int32), np.ones(4)

    def make(law="yeoh", nodes=nodes, indptr=assembly.indptr):
        return engine.ElementSums(
            law, constants, nodes, gradients, measures, indptr, assembly.indices
        )

    with pytest.raises(ValueError, match="no law glue"):
        make("glue")
    with pytest.raises(ValueError, match="a node does not exist"):
        make(nodes=nodes + 1000)
    with pytest.raises(ValueError, match="must agree"):
        make(nodes=nodes[:-1])
    with pytest.raises(ValueError, match="the pattern lacks a block"):
        make(
            nodes=np.ascontiguousarray(nodes[::-1] * 0 + [0, 1, 2, made.node_count - 1]).astype(
                np.int32
            )
        )
    with pytest.raises(ValueError, match="positions and forces must be"):
        make().add(np.zeros((3, 3)), None, None, 0.0, np.zeros((3, 3)), None, 1.0)
    places, step = (assembly.size // 3, 3), np.zeros((3, 3))
    with pytest.raises(ValueError, match="change must be"):
        make().add(np.zeros(places), step, None, 0.0, np.zeros(places), None, 1.0)
