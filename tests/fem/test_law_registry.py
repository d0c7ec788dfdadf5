import pytest
from helpers.box_mesh import box_mesh

from pneumorph.fem import law_registry
from pneumorph.fem.law_registry import law_names, make_law, register_law
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.st_venant_kirchhoff import StVenantKirchhoff


@pytest.fixture(autouse=True)
def own_registry(monkeypatch):
    monkeypatch.setattr(law_registry, "_FACTORIES", dict(law_registry._FACTORIES))


def test_a_registered_law_is_made_by_its_name():
    register_law("stiff", lambda material, dimension: StVenantKirchhoff(material, dimension))
    assert "stiff" in law_names()
    assert isinstance(make_law(Material(100.0, 0.3, "stiff"), 2), StVenantKirchhoff)


def test_an_unknown_law_is_refused_with_those_known():
    with pytest.raises(
        ValueError, match=r"law must be one of corotational, .*got 'ogden'.*registered first"
    ):
        make_law(Material(100.0, 0.3, "ogden"), 3)


def test_a_name_belongs_to_one_law():
    with pytest.raises(ValueError, match=r"law 'corotational' is taken by .*Corotational"):
        register_law("corotational", StVenantKirchhoff)
    # The same once more does no harm, as when a module is imported again.
    register_law("st_venant_kirchhoff", StVenantKirchhoff)


MESH = box_mesh((4.0, 2.0, 2.0), (2, 1, 1))


@pytest.mark.parametrize("law", ["corotational", "st_venant_kirchhoff", "stable_neo_hookean"])
@pytest.mark.parametrize("name", ["yeoh_c2_over_c1", "yeoh_c3_over_c1"])
def test_constants_of_yeohs_law_are_refused_of_another(law, name):
    """Of solids and sheets; a law of one's own may have them. Settings that say so can be read."""
    own, plain = Material(100.0, 0.3, law, **{name: 0.5}), Material(100.0, 0.3, law)
    sheet = Membrane("bottom", own)
    for material, membranes in ((own, ()), (plain, (sheet,))):
        with pytest.raises(ValueError, match=f"{name} is 0.5 of the law '{law}', expected 0"):
            PartModel(MESH, material, 0.001, membranes)
    register_law("mine", StVenantKirchhoff)
    PartModel(MESH, Material(100.0, 0.3, "mine", **{name: 0.5}), 0.001)


def test_a_sheet_of_mean_dilatation_is_refused():
    sheet = Membrane("bottom", Material(100.0, 0.3, "stable_neo_hookean", dilatation="mean"))
    with pytest.raises(ValueError, match="sheet's dilatation is 'mean', expected 'pointwise'"):
        PartModel(MESH, Material(100.0, 0.3), 0.001, (sheet,))
