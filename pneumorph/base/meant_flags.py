"""Flags that a misspelt one may have meant."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

_MOST = 3


def meant_flags(arguments: Sequence[str], known: Iterable[str]) -> dict[str, list[str]]:
    """What flags that are not known may have meant, by their whole names or by the last part alone:
    of ``--frction`` also ``--physics.friction``.

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
        by_last.setdefault(_last(flag), []).append(flag)
    found = {}
    for argument in arguments:
        asked = argument.split("=", 1)[0].replace("_", "-")
        if not asked.startswith("--") or asked in flags or _switched_on(asked) in flags:
            continue
        close = get_close_matches(asked, flags, n=_MOST, cutoff=0.8)
        for last in get_close_matches(_last(asked), by_last, n=_MOST, cutoff=0.8):
            close += [flag for flag in by_last[last] if flag not in close]
        if close:
            found[argument] = close[:_MOST]
    return found


def _last(flag: str) -> str:
    return flag.lstrip("-").rsplit(".", 1)[-1]


def _switched_on(flag: str) -> str:
    """The flag of a switch that is off: ``--space.canonical`` of ``--space.no-canonical``."""
    group, dot, name = flag.removeprefix("--").rpartition(".")
    return f"--{group}{dot}{name.removeprefix('no-')}"
