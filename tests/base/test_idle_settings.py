"""What would be ignored is refused where somebody set it, and nowhere else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.idle_settings import is_of_a_run, refuse_idle, within
from pneumorph.base.layers import layered
from pneumorph.base.settings import save_settings


@dataclass(frozen=True)
class Worlds:
    draws: bool = False
    count: int = 8
    ranges: tuple[float, ...] = ()

    def idle_settings(self) -> dict[str, str]:
        return {} if self.draws else dict.fromkeys(("count", "ranges"), "without --worlds.draws")


@dataclass(frozen=True)
class Options:
    worlds: Worlds = field(default_factory=Worlds)
    robot: str = "usual"

    @classmethod
    def implied(cls, content: Mapping[str, Any], _: Mapping[str, Any]) -> dict[str, Any]:
        """Another robot brings its ranges."""
        return {"worlds": {"ranges": [1.0]}} if "robot" in content else {}

    def idle_settings(self) -> dict[str, str]:
        return within("worlds", self.worlds)


def refuse(
    *layers: dict[str, Any], base: Options | None = None, folder: Path | None = None
) -> None:
    base = base or Options()
    refuse_idle(layered(base, layers), base, layers, folder)


def test_what_was_set_is_refused_by_its_flag() -> None:
    told = "--worlds.count: expected to be left out without --worlds.draws: it would be ignored"
    with pytest.raises(ValueError, match=told):
        refuse({"robot": "own"}, {"worlds": {"count": 3}})
    refuse({"worlds": {"count": 3}}, {"worlds": {"draws": True}})


def test_what_a_choice_a_preset_or_a_default_brings_is_not() -> None:
    refuse({"robot": "own"})
    refuse({"worlds": {"count": 8}})
    preset = Options(Worlds(count=3))
    refuse({"worlds": {"count": 3}}, base=preset)
    with pytest.raises(ValueError, match=r"worlds\.count"):
        refuse({"worlds": {"count": 8}}, base=preset)
    refuse_idle(3, 3, [{}])  # no settings that could say so


def test_a_higher_layer_may_silence_a_lower_one() -> None:
    """Not what changed nothing where it was set as well."""
    refuse({"worlds": {"draws": True, "count": 3}}, {"worlds": {"draws": False}})
    with pytest.raises(ValueError, match=r"worlds\.count"):
        refuse({"worlds": {"draws": True, "count": 3}}, {"worlds": {"draws": False, "count": 4}})
    with pytest.raises(ValueError, match=r"worlds\.count"):
        refuse({"worlds": {"count": 3}}, {"robot": "own"}, {"worlds": {"draws": False}})
    with pytest.raises(ValueError, match=r"worlds\.count"):  # also of the value that is silenced
        refuse({"worlds": {"draws": True, "count": 3}}, {"worlds": {"draws": False, "count": 3}})


def test_a_layer_whose_files_are_gone_is_not_judged_alone() -> None:
    """Those above may name others."""

    @dataclass(frozen=True)
    class OfFile:
        file: str = "here"
        count: int = 8

        def idle_settings(self) -> dict[str, str]:
            if self.file == "gone":
                raise FileNotFoundError("gone does not exist")
            return {"count": "with a file"}

    layers = [{"file": "gone"}, {"file": "there"}]
    refuse_idle(layered(OfFile(), layers), OfFile(), layers)


def test_what_a_file_set_is_refused_by_the_files_name() -> None:
    def of_file(*layers: dict[str, Any]) -> None:
        refuse_idle(layered(Options(), layers), Options(), layers, None, Path("own.toml"))

    said = r"^settings file own\.toml: --worlds\.count: expected to be left out without"
    with pytest.raises(ValueError, match=said):
        of_file({"worlds": {"count": 3}}, {"robot": "own"})
    with pytest.raises(ValueError, match=r"^--worlds\.count: expected"):
        of_file({"robot": "own"}, {"worlds": {"count": 3}})
    with pytest.raises(ValueError, match=r"^--worlds\.count: expected"):  # whose value would count
        of_file({"worlds": {"count": 4}}, {"worlds": {"count": 3}})


def test_a_layer_that_is_nothing_without_those_above_is_not_judged_alone() -> None:
    refuse({"worlds": {"count": 3}, "robot": 1}, {"robot": "own"})


def test_a_run_may_keep_what_it_was_begun_with(tmp_path: Path) -> None:
    """An earlier version took it, and refuses to go on with other settings."""
    save_settings(tmp_path / "settings.json", Options(Worlds(count=3)))
    refuse({"worlds": {"count": 3}}, folder=tmp_path)
    with pytest.raises(ValueError, match=r"worlds\.count"):
        refuse({"worlds": {"count": 4}}, folder=tmp_path)
    (tmp_path / "settings.json").write_text("{")
    with pytest.raises(ValueError, match=r"worlds\.count"):
        refuse({"worlds": {"count": 3}}, folder=tmp_path)


def test_settings_of_runs_are_known_by_their_name() -> None:
    assert is_of_a_run(Path("run") / "settings.json")
    assert not is_of_a_run(Path("mine.toml"))
