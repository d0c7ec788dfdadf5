"""Settings survive JSON and TOML, and everything that no dataclass knows is refused."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.settings import (
    load_settings,
    read_settings_file,
    save_settings,
    settings_from_dict,
    settings_to_dict,
)


@dataclass(frozen=True)
class Contact:
    friction: float = 1.2
    solver: Literal["exact", "sweeps"] = "exact"


@dataclass(frozen=True)
class Simulation:
    step_s: float = 0.01
    threads: int = 0
    objective: bool = False
    phases: tuple[float, ...] = (0.0, 10.0)
    mesh: Path | None = None
    contact: Contact = field(default_factory=Contact)

    def __post_init__(self) -> None:
        if self.step_s <= 0:
            raise ValueError(f"step_s is {self.step_s}, expected above 0")


def test_json_round_trip_is_equal(tmp_path: Path) -> None:
    settings = Simulation(
        step_s=0.005, threads=2, phases=(1.0, 2.5), mesh=Path("a.npz"), contact=Contact(0.4)
    )
    path = save_settings(tmp_path / "settings.json", settings)
    assert load_settings(Simulation, path) == settings


def test_toml_lies_over_the_default(tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    path.write_text("threads = 3\n[contact]\nfriction = 1\n")
    default = Simulation(step_s=0.02, contact=Contact(solver="sweeps"))
    loaded = load_settings(Simulation, path, default)
    assert loaded == Simulation(step_s=0.02, threads=3, contact=Contact(1.0, "sweeps"))


def test_unknown_key_is_refused_with_its_path_and_neighbour() -> None:
    with pytest.raises(ValueError, match=r"setting contact\.frictoin: did you mean friction"):
        settings_from_dict(Simulation, {"contact": {"frictoin": 1.0}})
    with pytest.raises(ValueError, match=r"groups nest, expected {'contact': {'friction': 0\.5}}"):
        settings_from_dict(Simulation, {"contact.friction": 0.5})


def test_a_text_is_no_list() -> None:
    with pytest.raises(ValueError, match="phases is '0 10', expected a list"):
        settings_from_dict(Simulation, {"phases": "0 10"})


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"threads": 2.7}, r"threads: expected int, got 2\.7"),
        ({"objective": "no"}, "objective: expected bool, got 'no'"),
        ({"threads": True}, "threads: expected int, got True"),
        ({"contact": {"solver": "best"}}, r"contact\.solver: .*best"),
        ({"phases": [0.0, "x"]}, r"phases\[1\]: expected a number, got 'x'"),
        ({"step_s": -1.0}, "step_s is -1.0, expected above 0"),
    ],
)
def test_wrong_values_are_refused_with_their_name(content: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        settings_from_dict(Simulation, content)


def test_files_that_are_not_settings_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"none\.toml does not exist"):
        load_settings(Simulation, tmp_path / "none.toml")
    broken = tmp_path / "broken.json"
    broken.write_text("{")
    with pytest.raises(ValueError, match="not valid JSON"):
        load_settings(Simulation, broken)
    broken.write_text("[]")
    with pytest.raises(ValueError, match="holds a list, expected a table"):
        load_settings(Simulation, broken)


def test_a_file_that_is_neither_by_its_name_is_told_so(tmp_path: Path) -> None:
    path = tmp_path / "walk.txt"
    path.write_text("population = 3\n")
    with pytest.raises(ArtefactError, match=r"walk\.txt is by its name neither .* not valid JSON"):
        read_settings_file(path)


def test_dictionary_holds_only_json_values() -> None:
    content = settings_to_dict(Simulation(mesh=Path("leg.msh")))
    assert content["mesh"] == "leg.msh"
    assert content["phases"] == [0.0, 10.0]
    assert content["contact"] == {"friction": 1.2, "solver": "exact"}
