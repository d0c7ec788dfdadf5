"""What the verbs' tests share: a small leg to reduce, one reduced, and a short training of it."""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.box_mesh import box_mesh
from helpers.short_training import SHORT_TRAINING
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.cli import run
from pneumorph.geometry.mesh import Mesh


@pytest.fixture(scope="session")
def mesh_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A leg of one's own to reduce: a hollow box with a sheet under it."""
    box = box_mesh((40.0, 12.0, 9.0), (6, 3, 3), hollow=True)
    leg = Mesh(
        box.nodes - np.array([20.0, 6.0, 0.0]),
        box.tetrahedra,
        {**box.surfaces, "sheet": box.surfaces["bottom"]},
        {"attachment": box.node_sets["left"], "outer_end_face": box.node_sets["right"]},
        contact_points=np.array([[20.0, -6.0, 0.0], [20.0, 6.0, 0.0]]),
    )
    return leg.save(tmp_path_factory.mktemp("mesh") / "mesh.npz")


@pytest.fixture(scope="session")
def short_run(leg: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished coopt run; tests take copies, see `learned`."""
    folder = tmp_path_factory.mktemp("coopt") / "run"
    rest = "--task.action-count 3 --checkpoint-interval-timesteps 12 --certified-world-count 0"
    assert run(f"coopt --part {leg} --out {folder} {SHORT_TRAINING} {rest}".split()) == 0
    return folder


@pytest.fixture(scope="module")
def learned(short_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished coopt run of the file's own: verbs write into it."""
    return shutil.copytree(short_run, tmp_path_factory.mktemp("learned") / "run")


@pytest.fixture(scope="session")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A reduced leg of 4 modes."""
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    return part.save(tmp_path_factory.mktemp("leg") / "leg.npz")


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Any]:
    """Return a function that gives what a command asks of its verb, which is not done."""

    def ask(command: str) -> Any:
        name, *arguments = shlex.split(command)
        module = import_module(f"pneumorph.command.{name}")
        caught: list[Any] = []
        with monkeypatch.context() as patch:
            verb = replace(module.VERB, run=lambda options, _: caught.append(options) or {})
            patch.setattr(module, "VERB", verb)
            folder = tmp_path / f"out{len(list(tmp_path.iterdir()))}"
            assert run([name, *arguments, "--out", str(folder)]) == 0
        return caught[0]

    return ask
