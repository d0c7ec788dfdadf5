"""Commands that no robot may be given are refused before anything moves."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from pneumorph.physics.commands import HIGHEST_COMMAND_KPA
from pneumorph.simulation.rollout import rollout


class _Untouched:
    """A robot that must not walk."""

    def __getattr__(self, name: str) -> Any:
        raise AssertionError(f"{name} was asked for")


@pytest.mark.parametrize("command_kPa", [HIGHEST_COMMAND_KPA + 1.0, -1.0, np.nan, np.inf])
def test_a_rollout_refuses_commands_out_of_range(command_kPa: float) -> None:
    commands = np.zeros((4, 2))
    commands[2, 1] = command_kPa
    with pytest.raises(ValueError, match="2, 1"):
        rollout(cast(Any, _Untouched()), commands)
