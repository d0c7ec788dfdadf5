"""Robots of a virtual rig, each in a hidden world of its own, beside the band of a certificate."""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from other_leg import MESH_FILE

from pneumorph.base.run_folder import RunFolder, made_once
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_identity import reduction_digest
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.part_ingredients import ingredients
from pneumorph.gait.gait_file import read_gait, write_gait
from pneumorph.hardware.driver import DriverError
from pneumorph.hardware.virtual_rig import VirtualRigSettings, draw_reality
from pneumorph.physics.open_loop_gait import commands_of
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.regulator_lag import lagging_commands
from pneumorph.study.certified_pairs import Band
from pneumorph.study.deployed_gait import CHECKPOINT_FILE, deploy_gait
from pneumorph.study.deployment_settings import DeploymentSettings
from pneumorph.study.recorded_walk import Model

FIRST_SEED = 1000
"""Of the hidden worlds."""
RIG = Path(__file__).parent / "rig.toml"
"""Its guard knows valves as little as the worlds do."""


def hidden_rig(worlds: Randomisation, seed: int) -> VirtualRigSettings:
    """A rig whose robot lives in a world of these that nobody knows.

    The leg's modulus is what its pressures are off by, and its valves are the world's, so that
    neither is drawn besides; noise and the floor from trial to trial are the virtual rig's own.
    """
    return VirtualRigSettings(
        seed=seed,
        reality=replace(worlds, reductions=()),  # its leg is another one anyway
        pressure_slope_factor="1",
        pressure_intercept_kPa="-20.361",
        filling_factor="1",
        venting_factor="1",
    )


def rig_distance_cm(
    gait: Path,
    robot: RobotOptions,
    rig: VirtualRigSettings,
    folder: RunFolder,
    model: Model = "reduced",
) -> tuple[float | None, str]:
    """How far the rig's robot goes in one trial [cm], and an empty word; None and why where its
    simulation fails or its guard stops it.

    Raises:
        DriverError: A signal stopped it, which says nothing of the robot.
    """
    settings = DeploymentSettings(rig=RIG, trials=1, model=model, virtual=rig)
    try:
        found = deploy_gait(gait, settings, robot, folder).mean_distance_cm
    except DriverError as error:
        if "stopped by SIG" in str(error):
            raise
        return None, str(error)
    return found, "" if found is not None else "no trial came to its end"


@dataclass(frozen=True)
class Coverage:
    """How many hidden distances a band holds."""

    count: int
    share_within: float
    """From the 10th to the 90th percentile."""
    share_below: float
    """With those that failed."""
    share_above: float
    failed: int
    distances_cm: tuple[float | None, ...]
    """None of those that failed."""

    @classmethod
    def of(cls, band: Band, distances_cm: list[float | None]) -> Coverage:
        """That of distances beside a band."""
        failed = sum(each is None for each in distances_cm)
        far = np.array([-np.inf if each is None else each for each in distances_cm])
        below, above = float(np.mean(far < band.low)), float(np.mean(far > band.high))
        return cls(len(far), 1.0 - below - above, below, above, failed, tuple(distances_cm))


def covered(
    gait: Path,
    robot: RobotOptions,
    worlds: Randomisation,
    band: Band,
    count: int,
    work: Path,
    model: Model = "reduced",
    kept: Path | None = None,
) -> Coverage:
    """Run a gait once in each of so many hidden worlds; distances that are there are read.

    Args:
        gait: Its file, which names the design.
        robot: What is true behind the rig: a leg of another mesh and reduction.
        worlds: What hidden worlds are drawn from.
        band: What a certificate expects.
        count: Hidden worlds.
        work: Of the runs.
        model: Of the robots behind the rig.
        kept: Keeps a file for each; None for where the runs are.
    """

    spec = robot.spec()

    def walked(seed: int, rig: VirtualRigSettings) -> dict[str, Any]:
        folder = RunFolder(work / model / str(seed), "deploy")
        if not any(folder.path.rglob(CHECKPOINT_FILE)):  # of a call that was stopped, and goes on
            shutil.rmtree(folder.path, ignore_errors=True)
        # Where pressures follow at a rate the rig lags by itself.
        valves = spec.physics.air.law != "rate_limit"
        world = draw_reality(rig, spec.physics.pressure_map).world
        lag_s = world.regulator_lag_s if valves else 0.0
        lagging = lagging_gait(gait, lag_s, spec.physics.time_step_s, work / "lagging.csv")
        distance_cm, why = rig_distance_cm(lagging, robot, rig, folder, model)
        return {"distance_cm": distance_cm, "failed": why}

    far = []
    known = {"gait": _digest(gait), "rig": _digest(RIG), "part": _leg_digest(spec, model)}
    for seed in range(FIRST_SEED, FIRST_SEED + count):
        file, rig = (kept or work) / f"{model}_{seed}.json", hidden_rig(worlds, seed)
        made_of = {**known, "settings": settings_to_dict(rig)}
        far.append(made_once(file, partial(walked, seed, rig), **made_of)["distance_cm"])
        said = "failed" if far[-1] is None else f"{far[-1]:.2f} cm"
        print(f"hidden world {seed}: {said}", flush=True)
    return Coverage.of(band, far)


def lagging_gait(gait: Path, lag_s: float, time_step_s: float, file: Path) -> Path:
    """Write a gait as lagging regulators pass it on, for valves of a virtual rig have no lag.

    Args:
        gait: Its file.
        lag_s: Time constant of the regulators [s].
        time_step_s: Of the robot that walks [s].
        file: Where to write.
    """
    held, remarks = read_gait(gait)
    commands = commands_of(held, time_step_s, held.regulator_count)
    lagging = lagging_commands(commands, lag_s, time_step_s)
    renewed = np.append(0, np.flatnonzero((lagging[1:] != lagging[:-1]).any(axis=1)) + 1)
    start_s = time_step_s * renewed
    return write_gait(file, replace(held, start_s=start_s, held_kPa=lagging[renewed]), remarks)


def _leg_digest(spec: RobotSpec, model: Model) -> str:
    """Hash of what a hidden robot's leg is: as finite elements it knows of no reduction."""
    if model == "reduced":
        return reduction_digest(spec)
    leg = spec.module.full
    made_of = json.dumps([leg.mesh.digest(), ingredients(leg)], default=str)
    return hashlib.sha256(made_of.encode()).hexdigest()


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def of_other_leg(robot: RobotOptions, leg: Path) -> RobotOptions:
    """The robot with another mesh and reduction of its leg, as what is true behind a rig."""
    return replace(robot, part=leg, full=replace(robot.full, mesh=leg.with_name(MESH_FILE)))
