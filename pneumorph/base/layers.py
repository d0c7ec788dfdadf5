"""Settings laid over one another: what was set lower gives way to what was set higher, once.

The order is preset < run that a verb takes over from < settings file < flags. A layer holds only
what was set in it, so a flag counts whatever its value, a default never does.

A settings class may say which settings a choice brings with it (``implied``, a class method from
what a layer sets of the class, its own groups' implied settings among it, and from the settings
below to what that implies): they stand just below the layer that chose.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any, TypeVar

from pneumorph.base.checked import hints_of
from pneumorph.base.settings import (
    dataclass_of,
    laid_over,
    settings_from_dict,
    settings_to_dict,
    upgraded,
)
from pneumorph.base.shapes import refuse_other_shapes

Settings = TypeVar("Settings")
Path = tuple[str, ...]


def layered(base: Settings, layers: Sequence[Mapping[str, Any]]) -> Settings:
    """Return settings with layers laid over them.

    Args:
        base: Complete settings.
        layers: What was set, lowest first, as nested dictionaries.

    Raises:
        ValueError: A layer sets what no field has, or a value of the wrong type or range.
    """
    kind = type(base)
    content = settings_to_dict(base)
    for layer in layers:
        now = upgraded(kind, layer)
        _refuse_other_groups(kind, now)
        content = laid_over(content, _with_implied(kind, now, content))
    return settings_from_dict(kind, content)


def changed_flags(
    low: Settings, high: Settings, among: Mapping[str, Any] | None = None
) -> list[str]:
    """Return the flags of the settings in which two sets of options differ.

    Args:
        low: Options.
        high: Options of the same kind.
        among: Only flags of what these settings have, as nested dictionaries, such as those that a
            verb takes over; anything but a dictionary stands for the whole group. None for all.
    """
    return [
        flag
        for path, flag in _flags(type(low))
        if flag and _has(among, path) and _at(low, path) != _at(high, path)
    ]


def _refuse_other_groups(kind: Any, layer: Mapping[str, Any], before: str = "") -> None:
    """Refuse what is no table where a group of settings is expected, which choices are read from.

    Raises:
        ValueError: There is one; names its place.
    """
    hints = hints_of(kind)
    for name, value in layer.items():
        inner = dataclass_of(hints[name]) if name in hints else None
        if inner is None:
            continue
        if isinstance(value, Mapping):
            _refuse_other_groups(inner, value, f"{before}{name}.")
        else:
            refuse_other_shapes(hints[name], value, f"{before}{name}")


def _with_implied(kind: Any, layer: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
    """What a layer sets, over what its choices imply."""
    hints = hints_of(kind)
    result = dict(layer)
    for name, value in layer.items():
        inner = dataclass_of(hints[name]) if name in hints else None
        if inner is not None and isinstance(value, Mapping):
            result[name] = _with_implied(inner, value, below.get(name) or {})
    return laid_over(kind.implied(result, below), result) if hasattr(kind, "implied") else result


def given_flags(settings: Any, default: Any, arguments: Sequence[str]) -> dict[str, Any]:
    """Return what a command line set, as nested dictionaries.

    Args:
        settings: What was read from the command line.
        default: What it would have been without arguments.
        arguments: The arguments.
    """
    given = {argument.split("=", 1)[0].replace("_", "-") for argument in arguments}
    content, layer = settings_to_dict(settings), dict[str, Any]()
    for path, flag in _flags(type(settings)):
        # A positional argument has no flag to look for: it is given where it differs.
        if flag is None:
            is_given = _at(settings, path) != _at(default, path)
        else:
            is_given = flag in given or _switched_off(flag) in given
        if is_given:
            below = layer
            for name in path[:-1]:
                below = below.setdefault(name, {})
            value: Any = content
            for name in path:
                value = value[name]
            below[path[-1]] = value
    return layer


def layer_of_flag(kind: Any, flag: str, value: Any) -> dict[str, Any]:
    """Return what a single flag of a settings class sets, as nested dictionaries; empty where it
    has no such flag."""
    for path, name in _flags(kind):
        if name == flag:
            for each in reversed(path):
                value = {each: value}
            return dict(value)
    return {}


def flags_of(kind: Any) -> list[str]:
    """The flags of a settings class."""
    return [flag for _, flag in _flags(kind) if flag is not None]


def _flags(kind: Any, path: Path = (), prefix: str = "") -> Iterator[tuple[Path, str | None]]:
    """Every option of a settings class and its flag; None for positional arguments."""
    hints = hints_of(kind)
    for field in fields(kind):
        marks = getattr(hints[field.name], "__metadata__", ())
        if any(str(mark) == "Fixed" for mark in marks):
            continue  # no option of the command line
        shown = next((m.name for m in marks if isinstance(getattr(m, "name", None), str)), None)
        flag = f"{prefix}{field.name.replace('_', '-') if shown is None else shown}"
        inner = dataclass_of(hints[field.name])
        if inner is not None:
            yield from _flags(inner, (*path, field.name), f"{flag}." if shown != "" else prefix)
        elif any(str(mark) == "Positional" for mark in marks):
            yield (*path, field.name), None
        else:
            yield (*path, field.name), f"--{flag}"


def _switched_off(flag: str) -> str:
    """The flag of a switch that is on: ``--space.no-canonical`` of ``--space.canonical``."""
    group, dot, name = flag.removeprefix("--").rpartition(".")
    return f"--{group}{dot}no-{name}"


def _has(content: Any, path: Path) -> bool:
    """Whether nested dictionaries have a place; what is none has all places below it."""
    for name in path:
        if not isinstance(content, Mapping):
            break
        if name not in content:
            return False
        content = content[name]
    return True


def _at(settings: Any, path: Path) -> Any:
    for name in path:
        settings = getattr(settings, name)
    return settings
