"""What was set higher wins, once; what was not set wins over nothing."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import pytest
import tyro

from pneumorph.base.layers import changed_flags, given_flags, layered


@dataclass(frozen=True)
class Motor:
    kind: Literal["small", "large"] = "small"
    mass_kg: float = 0.1
    speed: float = 1.0

    @classmethod
    def implied(cls, content: Mapping[str, Any], _: Mapping[str, Any]) -> dict[str, Any]:
        masses = {"small": 0.1, "large": 0.5}
        return {"mass_kg": masses[content["kind"]]} if "kind" in content else {}


@dataclass(frozen=True)
class Car:
    name: tyro.conf.Positional[str] = "car"
    seats: tuple[int, ...] = (1,)
    open_roof: bool = False
    lights_on: bool = True
    front: Motor = field(default_factory=Motor)
    rear: Annotated[Motor, tyro.conf.arg(name="")] = field(default_factory=Motor)


@dataclass(frozen=True)
class Lorry:
    axles: int = 2
    front: Motor = field(default_factory=Motor)

    @classmethod
    def implied(cls, content: Mapping[str, Any], _: Mapping[str, Any]) -> dict[str, Any]:
        return {"axles": 3} if content["front"].get("kind") == "large" else {}


def given(command: str, default: Car | None = None) -> dict[str, Any]:
    """What a command line set of a car."""
    default = default or Car()
    arguments = shlex.split(command)
    settings = tyro.cli(
        Car, args=arguments, default=default, config=(tyro.conf.FlagCreatePairsOff,)
    )
    return given_flags(settings, default, arguments)


def test_a_higher_layer_wins_and_what_it_leaves_open_stays() -> None:
    low = {"front": {"speed": 2.0, "mass_kg": 0.3}, "open_roof": True}
    high = {"front": {"speed": 3.0}}
    found = layered(Car(name="base"), [low, high])
    assert found == Car(name="base", open_roof=True, front=Motor(mass_kg=0.3, speed=3.0))
    assert layered(Car(), [high, low]).front.speed == 2.0
    assert layered(Car(name="base"), []) == Car(name="base")


def test_a_choice_brings_what_it_implies_just_below_its_own_layer() -> None:
    chosen = {"front": {"kind": "large"}}
    assert layered(Car(), [chosen]).front == Motor("large", 0.5)
    # Over what a lower layer said, under what its own layer or a higher one says.
    assert layered(Car(), [{"front": {"mass_kg": 0.2}}, chosen]).front.mass_kg == 0.5
    assert layered(Car(), [{"front": {"kind": "large", "mass_kg": 0.2}}]).front.mass_kg == 0.2
    assert layered(Car(), [chosen, {"front": {"mass_kg": 0.2}}]).front.mass_kg == 0.2
    # A layer that chooses nothing implies nothing.
    heavy = {"front": {"kind": "large", "mass_kg": 0.7}}
    assert layered(Car(), [heavy, {"front": {"speed": 2.0}}]).front == Motor("large", 0.7, 2.0)


def test_unknown_names_are_refused_in_every_layer() -> None:
    with pytest.raises(ValueError, match=r"unknown setting front\.sped: did you mean speed"):
        layered(Car(), [{"front": {"sped": 1.0}}, {"front": {"speed": 1.0}}])


def test_what_is_no_table_is_refused_where_a_group_is_expected() -> None:
    """Before what it implies is asked for, which reads it as one."""
    for wrong in ("large", 3, None, ["large"]):
        with pytest.raises(ValueError, match="front: expected a table of kind, mass_kg, speed, go"):
            layered(Lorry(), [{"front": wrong}])
    assert layered(Lorry(), [{"front": {"kind": "large"}}]).axles == 3


def test_flags_that_differ_are_told_of_what_settings_have() -> None:
    low, high = Car(), Car(seats=(2,), front=Motor(mass_kg=0.2, speed=2.0))
    assert changed_flags(low, high) == ["--seats", "--front.mass-kg", "--front.speed"]
    assert changed_flags(low, high, {"front": {"speed": 1.0}}) == ["--front.speed"]
    assert changed_flags(low, high, {"front": None}) == ["--front.mass-kg", "--front.speed"]
    assert changed_flags(low, high, {}) == []


def test_a_flag_counts_whatever_its_value() -> None:
    assert given("") == {}
    assert given("--front.speed 1") == {"front": {"speed": 1.0}}
    assert given("--front.mass-kg=0.1") == {"front": {"mass_kg": 0.1}}
    assert given("--front.mass_kg 0.1") == {"front": {"mass_kg": 0.1}}
    assert given("--seats 1 2 3") == {"seats": [1, 2, 3]}
    # A group without a prefix, and its like with one.
    assert given("--speed 1 --front.speed 2") == {"rear": {"speed": 1.0}, "front": {"speed": 2.0}}


def test_switches_are_seen_in_both_directions() -> None:
    assert given("--open-roof") == {"open_roof": True}
    assert given("--no-lights-on") == {"lights_on": False}
    assert given("--no-open-roof", Car(open_roof=True)) == {"open_roof": False}
    assert given("--lights-on", Car(lights_on=False)) == {"lights_on": True}


def test_a_positional_argument_is_given_where_it_differs() -> None:
    assert given("bus") == {"name": "bus"}
    assert given("car", Car(name="bus")) == {"name": "car"}
    assert given("--speed 2") == {"rear": {"speed": 2.0}}
