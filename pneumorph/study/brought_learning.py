"""What robots bring to a learner or a search: designs, regulators, and lower pressures for legs
whose snapshots end below the usual ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pneumorph.base.settings import laid_over
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_settings import asked_regulators
from pneumorph.study.brought_gait import highest_pressure_kPa
from pneumorph.study.usual_aim import starts_to_a_side


def brought_learning(
    content: Mapping[str, Any], below: Mapping[str, Any], described: RobotDescription | None
) -> dict[str, Any]:
    """Settings ``space`` and ``task`` that a layer of settings brings: the designs and regulators
    that a robot's file says or that are asked for, no mirror images of robots that start turned to
    a side, and the pressures of legs that were reduced for lower ones.

    Args:
        content: What the layer sets, as nested dictionaries with a group ``robot``.
        below: All settings below it.
        described: The robot that the layer describes by a file, if it does.

    Raises:
        FileNotFoundError: There is no such reduced leg.
        ArtefactError: It is none.
    """
    brought = {"space": {}, "task": {}} if described is None else described.training_settings()
    if (count := asked_regulators(content, below)) is not None:
        counted = {"regulator_count": count}
        brought = laid_over(brought, {"space": counted, "task": counted})
    if starts_to_a_side(content, described):
        brought = laid_over(brought, {"space": {"mirror": "none"}})
    highest_kPa = highest_pressure_kPa(content, below, described)
    if highest_kPa is not None:
        brought = laid_over(brought, {"task": {"maximum_pressure_kPa": highest_kPa}})
    return brought
