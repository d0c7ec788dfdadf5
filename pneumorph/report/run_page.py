"""The report page of a run of any verb: what was asked, what came out, and how to repeat it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pneumorph.base.result import result_to_dict
from pneumorph.environment.goal import Goal
from pneumorph.exchange.conversion import ConvertedFile
from pneumorph.fabrication.fabricated_robot import FabricatedRobot
from pneumorph.report import page
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
from pneumorph.report.physics_words import physics_of
from pneumorph.report.reduction_sections import (
    comparison_sections,
    leg_sections,
    stage_sections,
)
from pneumorph.report.repeat_section import repeat_section
from pneumorph.report.replay.replay_data import ReplaySettings
from pneumorph.report.search_sections import search_sections
from pneumorph.report.sheet import Sheet
from pneumorph.report.style import FIGURE_FILES, FigureFormat
from pneumorph.report.training_sections import (
    evaluation_sections,
    learned_pair_sections,
    searched_pair_sections,
    sweep_sections,
    training_sections,
)
from pneumorph.report.walk_sections import walk_sections
from pneumorph.study.analysis import Analysis
from pneumorph.study.baseline import Baseline, BestPhase
from pneumorph.study.built_catalogue import Catalogue
from pneumorph.study.campaign import Campaign
from pneumorph.study.certified_pairs import Certificate
from pneumorph.study.comparison import Comparison
from pneumorph.study.deployed_gait import DeployedGait
from pneumorph.study.engine_benchmark import EngineSpeed
from pneumorph.study.evaluation import Evaluation
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.fitted_calibration import FittedCalibration
from pneumorph.study.full_benchmark import StepTimes
from pneumorph.study.made_mesh import MadeMesh
from pneumorph.study.reduction import Reduction
from pneumorph.study.search_findings import SearchFindings
from pneumorph.study.simulated_walk import SimulatedWalk
from pneumorph.study.training_run import TrainingResult
from pneumorph.study.transfer import Transfer

Sections = Callable[[Any, FinishedRun, Sheet], list[Section]]


@dataclass(frozen=True)
class VerbPage:
    """How a verb's run is shown.

    Attributes:
        title: Heading of the page.
        lead: A sentence under it.
        result: What the verb's study returns; None for one that is not known.
        sections: Each makes sections of that result, the run and a sheet.
    """

    title: str
    lead: str
    result: type[Any] | None = None
    sections: tuple[Sections, ...] = ()


_TRAINING = VerbPage(
    "A robot learned to crawl",
    "Design and gait learned together, beside the expert's.",
    TrainingResult,
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
        (mesh_sections,),
    ),
    "reduce": VerbPage(
        "A reduced part",
        "Modes and sampled elements, with their measured errors.",
        Reduction,
        (stage_sections, leg_sections),
    ),
    "catalogue": VerbPage(
        "A catalogue of modules",
        "Parametric legs, each reduced once.",
        Catalogue,
        (catalogue_sections,),
    ),
    "compare": VerbPage(
        "Reduced beside full",
        "Modes beside the finite elements they stand for.",
        Comparison,
        (comparison_sections, leg_sections),
    ),
    "simulate": VerbPage(
        "A robot walks", "One design under one gait.", SimulatedWalk, (leg_sections,)
    ),
    "baseline": VerbPage(
        "The expert's gait",
        "The expert's design under its gait at every phase.",
        Baseline,
        (sweep_sections, leg_sections),
    ),
    "coopt": _TRAINING,
    "demo": _TRAINING,
    "campaign": VerbPage(
        "Many trainings", "How seeds and settings compare.", Campaign, (campaign_sections,)
    ),
    "search": VerbPage(
        "Searched designs and gaits",
        "Without a policy, to judge the learned ones.",
        SearchFindings,
        (searched_pair_sections, search_sections),
    ),
    "analyse": VerbPage(
        "What learned robots do",
        "Steps, tilt, loads and friction of the best pairs; L1 is the training's first.",
        Analysis,
        (analysis_sections,),
    ),
    "certify": VerbPage(
        "How far it will walk, and how sure that is",
        "The best pairs of a training in worlds it never saw; L1 is the training's first.",
        Certificate,
        (certificate_sections, leg_sections),
    ),
    "evaluate": VerbPage(
        "Learned pairs, walked again",
        "The best pairs of a training, simulated anew; L1 is the training's first.",
        Evaluation,
        (evaluation_sections, leg_sections),
    ),
    "bench": VerbPage(
        "Speed of this machine",
        "How fast reduced robots are simulated.",
        EngineSpeed,
        (stage_sections, leg_sections),
    ),
    "bench full": VerbPage(
        "Speed of this machine", "How fast a robot of finite elements is simulated.", StepTimes
    ),
    "calibrate": VerbPage(
        "The simulation, fitted",
        "Parameters fitted to what was measured.",
        FittedCalibration,
        (calibration_sections,),
    ),
    "deploy": VerbPage(
        "Trials on a rig",
        "A gait driven through regulators, and what they sensed.",
        DeployedGait,
        (deployment_sections, leg_sections),
    ),
    "transfer": VerbPage(
        "From simulation to reality",
        "Trials beside the simulation.",
        Transfer,
        (transfer_sections, leg_sections),
    ),
    "fabricate": VerbPage(
        "A robot to build",
        "Moulds, hub, parts and tubes of a design.",
        FabricatedRobot,
        (fabrication_sections,),
    ),
    "exchange": VerbPage(
        "A file of another program",
        "What was read and what was written.",
        ConvertedFile,
        (conversion_sections,),
    ),
}
"""How the run of each verb is shown, or of a verb and its subject."""

_HEADLINE = {
    "median_cm": ("median distance of the best pair", "{:.1f} cm"),
    "tenth_percentile_cm": ("10th percentile", "{:.1f} cm"),
    "expert_median_cm": ("the expert's median", "{:.1f} cm"),
    "measure_next": ("measure next", "{}"),
    "best_distance_cm": ("distance of the best pair", "{:.1f} cm"),
    "baseline_best_distance_cm": ("expert's best phase", "{:.1f} cm"),
    "baseline_best_phase_deg": ("the expert's best phase", "{:.0f}°"),
    "distance_cm": ("distance", "{:.1f} cm"),
    "mean_distance_cm": ("measured distance", "{:.1f} cm"),
    "simulated_distance_cm": ("simulated distance", "{:.1f} cm"),
    "transfer_ratio": ("measured over simulated", "{:.2f}"),
    "best_design": ("best design", "{}"),
    "design": ("design", "{}"),
    "animations_mean_node_error_mm": ("mean node error", "{:.2f} mm"),
    "bend_error_percent": ("bend error", "{:.1f} %"),
    "time_ratio": ("times as fast as the full model", "{:.0f}"),
    "mode_count": ("modes", "{}"),
    "tetrahedron_count": ("tetrahedra", "{:,}"),
    "env_steps_per_s": ("robot steps per second", "{:,.0f}"),
    "slope": ("simulated kPa per real kPa", "{:.4f}"),
    "intercept_kPa": ("intercept", "{:.2f} kPa"),
    "silicone_g": ("silicone", "{:.0f} g"),
    "status": ("status", "{}"),
    "wall_s": ("time taken", "{:.0f} s"),
}
"""Numbers that a reader wants first: key of the summary -> its name and how it is written."""


_ACHIEVED = {
    "median": "of the best pair, median",
    "tenth_percentile": "of the best pair, 10th percentile",
    "expert_median": "of the expert, median",
    "best_achieved": "of the best pair",
    "baseline_best_achieved": "of the expert's best phase",
}
"""What they achieve of a goal, likewise: key without its unit -> its name after the goal's."""

_SHOWN_ELSEWHERE = (
    "bend", "calibration", "drawing", "node_error", "path_fit", "tolerances", "transfer_gaits",
    "transfer_rewards",
)  # fmt: skip
"""How the names of pictures end that other sections show."""


@dataclass(frozen=True)
class RunPage:
    """A run's page and the figures beside it."""

    page: str
    page_bytes: int
    figures: tuple[str, ...]
    run: str
    run_verb: str
    wall_s: float


def write_run_page(
    run: FinishedRun,
    path: Path,
    replay: ReplaySettings | None = None,
    figure_files: tuple[FigureFormat, ...] = FIGURE_FILES,
) -> RunPage:
    """Write the page of a run.

    Args:
        run: The run.
        path: The HTML file; files of its figures are written beside it.
        replay: How exact replays are.
        figure_files: What each figure is saved as.

    Raises:
        ArtefactError: Its summary is damaged, or of another version.
    """
    start = time.monotonic()
    sheet = Sheet(path.parent, replay, figure_files)
    usual = PAGES.get(run.verb, VerbPage(f"pneumorph {run.verb}", ""))
    shown = PAGES.get(f"{run.verb} {run.settings.get('subject')}", usual)
    found = None if shown.result is None else run.result(shown.result)
    goal = run.goal
    sections = [
        *walk_sections(run.folder, sheet, goal),
        *(section for make in shown.sections for section in make(found, run, sheet)),
        *_picture_sections(run),
        _results_section(found, run),
        repeat_section(run),
    ]
    physics = physics_of(found)
    title = shown.title
    if shown is _TRAINING and not goal.is_forward:
        title = f"A robot learned to {goal.label}"
    where = f"Run folder {run.folder}" + (f", {physics}." if physics else ".")
    headline = _headline(found, run, goal)
    page.write_page(path, title, f"{shown.lead} {where}", headline, sections, sheet.head)
    return RunPage(
        page=str(path),
        page_bytes=path.stat().st_size,
        figures=tuple(str(each) for each in sheet.files),
        run=str(run.folder),
        run_verb=run.verb,
        wall_s=time.monotonic() - start,
    )


def _headline(found: Any, run: FinishedRun, goal: Goal) -> str:
    known = {} if found is None else _plain(found, result_to_dict(found))
    if run.source is not None and run.source.verb in ("coopt", "demo"):
        expert = run.source.result(BestPhase)
        known.setdefault("baseline_best_distance_cm", expert.baseline_best_distance_cm)
        known.setdefault("baseline_best_phase_deg", expert.baseline_best_phase_deg)
        known.setdefault("baseline_best_achieved", expert.best_achieved_by_expert)
    if not goal.is_forward:
        return page.numbers(_headline_of(known, goal))
    return page.numbers(
        {
            name: pattern.format(known[key])
            for key, (name, pattern) in _HEADLINE.items()
            if known.get(key) is not None
        }
    )


def _headline_of(known: Mapping[str, Any], goal: Goal) -> dict[str, str]:
    """The same of a goal other than forward, each number in the goal's unit."""
    achieved = {
        f"{goal.label} {name}": goal.said(value)
        for key, name in _ACHIEVED.items()
        if (value := known.get(key, known.get(f"{key}_cm"))) is not None
    }
    others = {
        name: pattern.format(known[key])
        for key, (name, pattern) in _HEADLINE.items()
        if known.get(key) is not None and not pattern.endswith(" cm")
    }
    return achieved | others


def _plain(found: Any, content: Mapping[str, Any]) -> dict[str, str | int | float | None]:
    """Plain values of a summary; a walk that did not come to its end has no distance."""
    failed = getattr(found, "status", "completed") != "completed"
    return {
        name: value
        for name, value in content.items()
        if isinstance(value, str | int | float) and not isinstance(value, bool)
        if not (failed and name == "distance_cm")
    }


def _picture_sections(run: FinishedRun) -> list[Section]:
    """Return the figures that the verb itself saved and no other section shows."""
    pictures = [
        page.picture(path, path.stem.replace("_", " "))
        for path in sorted(run.folder.glob("*.png"))
        if not path.stem.endswith(_SHOWN_ELSEWHERE)
    ]
    return [Section("Figures", page.side_by_side(*pictures))] if pictures else []


def _results_section(found: Any, run: FinishedRun) -> Section:
    """Return every plain value of the summary, the verb's own and what stands beside them."""
    results = _plain(found, run.summary)
    plain = [(name.replace("_", " "), value) for name, value in results.items()]
    notes = "".join(page.paragraph(note, "note") for note in getattr(found, "notes", ()))
    return Section("Results", page.table(["what", "value"], plain) + notes)
