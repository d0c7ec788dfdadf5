"""The folder of a finished run, read: what later verbs and studies take from it.

Every value is asked for by its place and type, so that a damaged folder, or one of another kind of
run, is refused by the name of the file and the field, and what was expected there.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.provenance import Provenance
from pneumorph.base.result import result_from_dict
from pneumorph.base.run_folder import SETTINGS, SUMMARY, read_settings, read_summary
from pneumorph.base.settings import settings_from_dict
from pneumorph.base.value_at import value_at
from pneumorph.base.verbs import VERBS
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import CooptSettings
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.changed_files import ChangedFile, changed_calibration, changed_parts
from pneumorph.study.found_files import with_found_files

Kind = TypeVar("Kind")
Result = TypeVar("Result")
Settings = TypeVar("Settings")


@dataclass(frozen=True, eq=False)
class Pair:
    """A design and its gait, as a run found them.

    Attributes:
        design: The design.
        gait_file: Where its gait lies, from the run's folder.
        gait: The gait.
        distance_cm: How far it went in the run [cm]; None where no robot survived it.
        achieved: What of the run's goal it achieved [its unit]; None likewise.
    """

    design: Design
    gait_file: str
    gait: HeldGait
    distance_cm: float | None
    achieved: float | None


@dataclass(frozen=True)
class TakenOver:
    """Settings of an earlier run that a later verb starts from.

    Attributes:
        run: Folder of the earlier run.
        settings: Some of the later verb's settings, as nested dictionaries.
        said: What they are, for a person.
    """

    run: Path
    settings: Mapping[str, Any]
    said: str


@dataclass(frozen=True, eq=False)
class FinishedRun:
    """A finished run of any verb.

    Attributes:
        folder: The run folder.
        summary: What the run said of itself.
        settings: What it was asked for.
    """

    folder: Path
    summary: Mapping[str, Any]
    settings: Mapping[str, Any]

    @classmethod
    def read(cls, folder: Path) -> FinishedRun:
        """Read the summary and the settings of a run.

        Raises:
            ArtefactError: The folder holds no finished run, or its files are damaged.
        """
        run = cls(folder, read_summary(folder), read_settings(folder))
        if "verb" in run.summary and run.verb not in VERBS:
            raise ArtefactError(
                f"{folder / SUMMARY}: verb: {run.verb!r:.60}, expected one of {', '.join(VERBS)}"
            )
        return run

    @property
    def verb(self) -> str:
        """Which verb made it."""
        return self.of_summary("verb", str)

    @property
    def made_by(self) -> Provenance | None:
        """Which source, command and machine made it; None of an earlier version."""
        if "made_by" not in self.summary:
            return None
        return self._result(Provenance, self.of_summary("made_by", dict))

    @property
    def calibration(self) -> UsedCalibration | None:
        """Which pressures and what else was measured that its robots have; None where nothing is
        said of it.

        Raises:
            ArtefactError: The summary is damaged.
        """
        # A run of calibrate names the file that it wrote there.
        if self.summary.get("calibration") is None or self.verb == "calibrate":
            return None
        return self._result(UsedCalibration, self.of_summary("calibration", dict))

    def of_summary(self, place: str, kind: type[Kind]) -> Kind:
        """A value of the summary by its place, such as ``pairs.0.design``.

        Raises:
            ArtefactError: There is none, or one of another type.
        """
        return self._value(SUMMARY, self.summary, place, kind)

    def of_settings(self, place: str, kind: type[Kind]) -> Kind:
        """A value of the settings by its place, files found; raises as `of_summary`."""
        return self._value(SETTINGS, self._found_settings, place, kind)

    @cached_property
    def _found_settings(self) -> dict[str, Any]:
        return with_found_files(self.settings, self.folder)

    def _value(self, file: str, content: Any, place: str, kind: type[Kind]) -> Kind:
        verb = self.summary.get("verb")
        made_by = f"`pneumorph {verb}`" if verb else "no verb made it: a folder inside a run?"
        return value_at(content, place, kind, self.folder / file, made_by)

    def structured(self, place: str, kind: type[Settings]) -> Settings:
        """A group of the settings as its class; raises as `of_summary`."""
        content = self.of_settings(place, dict)
        try:
            return settings_from_dict(kind, content)
        except ValueError as error:
            raise ArtefactError(f"{place} of {self.folder / SETTINGS}: {error}") from error

    @cached_property
    def robot(self) -> RobotOptions:
        """Its leg and physics."""
        return self.structured("robot", RobotOptions)

    def spec(self) -> RobotSpec:
        """Its robot, specified.

        Raises:
            ArtefactError: Its settings name a file that is gone, or do not go together.
        """
        try:
            return self.robot.spec()
        except (ValueError, OSError) as error:
            file = self.folder / SETTINGS
            if isinstance(error, ArtefactError) and str(error).startswith(f"{file} "):
                raise
            raise ArtefactError(f"robot of {file}: {error}") from error

    @cached_property
    def task(self) -> CrawlingTask:
        """What its robots were asked to do."""
        return self.structured(f"{self._learner}task", CrawlingTask)

    @cached_property
    def goal(self) -> Goal:
        """What counts of its robots' walks; of a run that looks at another, what counts there, and
        the distance where nothing is asked of them.

        Raises:
            ArtefactError: One of the two runs is damaged.
        """
        if "coopt" in self.settings or "search" in self.settings or "task" in self.settings:
            return self.task.goal
        if self.source is not None:
            return self.source.goal
        # A deployment says it, of whatever its gait came from.
        own = self.summary.get("goal")
        return FORWARD if own is None else self._result(Goal, self.of_summary("goal", dict))

    @cached_property
    def space(self) -> DesignSpace:
        """Designs it chose from."""
        return self.structured(f"{self._learner}space", DesignSpace)

    def result(self, kind: type[Result]) -> Result:
        """What the run found, as its study returned it.

        Raises:
            ArtefactError: The summary is damaged, or of another study.
        """
        return self._result(kind, self.summary)

    def _result(self, kind: type[Result], content: Mapping[str, Any]) -> Result:
        try:
            return result_from_dict(kind, content)
        except ArtefactError as error:
            raise ArtefactError(f"{self.folder / SUMMARY}: {error}") from error

    @property
    def source(self) -> FinishedRun | None:
        """The run that this one looks at; None where there is none or it is gone.

        Raises:
            ArtefactError: One of the two summaries is damaged.
        """
        if self.summary.get("run") is None:
            return None
        folder = Path(self.of_summary("run", str))
        return FinishedRun.read(folder) if (folder / SUMMARY).exists() else None

    @property
    def chosen_design(self) -> str:
        """Its best design, or the one that walked in it.

        Raises:
            ArtefactError: It has neither.
        """
        one = "design" in self.summary and "best_design" not in self.summary
        return self.of_summary("design" if one else "best_design", str)

    @property
    def own_task(self) -> str | None:
        """What the task of its training was called, where it was none of the package's."""
        return None if self.summary.get("own_task") is None else self.of_summary("own_task", str)

    @cached_property
    def has_drawn_worlds(self) -> bool:
        """Whether its robots walked in worlds drawn at random.

        Raises:
            ArtefactError: The objective of a search is damaged.
        """
        searched = self.settings.get("search")
        if isinstance(searched, Mapping) and "objective" in searched:
            return self.structured("search.objective", Objective).is_robust
        return bool(self.settings.get("randomize"))

    @property
    def _tells_worlds(self) -> bool:
        """Whether it says what its worlds were drawn from: not every search beside a training
        does."""
        return self.has_drawn_worlds and not (
            "search" in self.settings and "randomisation" not in self.settings
        )

    @property
    def _learner(self) -> str:
        """Where task and space are in the settings; a search of an earlier version has them at the
        top."""
        if "search" in self.settings:
            return "search."
        return "" if "coopt" not in self.settings and "task" in self.settings else "coopt."

    @cached_property
    def worlds(self) -> Randomisation | None:
        """What its worlds were drawn from, as tests of its robot left them; None where it walked in
        one, or does not say."""
        if not self._tells_worlds:
            return None
        drawn = self.structured("randomisation", Randomisation)
        return self.spec().agreeing_worlds(drawn)

    def taken_over(self, *groups: str) -> dict[str, Any]:
        """Groups of its settings for a later verb, such as ``robot``: its leg and physics, but not
        where they were computed.

        ``randomisation``, the worlds it was trained or searched in, is there only where it was.
        """
        found = {
            name: self.of_settings(name, dict)
            for name in groups
            if name != "randomisation" or self._tells_worlds
        }
        if "robot" in found:
            found["robot"] = {k: v for k, v in found["robot"].items() if k != "executor"}
        return found

    def refuse_other_robot(self, robot: RobotOptions, afresh: bool) -> None:
        """Refuse the robot of a file for which this run's designs and gaits are not.

        Args:
            robot: What is asked for; without a file nothing is refused.
            afresh: Whether nothing of the run's robot is taken over.

        Raises:
            ValueError: It has other numbers of sites or regulators, or the run's leg would be taken
                over beside a file that says its own.
        """
        asked = robot.description
        if asked is None:
            return
        file = self.robot.described
        whose = "the paper's robot" if file is None else f"the robot {file}"
        back = "leave out --robot for the run's own robot"
        if self.robot.part is not None and not afresh:
            raise ValueError(
                f"--robot {robot.described} is given, and {self.folder} is of {whose} with the leg "
                f"{self.robot.part}, expected one of them: a robot's file says its own legs; {back}"
                ", or give --afresh to take only designs and gaits from the run"
            )
        if robot.described == file:
            return  # the run may have changed what its file says
        sites, regulators = len(asked.allowed_modules), asked.acting.regulator_count
        own_sites, own_regulators = self._site_count, self.robot.physics.regulator_count
        if own_sites not in (None, sites) or own_regulators != regulators:
            own = "" if own_sites is None else f"{own_sites} sites and "
            raise ValueError(
                f"--robot {robot.described} has {sites} sites and {regulators} regulators, and "
                f"{self.folder} is of {whose}, which has {own}{own_regulators} regulators, "
                f"expected as many: the run's designs and gaits are for these; {back}, or learn "
                f"with that one: pneumorph coopt --robot {robot.described}"
            )

    def handed_on(self, settings: Mapping[str, Any], said: str = "leg and physics") -> TakenOver:
        """Settings for a later verb, with what is said of them: whose, and under which damping."""
        damping = f"({self.robot.physics.damping} damping)"
        note = "".join(
            f"; {', '.join(each.name for each in changed)} is not what it was then: what is found "
            f"here is of the {kind} as it is now"
            for kind, changed in self._changed_files().items()
            if changed
        )
        return TakenOver(self.folder, settings, f"{said} of {self.folder} {damping}{note}")

    def _changed_files(self) -> dict[str, list[ChangedFile]]:
        """Those of its robot that were written again since: parts that were reduced again, and the
        calibration, which changes no part in this."""
        told, used = self.summary.get("leg"), self.calibration
        then = None if told is None else result_from_dict(PartsSummary, told)
        if then is None and used is None:
            return {}
        try:
            return {
                "part": changed_parts(then, used, self.robot),
                "calibration": changed_calibration(used, self.robot),
            }
        except (ValueError, OSError):
            return {}  # a file is gone, which whoever walks its robot is told

    def handed_on_with_worlds(self, group: str) -> TakenOver:
        """Its leg and physics for a later verb, and the worlds it was trained in, if it was.

        Args:
            group: Which of the verb's settings take the worlds.
        """
        robot, worlds = self.taken_over("robot"), self.taken_over("randomisation")
        if not worlds:
            return self.handed_on(robot)
        return self.handed_on({**robot, group: worlds}, "leg, physics and worlds")

    def pairs(self, count: int | None = None) -> list[Pair]:
        """Its best design-gait pairs, the furthest first.

        Args:
            count: Most pairs to read; None for all.

        Raises:
            ArtefactError: It has none, or one that is damaged.
        """
        if not self.summary.get("pairs"):
            raise ArtefactError(
                f"{self.folder / SUMMARY} holds no design-gait pairs; expected a run of coopt, "
                f"or a search of designs, got one of `pneumorph {self.summary.get('verb')}`"
            )
        found = len(self.of_summary("pairs", list))
        return [self._pair(number) for number in range(found if count is None else
                                                       min(count, found))]  # fmt: skip

    def _pair(self, number: int) -> Pair:
        place = f"pairs.{number}"
        limits = (self.task.minimum_pressure_kPa, self.task.maximum_pressure_kPa)
        path = self.gait_path(place)
        if not path.is_file():
            raise FileNotFoundError(
                f"gait file {path} does not exist, expected what {self.folder / SUMMARY} names as "
                f"{place}.gait; it was moved or lost"
            )
        told = self.of_summary(place, dict)
        distance, achieved = (
            None if told.get(name) is None else self.of_summary(f"{place}.{name}", float)
            for name in ("distance_cm", "achieved")
        )
        if self.task.goal.is_forward:
            achieved = distance
        gait, comments = read_gait(path, *limits)
        design = self.design(f"{place}.design", gait.regulator_count)
        if comments.get("design", str(design)) != str(design):
            raise ArtefactError(
                f"{path} is of design {comments['design']}, expected {design}, as "
                f"{self.folder / SUMMARY} has at {place}: one of them is of another run"
            )
        return Pair(design, self.of_summary(f"{place}.gait", str), gait, distance, achieved)

    def gait_path(self, place: str, folder: Path | None = None) -> Path:
        """File of the gait of a pair, which need not exist.

        Args:
            place: Where the summary has the pair, such as ``pairs.0``.
            folder: The run that the gait is of; None for this one.

        Raises:
            ArtefactError: None is named, or one outside the run's folder.
        """
        folder, file = folder or self.folder, self.of_summary(f"{place}.gait", str)
        inside = os.path.normpath(file)
        if os.path.isabs(inside) or inside.split(os.sep)[0] == os.pardir or inside == os.curdir:
            raise ArtefactError(
                f"{self.folder / SUMMARY}: {place}.gait: {file!r:.80} is no file in the run's "
                f"folder {folder}, expected one such as training/gaits/L1.csv"
            )
        return folder / file

    def design(self, place: str, regulator_count: int | None = None) -> Design:
        """A design that the summary names, which the run's robot can have.

        Args:
            place: Where it stands, such as ``pairs.0.design``.
            regulator_count: Regulators that its gait commands; None where that is not known.

        Raises:
            ArtefactError: It is none, is of another number of sites, or needs more regulators.
        """
        text = self.of_summary(place, str)
        try:
            design = Design.parse(text)
            sites = self._site_count
            if sites is not None and design.location_count != sites:
                raise ValueError(
                    f"design {text} has {design.location_count} locations, expected {sites}: one "
                    "for each site of the run's robot"
                )
            if regulator_count is not None:
                design.check_regulators(regulator_count)
        except ValueError as error:
            raise ArtefactError(f"{self.folder / SUMMARY}: {place}: {error}") from error
        return design

    @cached_property
    def _site_count(self) -> int | None:
        """Sites of the run's robot; None where that is not known: its file may have been moved."""
        if "robot" not in self.settings:
            return None
        try:
            described = self.robot.description
        except FileNotFoundError:
            return None
        if described is None:
            return RadialMounting().location_count
        return len(described.sites) if described.ring is None else described.ring.location_count

    @cached_property
    def baseline(self) -> PhaseSweepSettings:
        """The expert's gaits that the run was compared with."""
        return self.structured("baseline", PhaseSweepSettings)

    @cached_property
    def objective(self) -> Objective | None:
        """What its training ranked designs by; None of a run that trained nothing."""
        if "coopt" not in self.settings:
            return None
        return self.structured("coopt", CooptSettings).objective

    @cached_property
    def best_expert(self) -> ExpertGait:
        """The expert's gait at its best phase in the run."""
        phase = self.of_summary("baseline_best_phase_deg", float)
        return replace(self.baseline.gait, phase_deg=phase)

    def digest(self) -> str:
        """Digest of settings and best gaits, which tells one training from another."""
        digest = sha256(json.dumps(self.settings, sort_keys=True).encode())
        for number in range(len(self.of_summary("pairs", list))):
            digest.update(self.gait_path(f"pairs.{number}").read_bytes())
        return digest.hexdigest()[:12]
