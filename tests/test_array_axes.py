"""Arrays of the library's nouns and of the reference step have the axes that are written there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from typing import Any, get_type_hints

import numpy as np
import pytest
from helpers.synthetic_part import synthetic_mesh, synthetic_reduced_part
from jaxtyping import TypeCheckError, jaxtyped

from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.simulation.reference_contact import FrictionLaw, solve_friction
from pneumorph.simulation.reference_forces import pressure_force
from pneumorph.simulation.reference_mass import cross_matrix
from pneumorph.simulation.reference_step import StepSystem
from pneumorph.trajectory import Trajectory

pytest.importorskip("beartype")


def test_axes_of_one_name_are_of_one_length() -> None:
    StepSystem(np.eye(7), np.eye(7), np.eye(7), np.zeros(7))
    with pytest.raises(TypeCheckError, match="force"):
        StepSystem(np.eye(7), np.eye(7), np.eye(7), np.zeros(6))
    with pytest.raises(TypeCheckError, match="stiffness"):
        StepSystem(np.eye(7), np.zeros((7, 6)), np.eye(7), np.zeros(7))


def test_arguments_have_the_axes_that_they_name() -> None:
    with pytest.raises(TypeCheckError, match="vector"):
        cross_matrix(np.zeros((1, 3)))
    with pytest.raises(TypeCheckError, match="vector"):
        cross_matrix(np.zeros(3, dtype=int))
    law = FrictionLaw(np.eye(3), np.zeros(3), np.ones(1))
    with pytest.raises(TypeCheckError, match="start"):
        solve_friction(law, np.zeros(3), 1e-9)
    with pytest.raises(TypeCheckError, match="alpha"):
        pressure_force(None, np.zeros((1, 3)), np.zeros(1))  # type: ignore[arg-type]


def test_what_is_saved_has_the_axes_that_its_file_promises(walk: Trajectory) -> None:
    with pytest.raises(TypeCheckError, match="contact_force_mN"):
        replace(walk, contact_force_mN=np.zeros((2, 4, 3), np.float32))


def misnamed(thing: Any) -> list[str]:
    """Fields whose arrays have not the axes that their annotations name, all taken together."""
    from beartype.door import is_bearable

    hints = get_type_hints(type(thing), include_extras=True)
    with jaxtyped("context"):
        return [
            item.name for item in fields(thing)
            if not all(is_bearable(each, hint) for each, hint in entries(thing, item.name, hints))
        ]  # fmt: skip


def entries(thing: Any, name: str, hints: Mapping[str, Any]) -> Iterator[tuple[Any, Any]]:
    """A field with its annotation; of a table of arrays each of them."""
    value, hint = getattr(thing, name), hints[name]
    if isinstance(value, Mapping) and name != "metadata":
        yield from ((each, hint.__args__[1]) for each in value.values())
    else:
        yield value, hint


def grown(thing: Any) -> Iterator[tuple[str, Any]]:
    """The same with one array longer by one along one axis, or of one axis more: any of them."""
    for item in fields(thing):
        value = getattr(thing, item.name)
        if isinstance(value, np.ndarray) and value.size:
            for axis in range(value.ndim):
                longer = np.concatenate([value, np.take(value, [0], axis)], axis)
                yield f"{item.name} along {axis}", {item.name: longer}
            yield f"{item.name} with one axis more", {item.name: value[..., None]}


def quadratic() -> Mesh:
    return quadratic_mesh(synthetic_mesh((4, 4, 4)))


@pytest.mark.parametrize(
    "make", [lambda: synthetic_reduced_part(mode_count=3, cells=(4, 4, 4)), quadratic]
)
def test_what_meshes_and_parts_accept_has_the_axes_that_are_written_there(make: Any) -> None:
    thing = make()
    assert misnamed(thing) == []
    refused = 0
    for what, change in grown(thing):
        try:
            other = replace(thing, **change)
        except ValueError:
            refused += 1
        else:
            assert misnamed(other) == [], what
    assert refused > 5


def test_annotations_of_meshes_and_parts_tell_axes_apart() -> None:
    """Past the classes' own refusals."""
    for thing, name in (
        (synthetic_reduced_part(3, (4, 4, 4)), "contact_modes"),
        (quadratic(), "edge_nodes"),
    ):
        object.__setattr__(thing, name, getattr(thing, name)[..., :-1])
        assert misnamed(thing) == [name]


def test_states_of_the_engine_have_the_axes_that_are_written_there() -> None:
    robot = paper_robot("measured").reduced("1.0.0.2.2.0.0.1")
    state, _ = robot.rollout(robot.initial_state(), np.full((2, 3), 20.0))
    assert state.modes.shape[0] == 4
    assert state.springs.size > 0
    assert misnamed(state) == []
    passed = [what for what, change in grown(state) if not misnamed(replace(state, **change))]
    of_one_array = ["regulated along 0", "impulses along 0", "springs along 1", "springs along 2"]
    assert passed == of_one_array


@pytest.fixture
def walk() -> Trajectory:
    place, pressure = np.zeros((2, 3)), np.zeros((2, 1))
    turn = np.tile(np.eye(3), (2, 1, 1))
    return Trajectory(np.arange(2.0), place, turn, place, pressure, pressure, np.zeros(2, int))
