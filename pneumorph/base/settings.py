"""Settings between frozen dataclasses and JSON or TOML files.

Every option of the program is a field of a frozen dataclass beside the code it configures. A run
folder holds the resolved settings as JSON, and a file in either format can replace some of them:
keys that no dataclass has are refused, because a misspelt option that is silently ignored costs a
night of training.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Collection, Mapping
from dataclasses import is_dataclass
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin

import cattrs
from cattrs.strategies import configure_union_passthrough

from pneumorph.base.artefact import ArtefactError, read_text, table_of_json, write_json
from pneumorph.base.checked import hints_of
from pneumorph.base.shapes import refuse_other_shapes, table

Settings = TypeVar("Settings")


class SettingsError(ValueError):
    """Values that settings cannot have."""

    reasons: str = ""
    """Which, and why, without what they are settings of."""


def settings_to_dict(settings: Any) -> dict[str, Any]:
    """Return a settings dataclass as nested dictionaries of JSON values (tuples become lists)."""
    content: dict[str, Any] = json.loads(json.dumps(_converter().unstructure(settings)))
    return content


def settings_known_before(settings: Any, later: Collection[str]) -> dict[str, Any]:
    """Settings by name, which tell kept things apart, so that what earlier versions kept is found.

    Args:
        settings: A settings dataclass whose fields all have defaults.
        later: Fields that earlier versions did not have; named where they are not as usual.
    """
    usual, own = settings_to_dict(type(settings)()), settings_to_dict(settings)
    return {name: own[name] for name in own if name not in later or own[name] != usual[name]}


def settings_from_dict(
    kind: type[Settings], content: Mapping[str, Any], default: Settings | None = None
) -> Settings:
    """Return settings of class ``kind`` with the values of ``content``.

    Args:
        kind: The frozen dataclass.
        content: Nested dictionaries; keys left out keep the value of ``default``.
        default: Settings to start from; None stands for the defaults of ``kind``.

    Raises:
        ValueError: A key that no field has, or a value of the wrong type or range, which is a
            `SettingsError`.
    """
    content = upgraded(kind, content)
    merged: Any = content if default is None else laid_over(settings_to_dict(default), content)
    refuse_other_shapes(kind, merged)
    try:
        return _converter().structure(merged, kind)
    except cattrs.BaseValidationError as error:
        reasons = "; ".join(_reasons(error, ""))
        told = SettingsError(f"{kind.__name__} cannot be read: {reasons}")
        told.reasons = reasons
        raise told from error


def upgraded(kind: Any, content: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings that an earlier version wrote as they are called now.

    A settings class whose names have changed says how with a class method ``upgraded``. Settings of
    a group whose flags have no prefix may stand beside it, as the flags do: earlier versions had no
    such group.
    """
    content = table(content, f"{kind.__name__} cannot be read")
    now = dict(kind.upgraded(content) if hasattr(kind, "upgraded") else content)
    hints = hints_of(kind)
    for name, hint in hints.items():
        marks = getattr(hint, "__metadata__", ())
        if any(getattr(mark, "name", None) == "" for mark in marks):
            group = hints_of(dataclass_of(hint))
            beside = {key: now.pop(key) for key in set(now) & set(group) - set(hints)}
            if beside:
                inside = table(now.get(name, {}), name)
                _refuse_twice(beside, inside, name)
                now[name] = laid_over(beside, inside)
    for name, value in now.items():
        inner = dataclass_of(hints[name]) if name in hints else None
        if inner is not None and isinstance(value, Mapping):
            now[name] = upgraded(inner, value)
    return now


def _refuse_twice(beside: Mapping[str, Any], inside: Mapping[str, Any], name: str) -> None:
    """Refuse values of a group that stand in it and beside it, and differ."""
    for key in sorted(beside.keys() & inside.keys()):
        one, other, place = beside[key], inside[key], f"{name}.{key}"
        if isinstance(one, Mapping) and isinstance(other, Mapping):
            _refuse_twice(one, other, place)
        elif one != other:
            raise ValueError(
                f"{place} is {other!r}, and {place.partition('.')[2]} beside it {one!r}, expected "
                "one of them"
            )


def save_settings(path: Path | str, settings: Any) -> Path:
    """Write settings as JSON; `load_settings` reads them back equal."""
    return write_json(path, settings_to_dict(settings))


def read_settings_file(path: Path | str) -> dict[str, Any]:
    """Read a ``.json`` or ``.toml`` file as nested dictionaries.

    Raises:
        FileNotFoundError: No such file.
        ValueError: Not JSON or TOML, or no table.
    """
    return table_of_text(read_text(path, "settings"), path, "settings")


def table_of_text(text: str, path: Path | str, kind: str) -> dict[str, Any]:
    """The text of a ``.json`` or ``.toml`` file as nested dictionaries.

    Args:
        text: What is in it.
        path: The file, whose name says which of the two it is.
        kind: What it should hold, such as ``settings``.

    Raises:
        ArtefactError: Not JSON or TOML, or no table.
    """
    path = Path(path)
    if path.suffix in (".yaml", ".yml"):
        raise ArtefactError(
            f"{kind} file {path} is YAML by its name, expected JSON (.json) or TOML (.toml)"
        )
    if path.suffix == ".json":
        return table_of_json(text, path, kind)
    if path.suffix != ".toml":
        try:
            return table_of_json(text, path, kind)
        except ArtefactError as error:
            raise ArtefactError(
                f"{kind} file {path} is by its name neither JSON (.json) nor TOML (.toml), and was "
                f"read as JSON: {error}"
            ) from error
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also a number of thousands of digits
        raise ArtefactError(f"{kind} file {path} is not valid TOML ({error})") from error


def load_settings(
    kind: type[Settings], path: Path | str, default: Settings | None = None
) -> Settings:
    """Read settings of class ``kind`` from a ``.json`` or ``.toml`` file.

    Args:
        kind: The frozen dataclass.
        path: The file; keys left out keep the value of ``default``.
        default: Settings to start from; None stands for the defaults of ``kind``.

    Raises:
        FileNotFoundError: No such file.
        ValueError: Not JSON or TOML, an unknown key, or a value of the wrong type.
    """
    content = read_settings_file(path)
    try:
        return settings_from_dict(kind, content, default)
    except ValueError as error:
        raise ValueError(f"settings file {path}: {error}") from error


def dataclass_of(hint: Any) -> Any | None:
    """Return the dataclass of an annotation such as ``Part`` or ``Part | None``."""
    if isinstance(hint, type) and is_dataclass(hint):
        return hint
    if get_origin(hint) in (Union, UnionType):
        return next((arg for arg in get_args(hint) if is_dataclass(arg)), None)
    if hasattr(hint, "__metadata__"):
        return dataclass_of(get_args(hint)[0])
    return None


def laid_over(default: dict[str, Any], content: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``default`` with the values of ``content`` laid over it, table by table."""
    result = dict(default)
    for key, value in content.items():
        below = result.get(key)
        if isinstance(value, Mapping) and isinstance(below, dict):
            result[key] = laid_over(below, value)
        else:
            result[key] = value
    return result


@cache  # it keeps what it has made of each class, which takes longer than to use it
def _converter() -> cattrs.Converter:
    converter = cattrs.Converter(forbid_extra_keys=True)
    converter.register_unstructure_hook(Path, str)
    converter.register_structure_hook(Path, lambda value, _: Path(exactly(value, str)))
    # cattrs would turn 2.7 into the integer 2 and any text into True: only exact types may pass.
    converter.register_structure_hook(bool, lambda value, _: exactly(value, bool))
    converter.register_structure_hook(int, lambda value, _: exactly(value, int))
    converter.register_structure_hook(str, lambda value, _: exactly(value, str))
    converter.register_structure_hook(float, lambda value, _: float(exactly(value, (int, float))))
    configure_union_passthrough(bool | int | float | str | None, converter)
    return converter


def exactly(value: Any, kinds: type | tuple[type, ...]) -> Any:
    """Return a value of one of the types themselves; a bool is no int.

    Raises:
        ValueError: It is of another type.
    """
    allowed = kinds if isinstance(kinds, tuple) else (kinds,)
    if type(value) not in allowed:
        number = set(allowed) == {int, float}
        names = "a number" if number else " or ".join(kind.__name__ for kind in allowed)
        raise ValueError(f"expected {names}, got {value!r}")
    return value


def _reasons(error: BaseException, place: str) -> list[str]:
    """Return one line for each leaf of a cattrs error, with the place of the setting."""
    if not isinstance(error, cattrs.BaseValidationError):
        # A key error is of a field without a default, and says no more than the field's name.
        missing = isinstance(error, KeyError) and error.args == (place.rpartition(".")[2],)
        said = "" if missing else f": {error}"
        if isinstance(error, TypeError | AttributeError):
            said = ": it is of another type than expected"  # Python's words help nobody
        if not place:
            return [said.removeprefix(": ")]
        return [f"{place} is missing" if missing else f"{place}{said}"]
    reasons: list[str] = []
    for inner in error.exceptions:
        within = place
        for note in getattr(inner, "__notes__", []):
            if isinstance(note, cattrs.AttributeValidationNote | cattrs.IterableValidationNote):
                name = getattr(note, "name", getattr(note, "index", ""))
                entry = f"[{name}]" if isinstance(name, int) else f".{name}"
                within = f"{place}{entry}".removeprefix(".")
        reasons += _reasons(inner, within)
    return reasons


def differences(theirs: Any, ours: Any, name: str = "") -> list[tuple[str, Any, Any]]:
    """Where two nested settings differ: the name, with dots, and both values; None for a missing
    one.

    Args:
        theirs: Settings as JSON has them, or one of them.
        ours: The same.
        name: What they are called.
    """
    if isinstance(theirs, Mapping) and isinstance(ours, Mapping):
        return [
            each
            for key in sorted({*theirs, *ours})
            for each in differences(theirs.get(key), ours.get(key), f"{name}.{key}".lstrip("."))
        ]
    return [] if theirs == ours else [(name, theirs, ours)]
