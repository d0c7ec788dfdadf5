import pytest

from pneumorph.fem import law_registry
from pneumorph.fem.law_registry import law_names, make_law, register_law
from pneumorph.fem.material import Material
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
