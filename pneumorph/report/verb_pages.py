"""How the run of each verb is shown on its page: title, headline numbers, sections."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.exchange.conversion import ConvertedFile
from pneumorph.fabrication.fabricated_robot import FabricatedRobot
from pneumorph.report.certificate_sections import (
    certificate_sections,
    trained_certificate_sections,
)
from pneumorph.report.experiment_sections import analysis_sections, campaign_sections
from pneumorph.report.hardware_sections import (
    calibration_sections,
    deployment_sections,
    transfer_sections,
)
from pneumorph.report.making_sections import (
    catalogue_sections,
    conversion_sections,
    fabrication_sections,
    mesh_sections,
)
from pneumorph.report.page import Section
from pneumorph.report.physics_words import MEAN_OVER_WORLDS
from pneumorph.report.reduction_sections import (
    comparison_sections,
    leg_sections,
    stage_sections,
)
from pneumorph.report.search_sections import search_sections
from pneumorph.report.sheet import Sheet
from pneumorph.report.training_sections import (
    evaluation_sections,
    learned_pair_sections,
    searched_pair_sections,
    sweep_sections,
    training_sections,
)
from pneumorph.study.analysis import Analysis
from pneumorph.study.baseline import Baseline
from pneumorph.study.built_catalogue import Catalogue
from pneumorph.study.campaign import Campaign
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.comparison import Comparison
from pneumorph.study.deployment_result import DeployedGait
from pneumorph.study.engine_benchmark import EngineSpeed
from pneumorph.study.evaluation import Evaluation
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.fitted_calibration import FittedCalibration
from pneumorph.study.full_benchmark import StepTimes
from pneumorph.study.made_mesh import MadeMesh
from pneumorph.study.reduction import Reduction
from pneumorph.study.search_findings import SearchFindings
from pneumorph.study.simulated_walk import SimulatedWalk
from pneumorph.study.training_result import TrainingResult
from pneumorph.study.transfer import Transfer

Sections = Callable[[Any, FinishedRun, Sheet], list[Section]]


@dataclass(frozen=True)
class HeadlineNumber:
    """A value that a reader wants first.

    Attributes:
        attribute: Its name in the verb's result; of a part of it ``part.name``.
        label: What it is called.
        pattern: How it is written, as of `str.format`.
        achieved: The attribute that tells the same of a goal other than forward, in its unit.
        of_goal: What follows the goal's label there; empty for what is no travel, and is shown
            alike whatever the goal.
        walker: Whose walk it is of, and so how long that was; empty for what is no travel.
        of_expert: Whether it is the expert's, to compare with.
    """

    attribute: str
    label: str
    pattern: str = "{}"
    achieved: str = ""
    of_goal: str = ""
    walker: Literal["", "pair", "expert"] = ""
    of_expert: bool = False

    def behind(self, words: str) -> HeadlineNumber:
        """The same number with words behind what it is called."""
        return replace(self, label=f"{self.label}, {words}", of_goal=f"{self.of_goal}, {words}")

    def said(self, found: Any, goal: Goal = FORWARD) -> tuple[str, str] | None:
        """Label and value as they are shown; None where the result has none."""
        if self.achieved and not goal.is_forward:
            value = _value(found, self.achieved)
            return None if value is None else (f"{goal.label} {self.of_goal}", goal.said(value))
        value = _value(found, self.attribute)
        return None if value is None else (self.label, self.pattern.format(value))


@dataclass(frozen=True)
class _OfBestRun(HeadlineNumber):
    """What the best run of a campaign achieved of its own goal: a campaign has none."""

    def said(self, found: Campaign, goal: Goal = FORWARD) -> tuple[str, str] | None:
        """As of any number; in the unit of the best run's goal, and as a mean where it is one."""
        best = next((each for each in found.runs if each.name == found.best_run), None)
        number = self.behind(MEAN_OVER_WORLDS) if best and best.in_drawn_worlds else self
        if best is None or best.goal.is_forward:
            return HeadlineNumber.said(number, found)
        value = _value(best, "best_achieved")
        of_goal = f"{best.goal.label} {number.of_goal}"
        return None if value is None else (of_goal, best.goal.said(value))


def _value(found: Any, attribute: str) -> Any:
    """A result's value; None for one that is not known."""
    for name in attribute.split("."):
        found = None if found is None else getattr(found, name)
    return None if isinstance(found, float) and not math.isfinite(found) else found


@dataclass(frozen=True)
class VerbPage:
    """How a verb's run is shown.

    Attributes:
        title: Heading of the page.
        lead: A sentence under it.
        result: What the verb's study returns; None for one that is not known.
        headline: Values of that result that stand first.
        sections: Each makes sections of that result, the run and a sheet.
    """

    title: str
    lead: str
    result: type[Any] | None = None
    headline: tuple[HeadlineNumber, ...] = ()
    sections: tuple[Sections, ...] = ()


def _certified(certificate: str) -> tuple[HeadlineNumber, ...]:
    """Of the best pair in unseen worlds, where the expert walks as long as it; ``certificate``
    leads from the result to them."""
    told = (
        ("median", "median distance of the best pair", "of the best pair, median"),
        ("tenth_percentile", "10th percentile", "of the best pair, 10th percentile"),
        ("expert_median", "the expert's median", "of the expert, median"),
    )
    return tuple(
        HeadlineNumber(
            f"{certificate}{name}",
            label,
            "{:.1f} cm",
            f"{certificate}{name}",
            of_goal,
            "pair",
            name.startswith("expert"),
        )
        for name, label, of_goal in told
    )


def experts_numbers(where: str = "in the world as it stands") -> tuple[HeadlineNumber, ...]:
    """Of the expert's sweep, which stands beside what is made of a training.

    Args:
        where: It walked.
    """
    return (
        HeadlineNumber(
            "baseline_best_distance_cm",
            f"the expert's best phase {where}",
            "{:.1f} cm",
            "best_achieved_by_expert",
            f"of the expert's best phase {where}",
            "expert",
            True,
        ),
        HeadlineNumber(
            "baseline_best_phase_deg", "the expert's best phase there", "{:.0f}°", of_expert=True
        ),
    )


EXPERT = experts_numbers()
"""The same in the world that its own robots, and those beside it, walk in."""
_BEST_DISTANCE = HeadlineNumber(
    "best_distance_cm",
    "distance of the best pair",
    "{:.1f} cm",
    "best_achieved",
    "of the best pair",
    "pair",
)
TRAINED_DISTANCE = replace(
    _BEST_DISTANCE,
    label="distance of the best pair in training",
    of_goal="of the best pair in training",
)
"""In the worlds of a training: where designs walk in several each, the mean over them."""
_BEST_DESIGN = HeadlineNumber("best_design", "best design")
_MEASURED = HeadlineNumber("mean_distance_cm", "measured distance", "{:.1f} cm")
_BEND_ERROR = HeadlineNumber("bend_error_percent", "bend error", "{:.1f} %")
_DESIGN = HeadlineNumber("design", "design")
_STATUS = HeadlineNumber("status", "status")
_TIME = HeadlineNumber("wall_s", "time taken", "{:.0f} s")

TRAINING = VerbPage(
    "A robot learned to crawl",
    "Design and gait learned together, beside the expert's.",
    TrainingResult,
    (
        HeadlineNumber("certificate.best_design", "best design in unseen worlds"),
        *_certified("certificate."),
        TRAINED_DISTANCE,
        HeadlineNumber(
            "nominal_distance_cm",
            "the same in the world as it stands",
            "{:.1f} cm",
            "nominal_achieved",
            "of the best pair in the world as it stands",
            "pair",
        ),
        *EXPERT,
        replace(_BEST_DESIGN, label="best design in training"),
        _TIME,
    ),
    (
        trained_certificate_sections,
        sweep_sections,
        training_sections,
        learned_pair_sections,
        leg_sections,
    ),
)
PAGES = {
    "mesh": VerbPage(
        "A mesh with named regions",
        "Nodes, tetrahedra and regions, checked.",
        MadeMesh,
        (HeadlineNumber("tetrahedron_count", "tetrahedra", "{:,}"), _TIME),
        (mesh_sections,),
    ),
    "reduce": VerbPage(
        "A reduced part",
        "Modes and sampled elements, with their measured errors.",
        Reduction,
        (_BEND_ERROR, HeadlineNumber("mode_count", "modes"), _TIME),
        (stage_sections, leg_sections),
    ),
    "catalogue": VerbPage(
        "A catalogue of modules",
        "Parametric legs, each reduced once.",
        Catalogue,
        (HeadlineNumber("built_count", "built now"), _STATUS, _TIME),
        (catalogue_sections,),
    ),
    "compare": VerbPage(
        "Reduced beside full",
        "Modes beside the finite elements they stand for.",
        Comparison,
        (
            HeadlineNumber("animations_mean_node_error_mm", "mean node error", "{:.2f} mm"),
            _BEND_ERROR,
            HeadlineNumber("time_ratio", "times as fast as the full model", "{:.0f}"),
            _TIME,
        ),
        (comparison_sections, leg_sections),
    ),
    "simulate": VerbPage(
        "A robot walks",
        "One design under one gait.",
        SimulatedWalk,
        (
            HeadlineNumber("distance_cm", "distance", "{:.1f} cm", "achieved", "of the robot"),
            _DESIGN,
            _STATUS,
            _TIME,
        ),
        (leg_sections,),
    ),
    "baseline": VerbPage(
        "The expert's gait",
        "The expert's design under its gait at every phase.",
        Baseline,
        (*EXPERT, _TIME),
        (sweep_sections, leg_sections),
    ),
    "coopt": TRAINING,
    "demo": TRAINING,
    "campaign": VerbPage(
        "Many trainings",
        "How seeds and settings compare.",
        Campaign,
        (_OfBestRun(**{**vars(_BEST_DISTANCE), "achieved": ""}), _BEST_DESIGN, _STATUS, _TIME),
        (campaign_sections,),
    ),
    "search": VerbPage(
        "Searched designs and gaits",
        "Without a policy, to judge the learned ones.",
        SearchFindings,
        (_BEST_DISTANCE, _BEST_DESIGN, _TIME),
        (searched_pair_sections, search_sections),
    ),
    "analyse": VerbPage(
        "What learned robots do",
        "Steps, tilt, loads and friction of the best pairs; L1 is the training's first.",
        Analysis,
        (_BEST_DISTANCE, _BEST_DESIGN, _TIME),
        (analysis_sections,),
    ),
    "certify": VerbPage(
        "How far it will walk, and how sure that is",
        "The best pairs of a training in worlds it never saw; L1 is the training's first.",
        Certificate,
        (*_certified(""), HeadlineNumber("measure_next", "measure next"), _BEST_DESIGN, _TIME),
        (certificate_sections, leg_sections),
    ),
    "evaluate": VerbPage(
        "Learned pairs, walked again",
        "The best pairs of a training, simulated anew; L1 is the training's first.",
        Evaluation,
        (_BEST_DISTANCE, _BEST_DESIGN, _TIME),
        (evaluation_sections, leg_sections),
    ),
    "bench": VerbPage(
        "Speed of this machine",
        "How fast reduced robots are simulated.",
        EngineSpeed,
        (HeadlineNumber("env_steps_per_s", "robot steps per second", "{:,.0f}"), _TIME),
        (stage_sections, leg_sections),
    ),
    "bench full": VerbPage(
        "Speed of this machine",
        "How fast a robot of finite elements is simulated.",
        StepTimes,
        (HeadlineNumber("seconds_per_step", "seconds per step", "{:.3f}"), _DESIGN),
    ),
    "calibrate": VerbPage(
        "The simulation, fitted",
        "Parameters fitted to what was measured.",
        FittedCalibration,
        (
            HeadlineNumber("slope", "simulated kPa per real kPa", "{:.4f}"),
            HeadlineNumber("intercept_kPa", "intercept", "{:.2f} kPa"),
            _TIME,
        ),
        (calibration_sections,),
    ),
    "deploy": VerbPage(
        "Trials on a rig",
        "A gait driven through regulators, and what they sensed.",
        DeployedGait,
        (replace(_MEASURED, achieved="mean_achieved", of_goal="on the rig"), _DESIGN, _TIME),
        (deployment_sections, leg_sections),
    ),
    "transfer": VerbPage(
        "From simulation to reality",
        "Trials beside the simulation.",
        Transfer,
        (
            replace(_MEASURED, achieved="mean_achieved", of_goal="measured"),
            HeadlineNumber(
                "simulated_distance_cm",
                "simulated distance",
                "{:.1f} cm",
                "simulated_achieved",
                "simulated",
            ),
            HeadlineNumber("transfer_ratio", "measured over simulated", "{:.2f}"),
            _TIME,
        ),
        (transfer_sections, leg_sections),
    ),
    "fabricate": VerbPage(
        "A robot to build",
        "Moulds, hub, parts and tubes of a design.",
        FabricatedRobot,
        (_DESIGN, HeadlineNumber("silicone_g", "silicone", "{:.0f} g"), _TIME),
        (fabrication_sections,),
    ),
    "exchange": VerbPage(
        "A file of another program",
        "What was read and what was written.",
        ConvertedFile,
        (_TIME,),
        (conversion_sections,),
    ),
}
"""How the run of each verb is shown, or of a verb and its subject."""
