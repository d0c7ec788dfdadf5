"""The released beam swings and decays as it did when its numbers were kept."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.artefact import read_json

HERE = Path(__file__).parent.parent.parent / "reproduce" / "released_beam"


@pytest.fixture(scope="module")
def script() -> Iterator[Any]:
    specification = importlib.util.spec_from_file_location("released_beam", HERE / "run.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules["released_beam"] = module  # where its dataclasses look for their annotations
    specification.loader.exec_module(module)
    yield module
    del sys.modules["released_beam"]


def test_the_kept_numbers_meet_their_marks_but_for_one_sag() -> None:
    """Sags within 5 %, frequencies 4 %, damping ratios 20 %, of one modulus for three loads: the
    sag under the heaviest load is 6.3 % off, as the page says."""
    loads = read_json(HERE / "beam.json", "JSON")["loads"]
    errors = {
        name: [abs(each[name]["error_percent"]) for each in loads]
        for name in ("mean_sag_mm", "frequency_Hz", "damping_ratio")
    }
    assert max(errors["frequency_Hz"]) < 4.0
    assert max(errors["damping_ratio"]) < 20.0
    assert max(errors["mean_sag_mm"][:2]) < 5.0
    assert 5.0 < errors["mean_sag_mm"][2] < 6.5


def test_frequency_and_decay_under_the_beams_own_weight(script: Any) -> None:
    """The first four swings on a coarse mesh, beside 1.3 s on that of the kept numbers.

    One element of 30 mm through the height, 135 nodes: it swings 5.1 % slower than the kept mesh of
    18 mm, which finer ones agree with to 0.5 %, and loses 2.7 % more. Other meshers' meshes of this
    size may differ by a percent of that. A rubber without its fast branch would have less than a
    fifth of the damping and swing 10 % slower again.
    """
    pytest.importorskip("netgen")
    kept = read_json(HERE / "beam.json", "JSON")["loads"][0]
    found = script.swing(script.Beam(mesh_mm=30.0, duration_s=0.56), 0.0)
    assert kept["weight_N"] == 0.0
    assert found["frequency_Hz"] == pytest.approx(
        0.949 * kept["frequency_Hz"]["simulated"], rel=0.02
    )
    assert found["damping_ratio"] == pytest.approx(kept["damping_ratio"]["simulated"], rel=0.1)
