"""The kept bends: what was assumed of sheet and bulk modulus hardly matters; the prediction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.artefact import read_json

HERE = Path(__file__).parent.parent.parent / "reproduce" / "measured_bend"
KEPT = read_json(HERE / "bend.json", "JSON")
PRESSURES = read_json(HERE / "real_leg.json", "JSON")["pressure_kPa"]


@pytest.mark.parametrize(
    ("case", "most_percent"), [("sheet twice as stiff", 1.0), ("bulk modulus doubled", 0.5)]
)
def test_what_nobody_measured_hardly_moves_the_bend(case: str, most_percent: float) -> None:
    usual = dict(zip(PRESSURES, KEPT["cases"]["measured"]["bend_deg"], strict=False))
    doubled = KEPT["cases"][case]
    for pressure, bend in zip(doubled["pressures_kPa"], doubled["bend_deg"], strict=True):
        assert abs(100.0 * (bend / usual[pressure] - 1.0)) < most_percent


def test_the_prediction_is_that_of_its_bends() -> None:
    """Made again from the kept bends; of the marks, 10 % on average and 18 % at worst, it misses
    both, as the page says."""
    real = np.array(read_json(HERE / "real_leg.json", "JSON")["bend_deg"])
    bends = np.array(KEPT["cases"]["measured"]["bend_deg"][: len(real)])
    errors = 100.0 * np.abs(bends / real - 1.0)
    told = KEPT["prediction"]
    assert (
        told["bend_mean_error_percent"]
        == pytest.approx(errors.mean())
        == pytest.approx(10.1, abs=0.05)
    )
    assert (
        told["bend_worst_error_percent"]
        == pytest.approx(errors.max())
        == pytest.approx(19.9, abs=0.05)
    )
    assert told["bend_slope"] == pytest.approx(np.polyfit(real, bends, 1)[0])


def test_finer_meshes_and_the_leg_that_ships_come_nearer() -> None:
    """Within 10 % on average and 18 % at worst; the slope of 0.88 is met by none."""
    finer = KEPT["finer meshes"]
    for found in (*finer.values(), KEPT["leg that ships"]):
        assert found["bend_mean_error_percent"] < 10.0
        assert found["bend_worst_error_percent"] < 18.0
        assert 0.79 < found["bend_slope"] < 0.88
