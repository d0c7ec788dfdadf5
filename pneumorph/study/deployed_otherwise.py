"""What to tell where a robot is simulated otherwise than it was deployed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pneumorph.base.layers import changed_flags, layered
from pneumorph.base.run_folder import SUMMARY
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.study.finished_run import FinishedRun


def deployed_otherwise(deployment: Path, robot: RobotOptions) -> list[str]:
    """That a deployment had another physics than the simulation beside it, or another robot, leg,
    part or mass, with the flags that simulate it as deployed. Numbers of the physics may be those
    of its virtual rig, with which the simulation is compared.

    Args:
        deployment: Folder of the deployment.
        robot: What is simulated.
    """
    if not (deployment / SUMMARY).is_file():
        return []
    deployed = FinishedRun.read(deployment).robot
    theirs, ours = deployed.physics_name, robot.physics_name
    differ = _differing_flags(deployed, robot)
    if theirs != ours:
        # A robot's file says its physics.
        flags = " ".join(differ if deployed.described else [f"--physics {theirs}", *differ])
        return [
            f"{deployment} was deployed in the {theirs} physics and is simulated in the {ours} "
            f"one; {flags} simulates it as deployed"
        ]
    if not differ:
        return []
    return [
        f"{deployment} was deployed with {' '.join(differ)} and is simulated otherwise; these "
        "flags simulate it as deployed"
    ]


def _differing_flags(deployed: RobotOptions, simulated: RobotOptions) -> list[str]:
    """Flags of a deployment's robot, leg, part and masses that the simulation has otherwise."""
    if (deployed.file_text, deployed.described is None) != (
        simulated.file_text,
        simulated.described is None,
    ):
        if deployed.described is None:
            return ["no --robot"]
        edited = " (as it was then)" if deployed.described == simulated.described else ""
        return [f"--robot {deployed.described}{edited}"]
    # What its physics and its leg bring with them needs no flag beside those.
    brought = RobotOptions.of(deployed.based_on)
    same = deployed.based_on == simulated.based_on
    differ = []
    if deployed.leg != (simulated.leg if same else brought.leg):
        differ.append("--leg")
    other = bool(differ) or not same
    beside = layered(brought, [{"leg": deployed.leg}]) if other else simulated
    if deployed.masses != simulated.masses:
        differ += changed_flags(beside, deployed, {"masses": None})
    if not _same_file(deployed.part, simulated.part):
        differ.append("--part")
    return [_with_value(flag, deployed) for flag in differ]


def _with_value(flag: str, deployed: RobotOptions) -> str:
    value: Any = deployed
    for name in flag.removeprefix("--").replace("-", "_").split("."):
        value = getattr(value, name)
    return f"no {flag}" if value is None else f"{flag} {value}"


def _same_file(one: Path | None, other: Path | None) -> bool:
    """Whether two files are the same, by their content where they lie apart."""
    if one == other or one is None or other is None:
        return one == other
    both = one.is_file() and other.is_file()
    return both and one.read_bytes() == other.read_bytes()
