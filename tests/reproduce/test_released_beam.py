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


def test_frequency_and_decay_under_the_beams_own_weight(script: Any) -> None:
    """The first four swings on a coarser mesh, beside 1.3 s on that of the kept numbers.

    Meshes agree within 0.5 % in frequency there; elements of 30 mm are a degree coarser, for which
    2 % stand. The decay is read from half the extrema, between which the slow branch creeps by 1 %
    of the swing: a tenth of the damping ratio. A law without its fast branch has less than a fifth
    of it, and one whose modulus at the swing is the relaxed one is 10 % slower.
    """
    pytest.importorskip("netgen")
    kept = read_json(HERE / "beam.json", "JSON")["loads"][0]
    found = script.swing(script.Beam(mesh_mm=30.0, duration_s=0.56), 0.0)
    assert kept["weight_N"] == 0.0
    assert found["frequency_Hz"] == pytest.approx(kept["frequency_Hz"]["simulated"], rel=0.02)
    assert found["damping_ratio"] == pytest.approx(kept["damping_ratio"]["simulated"], rel=0.1)
