"""Flags that a misspelt one may have meant."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

_MOST = 3


def meant_flags(arguments: Sequence[str], known: Iterable[str]) -> dict[str, list[str]]:
    """What flags that are not known may have meant by the last part of a longer name alone, such as
    ``--physics.friction`` of ``--frction``. Those that are close to a whole name are left to the
    reader of the command line, which tells of them itself.

    Args:
        arguments: As they were given.
        known: Flags that there are.

    Returns:
        The flags that are not known with the closest of those that are; without those that are
        close to none.
    """
    flags = list(known)
    by_last: dict[str, list[str]] = {}
    for flag in flags:
        if "." in flag:
            by_last.setdefault(_last(flag), []).append(flag)
    found = {}
    for argument in arguments:
        asked = _switched_on(argument.split("=", 1)[0].replace("_", "-"))
        if not asked.startswith("--") or asked in flags or _close(asked, flags):
            continue
        close = [flag for last in _close(_last(asked), by_last) for flag in by_last[last]]
        if close:
            found[argument] = close[:_MOST]
    return found


def _close(name: str, names: Iterable[str]) -> list[str]:
    return get_close_matches(name, names, n=_MOST, cutoff=0.8)


def _last(flag: str) -> str:
    return flag.lstrip("-").rsplit(".", 1)[-1]


def _switched_on(flag: str) -> str:
    """The flag of a switch: ``--space.canonical`` of ``--space.no-canonical``."""
    group, dot, name = flag.rpartition(".")
    return f"{group}{dot}{name.removeprefix('no-')}" if dot else flag.replace("--no-", "--", 1)
