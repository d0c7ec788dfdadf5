"""Where a verb's gait comes from: a file, a run's best pairs, a policy, or the expert."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.base.layers import changed_flags
from pneumorph.base.run_folder import SETTINGS, SUMMARY, TRAINING_FOLDER
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.exchange.sorotraj import read_sorotraj
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import gait_remarks, read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.commands import check_commands
from pneumorph.physics.open_loop_gait import ChangedGait, OpenLoopGait
from pneumorph.physics.pressure import PressureMap
from pneumorph.robot.design import Design
from pneumorph.study.finished_run import FinishedRun, TakenOver


@dataclass(frozen=True)
class GaitSource:
    """A gait, whose it is, and what it was made with: its leg's `bending_map`, steps before it
    starts, and the goal.

    The map is None where the source does not say: then it is that of the leg that walks. The goal
    is that of a run or a policy; a gait's file does not say one, and it is forward.
    """

    gait: OpenLoopGait
    design: Design
    name: str
    bending_map: PressureMap | None = None
    settling_steps: int = 15
    goal: Goal = FORWARD
    meant_for: Design | None = None
    """Design that the source names; None where it names none."""
    own_task: str | None = None
    """What the task was called that it was learned for; None for one of the package's."""

    @property
    def own_task_note(self) -> str | None:
        """What to say of a gait that was learned for a reward which is not known here."""
        if self.own_task is None:
            return None
        return (
            f"{self.name} was learned for the task {self.own_task}, which is in no file of its "
            f"run: what it achieves is told by {self.goal.label}"
        )

    @property
    def other_design_note(self) -> str | None:
        """What to say where another design walks than the source names; None otherwise."""
        if self.meant_for in (None, self.design):
            return None
        return f"{self.name} is a gait of {self.meant_for}; {self.design} walks it, as asked"

    def check_robot(self, regulator_count: int) -> None:
        """Refuse a gait for more regulators than the robot has.

        Raises:
            ValueError: It commands more; names where it is from.
        """
        if self.gait.regulator_count > regulator_count:
            raise ValueError(
                f"{self.name} commands {self.gait.regulator_count} regulators, expected at most "
                f"{regulator_count}, as many as the robot has: it may be for another robot, which "
                "--robot FILE describes, or --physics.regulator-count gives this one more"
            )


def find_gait(
    source: Path | None, design: str | None, expert: ExpertGait, rank: int = 1
) -> GaitSource:
    """Find a gait.

    Args:
        source: A coopt run's folder, a gait file (CSV, or sorotraj YAML), or a policy's npz; None
            for the expert's gait.
        design: The design, where the source does not name it or another is wanted.
        expert: The expert's gait.
        rank: Which of a run's pairs, counted from 1.

    Raises:
        FileNotFoundError: No such file.
        ValueError: None of these, the design uses a regulator that the gait does not command, or
            the expert's gait is changed beside a source.
    """
    if source is not None:
        for flag in changed_flags(ExpertGait(), expert):
            raise ValueError(
                f"--expert.{flag.removeprefix('--')} is given, expected it without a gait of your "
                f"own ({source}): it would be ignored"
            )
    if source is None:
        name = f"the expert's gait, {expert.phase_deg:g}°"
        found = GaitSource(expert, _design(design, None), name)
    elif source.is_dir():
        found = _of_run(source, design, rank)
    elif source.suffix in (".yaml", ".yml"):
        found = _of_file(source, read_sorotraj(source), design, gait_remarks(source))
    elif source.suffix == ".npz":
        found = _of_policy(source, design)
    else:
        held, comments = read_gait(source)
        found = _of_file(source, held, design, comments)
    try:
        found.design.check_regulators(found.gait.regulator_count)
    except ValueError as error:
        if source is None:
            raise
        raise ValueError(
            f"{source} commands {found.gait.regulator_count} regulators: {error}"
        ) from error
    return found


def names_no_design(source: Path | str) -> bool:
    """Whether a gait comes from a file of its own that does not say whose it is: the design of the
    robot that walks where none is named. A file that is not there is refused later.
    """
    source = Path(source)
    if source.is_dir() or source.suffix == ".npz" or not source.is_file():
        return False
    return "design" not in gait_remarks(source)


def _of_file(
    source: Path, gait: OpenLoopGait, asked: str | None, remarks: Mapping[str, str]
) -> GaitSource:
    """A gait's file, for the design that is asked for, or else the one that it names.

    Raises:
        ValueError: Nothing is asked for, and what it names is no design; names the file.
    """
    named, meant_for = remarks.get("design"), None
    try:
        meant_for = None if named is None else Design.parse(named)
    except ValueError as error:
        if asked is None:
            raise ValueError(f"gait file {source}: design: {error}") from error
    return GaitSource(gait, _design(asked, named), str(source), meant_for=meant_for)


def _design(asked: str | None, named: str | None) -> Design:
    return Design.parse(asked or named or BASELINE_DESIGN)


def robot_of_source(source: Path | None) -> TakenOver | None:
    """Leg and physics of the run that a gait or a policy is taken from; None where it is of no
    run."""
    if source is None:
        return None
    of_training = source.suffix == ".npz" and source.parent.name == TRAINING_FOLDER
    run_folder = source.parent.parent
    if of_training and any((run_folder / name).is_file() for name in (SUMMARY, SETTINGS)):
        source = run_folder  # of a run that has not ended the reader says what is missing
    elif not source.is_dir():
        return None
    run = FinishedRun.read(source)
    return run.handed_on(run.taken_over("robot"))


def _of_run(folder: Path, design: str | None, rank: int) -> GaitSource:
    run = FinishedRun.read(folder)
    pairs = run.pairs(rank)
    if not 1 <= rank <= len(pairs):
        raise ValueError(
            f"{folder} holds {len(pairs)} design-gait pairs, expected rank from 1 to that, got "
            f"{rank}"
        )
    pair = pairs[rank - 1]
    return GaitSource(
        pair.gait,
        pair.design if design is None else Design.parse(design),
        str(folder / pair.gait_file),
        bending_map(run.spec()),
        run.task.settling_step_count,
        run.goal,
        pair.design,
        run.own_task,
    )


def _of_policy(path: Path, design: str | None) -> GaitSource:
    """The deterministic gait of a design: the policy sees its own last actions only."""
    from pneumorph.learn.policy_file import load_policy
    from pneumorph.learn.sac import Sac

    policy, settings, metadata = load_policy(path)
    if design is None:
        raise ValueError(f"{path} is a policy for every design, expected --design to name one")
    task, chosen = settings.task, Design.parse(design)
    usual, own = task.state_size + settings.space.feature_count, policy.observation_size
    if own != usual:
        raise ValueError(
            f"{path} is a policy of {own} observed numbers, expected the {usual} of remembered "
            "actions and a design: what it saw in an environment of its own is not known here; "
            "give a gait of its run"
        )
    place = settings.space.index(chosen)
    one_hot = settings.space.features(np.array(place))
    learner = Sac(task.state_size + len(one_hot), task.regulator_count, settings.sac)
    memory = np.zeros(task.state_size, dtype=np.float32)
    held = []
    for _ in range(task.action_count):
        observation = np.concatenate([memory, one_hot])[None]
        action = np.asarray(learner.mode_actions(policy, observation))[0]
        held.append(task.pressure_kPa(np.clip(action, -1.0, 1.0)))
        memory = np.concatenate([action, memory[: -task.regulator_count]]).astype(np.float32)
    # The policy names regulators as its own design does; other names are other columns.
    known, commands = settings.space[place], np.array(held)
    if known != chosen:
        named = np.full_like(commands, task.minimum_pressure_kPa)
        for ours, theirs in zip(chosen.regulator_order(), known.regulator_order(), strict=True):
            named[:, ours - 1] = commands[:, theirs - 1]
        commands = named
    # The paper's time step, for policies that do not say theirs.
    action_s = task.action_s(metadata.get("time_step_s", 0.01))
    gait = HeldGait.evenly(commands, action_s, task)
    name = f"{path} for {design}"
    return GaitSource(gait, chosen, name, settling_steps=task.settling_step_count, goal=task.goal)


def bending_map(spec: RobotSpec) -> PressureMap:
    """From real pressures to those that bend the leg alike before its modulus was measured: a leg
    of f times the modulus bends under f times the pressure as it did."""
    usual = spec.physics.pressure_map
    factor = 1.0 if spec.calibration is None else spec.calibration.modulus_factor or 1.0
    return PressureMap(usual.slope / factor, usual.intercept_kPa / factor)


def recalibrated(
    gait: OpenLoopGait,
    trained: PressureMap,
    measured: PressureMap,
    highest_kPa: float | np.ndarray,
) -> OpenLoopGait:
    """The gait whose real pressures mean to the measured robot what they meant in training.

    Args:
        gait: The gait.
        trained: `bending_map` of the robot it was made with.
        measured: That of the robot at hand.
        highest_kPa: Pressures are cut off here [kPa], one for all regulators or (regulator,).
    """
    if trained == measured:
        return gait
    return _Recalibrated(gait, trained, measured, highest_kPa)


@dataclass(frozen=True, eq=False)
class _Recalibrated(ChangedGait):
    trained: PressureMap
    measured: PressureMap
    highest_kPa: float | np.ndarray

    @property
    def maximum_pressure_kPa(self) -> float:
        return float(np.max(self.highest_kPa))

    def pressure_kPa(self, time_s: float) -> np.ndarray:
        """Real pressure commanded at a time [kPa], (regulator,)."""
        own = self.gait.pressure_kPa(time_s)
        check_commands(own, self.gait.maximum_pressure_kPa)  # before it is cut off
        return np.minimum(self.trained.equivalent(own, self.measured), self.highest_kPa)
