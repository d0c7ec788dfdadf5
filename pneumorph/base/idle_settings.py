"""Settings that change nothing beside others, refused where somebody set them.

A settings class says with a method ``idle_settings`` which of its settings change nothing beside
the others, and why. A default that does is no harm, and neither is what a preset, a robot's file or
an earlier run brings; what was asked for and would be ignored is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.layers import changed_flags, layered
from pneumorph.base.run_folder import SETTINGS, read_settings
from pneumorph.base.settings import settings_from_dict, upgraded


@runtime_checkable
class HasIdleSettings(Protocol):
    """Settings some of which may change nothing."""

    def idle_settings(self) -> dict[str, str]:
        """Those that change nothing beside the others, by their names, with dots for those of
        groups; with what a message adds after "expected it to be left out"."""
        ...


def within(group: str, settings: HasIdleSettings) -> dict[str, str]:
    """The idle settings of a group, by their names from outside of it."""
    return {f"{group}.{name}": why for name, why in settings.idle_settings().items()}


def only_with(**switches: str) -> Callable[[Any], dict[str, str]]:
    """The method ``idle_settings`` of a class some of whose settings need a switch.

    Args:
        **switches: Name of the switch, by that of the setting or the group that needs it.
    """

    def idle_settings(settings: Any) -> dict[str, str]:
        needed = {name: on for name, on in switches.items() if not getattr(settings, on)}
        return {name: f"without --{on}" for name, on in needed.items()}

    return idle_settings


def refuse_idle(
    settings: Any,
    base: Any,
    layers: Sequence[Mapping[str, Any]],
    folder: Path | None = None,
    file: Path | None = None,
) -> None:
    """Refuse what was set and changes nothing.

    A higher layer may silence a lower one, as a flag does some of a file: what changes nothing is
    refused only where it changed nothing in the layer that sets it either.

    Args:
        settings: What came of it: ``layered(base, layers)``.
        base: What nobody set here, such as a preset.
        layers: What was set, lowest first, as nested dictionaries.
        folder: Where the run will be. One that was begun there may keep what it was begun with.
        file: Where the lowest layer was read from; None where it is of no file.

    Raises:
        ValueError: Something was; names the flags, the file if it is of that, what is missing, and
            that it would be ignored.
    """
    idle = _idle(settings)
    if not idle:
        return
    kind = type(settings)
    layers = [upgraded(kind, layer) for layer in layers]
    refused = [
        {name: why for name, why in idle.items() if name in _idle_alone(base, layers[:end])}
        for end in range(1, len(layers) + 1)
    ]
    unset = layered(base, [_without(each, map(_parts, idle)) for each in layers])
    before = _begun_with(kind, folder)
    for level, layer in reversed(list(enumerate(layers))):
        for name, why in refused[level].items():
            place = _only(layer, _parts(name))
            flags = changed_flags(unset, settings, place)
            if before is not None:
                flags = [flag for flag in flags if flag in changed_flags(before, settings, place)]
            if flags:
                where = f"settings file {file}: " if file is not None and level == 0 else ""
                raise ValueError(
                    f"{where}{', '.join(flags)}: expected to be left out {why}: it would be ignored"
                )


def is_of_a_run(file: Path) -> bool:
    """Whether a settings file is named as those of runs, which hold every setting: nobody chose
    those one by one."""
    return file.name == SETTINGS


def _begun_with(kind: Any, folder: Path | None) -> Any | None:
    """Settings of what was begun in a folder; None where nothing was, or nothing of this kind."""
    with suppress(ArtefactError, ValueError, OSError):
        if folder is not None and (folder / SETTINGS).exists():
            return settings_from_dict(kind, read_settings(folder))
    return None


def _idle(settings: Any) -> dict[str, str]:
    return settings.idle_settings() if isinstance(settings, HasIdleSettings) else {}


def _idle_alone(base: Any, layers: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """What would be idle without the layers above; nothing where they are no settings alone."""
    with suppress(ValueError, OSError):
        return _idle(layered(base, layers))
    return {}


def _parts(name: str) -> list[str]:
    return name.split(".")


def _only(layer: Mapping[str, Any], path: Sequence[str]) -> dict[str, Any]:
    """What a layer sets at a place; empty where it sets nothing there."""
    first, *others = path
    if first not in layer:
        return {}
    inner = layer[first]
    if not others:
        return {first: inner}
    return {first: _only(inner, others)} if isinstance(inner, Mapping) else {}


def _without(layer: Mapping[str, Any], paths: Iterable[Sequence[str]]) -> dict[str, Any]:
    """A layer without some places."""
    content = dict(layer)
    for first, *others in paths:
        inner = content.get(first)
        if not others:
            content.pop(first, None)
        elif isinstance(inner, Mapping):
            content[first] = _without(inner, [others])
    return content
