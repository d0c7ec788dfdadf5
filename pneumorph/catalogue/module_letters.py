"""What the letters of a robot's designs stand for, in words."""

from __future__ import annotations

from collections.abc import Sequence

from pneumorph.robot.design import Fitting


def module_letters(allowed: Sequence[tuple[str, ...]]) -> str:
    """What letters mean, such as ``no letter: long, b: short``, site by site where they differ;
    empty where no site has a choice.

    Args:
        allowed: Names of the modules that are allowed at each site, in the order of the letters.
    """
    sites_of: dict[tuple[str, ...], list[int]] = {}
    for site, names in enumerate(allowed):
        sites_of.setdefault(names, []).append(site)
    if all(len(names) < 2 for names in sites_of):
        return ""
    if len(sites_of) == 1:
        return _letters(*sites_of)
    return "; ".join(
        f"{_letters(names)} at site{'s' if len(sites) > 1 else ''} {', '.join(map(str, sites))}"
        for names, sites in sites_of.items()
    )


def _letters(names: tuple[str, ...]) -> str:
    return ", ".join(
        f"{Fitting(0, kind, (1,)).letter or 'no letter'}: {name}" for kind, name in enumerate(names)
    )
