"""What acts on the robots whose walks a leg is reduced from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.paper_leg import leg_kind
from pneumorph.physics.air import Air
from pneumorph.reduction.walk_snapshots import WalkPhysics
from pneumorph.study import reduction
from pneumorph.study.reduction_options import ReduceOptions, measured, reduce_as_asked


class _Asked(Exception):
    """Carries what snapshots were asked for with."""


def acting(options: ReduceOptions, folder: Path, monkeypatch) -> WalkPhysics:
    """What would have acted on the walks."""

    def asked(*arguments):
        raise _Asked(arguments[-1])

    monkeypatch.setattr(reduction, "collect_snapshots", asked)
    with pytest.raises(_Asked) as caught:
        reduce_as_asked(options, RunFolder(folder, "reduce"))
    found: WalkPhysics = caught.value.args[0]
    return found


def test_friction_and_regulators_of_walks_are_the_protocols(tmp_path, monkeypatch):
    """So that a leg is the same whatever floor and valves its robots have."""
    found = acting(measured(), tmp_path, monkeypatch).physics
    assert found.friction == measured().snapshots.static.friction
    own = leg_kind("measured").physics
    assert own.friction != found.friction
    assert replace(found, friction=own.friction) == replace(
        own, air=Air(), friction_by_surface=(), pressure_map=found.pressure_map
    )


def test_published_walks_are_those_that_earlier_snapshots_are_of(tmp_path, monkeypatch):
    assert acting(ReduceOptions(), tmp_path, monkeypatch).described() == {}
