"""Hidden worlds in which a robot fails are counted, and are no distance."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import pytest

from pneumorph.hardware.driver import DriverError
from pneumorph.study.certified_pairs import Band

HERE = Path(__file__).parent.parent.parent / "reproduce" / "robust"


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Any:
    names = ("hidden_worlds", "other_leg")
    for name in names:
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(str(HERE))
    yield importlib.import_module("hidden_worlds")
    for name in names:
        sys.modules.pop(name, None)


def test_a_failure_is_below_the_band(script: Any) -> None:
    band = Band(1.0, 2.0, 3.0, 2.0, 0.5, 0)
    found = script.Coverage.of(band, [0.5, None, 2.0, 3.5])
    assert (found.share_within, found.share_below, found.share_above) == (0.25, 0.5, 0.25)
    assert found.failed == 1
    assert found.distances_cm == (0.5, None, 2.0, 3.5)


def test_what_stops_a_trial_is_kept(
    script: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*_: Any) -> None:
        raise DriverError("pressure 2 lags by 30 kPa")

    monkeypatch.setattr(script, "deploy_gait", stopped)
    found = script.rig_distance_cm(Path("gait.csv"), None, None, None)
    assert found == (None, "pressure 2 lags by 30 kPa")
