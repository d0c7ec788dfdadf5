"""pneumorph designs pneumatic soft robots and teaches them to move.

Units inside the package are millimetre, kilogram, second, millinewton and kilopascal.

The names below are what most programs need; each is imported when it is first used. Importing the
package tells Gymnasium of ``pneumorph/Crawl-v0``.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from pneumorph.environment.registration import register_environments

__version__ = "0.1.0"

_HOMES = {
    "ActingDescription": "pneumorph.catalogue.acting_description",
    "Calibration": "pneumorph.physics.calibration",
    "CrawlingTask": "pneumorph.environment.crawling_task",
    "Design": "pneumorph.robot.design",
    "DesignRules": "pneumorph.catalogue.design_rules",
    "DesignSpace": "pneumorph.robot.design_space",
    "ExpertGait": "pneumorph.gait.expert_gait",
    "HeldGait": "pneumorph.gait.held_gait",
    "HubDescription": "pneumorph.catalogue.hub_description",
    "Mesh": "pneumorph.geometry.mesh",
    "ModuleDescription": "pneumorph.catalogue.module_description",
    "Physics": "pneumorph.physics.physics",
    "ReducedPart": "pneumorph.reduction.reduced_part",
    "RewardTerm": "pneumorph.environment.reward_term",
    "RobotDescription": "pneumorph.catalogue.robot_description",
    "RobotSpec": "pneumorph.catalogue.robot_spec",
    "SiteDescription": "pneumorph.catalogue.site_description",
    "TaskWrapper": "pneumorph.environment.training_environment",
    "TrainingEnvironment": "pneumorph.environment.training_environment",
    "Trajectory": "pneumorph.trajectory",
    "cooptimise": "pneumorph.study.training_options",
    "evaluate": "pneumorph.study.evaluation",
    "make_env": "pneumorph.environment.registration",
    "paper_robot": "pneumorph.catalogue.paper_robot",
    "reduce": "pneumorph.study.reduction",
    "rollout": "pneumorph.simulation.rollout",
    "train": "pneumorph.study.training_options",
}
"""Where each name is defined."""

__all__ = [
    "ActingDescription",
    "Calibration",
    "CrawlingTask",
    "Design",
    "DesignRules",
    "DesignSpace",
    "ExpertGait",
    "HeldGait",
    "HubDescription",
    "Mesh",
    "ModuleDescription",
    "Physics",
    "ReducedPart",
    "RewardTerm",
    "RobotDescription",
    "RobotSpec",
    "SiteDescription",
    "TaskWrapper",
    "TrainingEnvironment",
    "Trajectory",
    "cooptimise",
    "evaluate",
    "make_env",
    "paper_robot",
    "reduce",
    "rollout",
    "train",
]

if TYPE_CHECKING:
    from pneumorph.catalogue.acting_description import ActingDescription
    from pneumorph.catalogue.design_rules import DesignRules
    from pneumorph.catalogue.hub_description import HubDescription
    from pneumorph.catalogue.module_description import ModuleDescription
    from pneumorph.catalogue.paper_robot import paper_robot
    from pneumorph.catalogue.robot_description import RobotDescription
    from pneumorph.catalogue.robot_spec import RobotSpec
    from pneumorph.catalogue.site_description import SiteDescription
    from pneumorph.environment.crawling_task import CrawlingTask
    from pneumorph.environment.registration import make_env
    from pneumorph.environment.reward_term import RewardTerm
    from pneumorph.environment.training_environment import TaskWrapper, TrainingEnvironment
    from pneumorph.gait.expert_gait import ExpertGait
    from pneumorph.gait.held_gait import HeldGait
    from pneumorph.geometry.mesh import Mesh
    from pneumorph.physics.calibration import Calibration
    from pneumorph.physics.physics import Physics
    from pneumorph.reduction.reduced_part import ReducedPart
    from pneumorph.robot.design import Design
    from pneumorph.robot.design_space import DesignSpace
    from pneumorph.simulation.rollout import rollout
    from pneumorph.study.evaluation import evaluate
    from pneumorph.study.reduction import reduce
    from pneumorph.study.training_options import cooptimise, train
    from pneumorph.trajectory import Trajectory


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(["__version__", *_HOMES])


register_environments()
