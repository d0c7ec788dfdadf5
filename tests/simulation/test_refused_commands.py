"""Commands that no robot may be given are refused before anything moves."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from pneumorph.physics.air import Air
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA
from pneumorph.physics.physics import Physics
from pneumorph.simulation.rollout import rollout
from pneumorph.trajectory import check_record_every


class _Untouched:
    """A robot that must not walk."""

    def rollout(self, *_: Any) -> None:
        raise AssertionError("it walked")

    def __getattr__(self, name: str) -> Any:
        raise AssertionError(f"{name} was asked for")


@pytest.mark.parametrize("command_kPa", [HIGHEST_COMMAND_KPA + 1.0, -1.0, np.nan, np.inf])
def test_a_rollout_refuses_commands_out_of_range(command_kPa: float) -> None:
    commands = np.zeros((4, 2))
    commands[2, 1] = command_kPa
    with pytest.raises(ValueError, match="2, 1"):
        rollout(cast(Any, _Untouched()), commands)


def test_a_rollout_refuses_commands_above_the_supply() -> None:
    class Supplied(_Untouched):
        physics = Physics(air=Air(law="orifice", supply_kPa=50.0))

    with pytest.raises(ValueError, match="60 kPa from a supply of 50 kPa"):
        rollout(cast(Any, Supplied()), np.full((4, 3), 60.0))


@pytest.mark.parametrize("record_every", [0, -3])
def test_no_number_of_steps_between_frames_is_refused(record_every: int) -> None:
    with pytest.raises(ValueError, match=f"record_every is {record_every}, expected .* at least 1"):
        check_record_every(record_every)


def test_gravity_in_other_units_is_refused() -> None:
    with pytest.raises(ValueError, match=r"gravity_mm_per_s2 is 9\.8, expected .* in m/s\^2"):
        Physics(gravity_mm_per_s2=9.8)
    assert Physics(gravity_mm_per_s2=0.0).gravity_vector[2] == 0.0
