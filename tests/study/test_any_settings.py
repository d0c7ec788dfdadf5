"""Whatever settings hold, they are refused by a ValueError, or read back as they are written."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from helpers.corruption import few
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.base.checked import hints_of
from pneumorph.base.settings import dataclass_of, settings_from_dict, settings_to_dict
from pneumorph.study.training_options import TrainingOptions

_NUMBERS = st.one_of(
    st.integers(-10, 10),
    st.sampled_from([0.5, 1e9, -1e-9, 10**30, float("nan"), float("inf")]),
    st.floats(0.0, 1.0),
)
_VALUES = st.one_of(
    _NUMBERS, st.booleans(), st.none(), st.text(max_size=5), st.lists(_NUMBERS, max_size=3)
)


def _content(kind: Any, default: dict[str, Any]) -> st.SearchStrategy[dict[str, Any]]:
    """A few of a class's settings, each as usual, of any value, or some of its own settings."""
    hints = hints_of(kind)

    def value(name: str) -> st.SearchStrategy[Any]:
        inner, usual = dataclass_of(hints[name]), default[name]
        own = [_content(inner, usual)] if inner is not None and isinstance(usual, dict) else []
        return st.one_of(st.just(usual), *own, _VALUES)

    names = st.lists(st.sampled_from([each.name for each in fields(kind)]), max_size=3, unique=True)
    return names.flatmap(lambda chosen: st.fixed_dictionaries({n: value(n) for n in chosen}))


@few
@given(_content(TrainingOptions, settings_to_dict(TrainingOptions())))
def test_any_settings_are_refused_or_kept(content: dict[str, Any]) -> None:
    try:
        options = settings_from_dict(TrainingOptions, content)
    except ValueError:
        return
    written = settings_to_dict(options)
    assert settings_from_dict(TrainingOptions, written) == options
