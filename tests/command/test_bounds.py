"""Every number that a verb can be asked for says which values it takes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest

from pneumorph.base.checked import Checked
from pneumorph.base.settings import dataclass_of, settings_from_dict, settings_to_dict
from pneumorph.cli import VERBS


def settings_classes(kind: Any) -> Iterator[Any]:
    """A settings class and all that it is made of."""
    yield kind
    for hint in get_type_hints(kind, include_extras=True).values():
        inner = dataclass_of(hint)
        if inner is not None:
            yield from settings_classes(inner)


def holds(hint: Any, sought: type) -> bool:
    """Whether a type of number is somewhere in an annotation."""
    return hint is sought or any(holds(each, sought) for each in get_args(hint))


KINDS = {
    kind
    for verb in VERBS
    for kind in settings_classes(import_module(f"pneumorph.command.{verb}").VERB.options)
}


@pytest.mark.parametrize("kind", sorted(KINDS, key=lambda each: each.__name__))
def test_no_number_is_taken_unseen(kind: type) -> None:
    hints = get_type_hints(kind, include_extras=True)
    numbers = [n for n, hint in hints.items() if holds(hint, int) or holds(hint, float)]
    assert not numbers or issubclass(kind, Checked), f"{numbers} are not checked"


@pytest.mark.parametrize("kind", sorted(KINDS, key=lambda each: each.__name__))
def test_no_number_may_be_nan(kind: Any) -> None:
    usual = kind(**{name: NEEDED[name] for name in get_type_hints(kind) if name in NEEDED})
    for name, hint in get_type_hints(kind, include_extras=True).items():
        if dataclass_of(hint) is None and holds(hint, float):
            entries, nan = getattr(usual, name), math.nan
            if isinstance(entries, tuple):
                entry: Any = math.nan
                if holds(hint, str):  # by name
                    entry = ("sheet", *[math.nan] * (len(get_args(get_args(hint)[0])) - 1))
                nan = (entry,) * max(1, len(entries))
            with pytest.raises(ValueError, match=rf"{name}.* must be finite, got nan"):
                replace(usual, **{name: nan})


NEEDED = {
    "young_modulus_kPa": 1.0, "poisson_ratio": 0.2, "surface": "sheet", "motions": ("walk.npz",),
    "run": Path("run"),
}  # fmt: skip
"""Settings that have no usual value."""


def test_settings_are_saved_and_read_back_equal() -> None:
    for verb in VERBS:
        options = import_module(f"pneumorph.command.{verb}").VERB
        for make in options.presets.values():
            made = make()
            assert settings_from_dict(type(made), settings_to_dict(made)) == made
