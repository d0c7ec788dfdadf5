"""Everything that decides a training, as the settings of its run hold it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pneumorph.base.checked import Checked, Count, CountOrNone
from pneumorph.base.executor import ExecutorSettings
from pneumorph.base.flags import flat
from pneumorph.base.idle_settings import refuse_idle, within
from pneumorph.base.layers import layered
from pneumorph.base.run_folder import SUMMARY, TRAINING_FOLDER, RunFolder, read_summary
from pneumorph.base.settings import laid_over
from pneumorph.catalogue.description_notes import damping_note, design_note
from pneumorph.catalogue.idle_numbers import idle_notes
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_settings import described_robot
from pneumorph.environment.reward_term import RewardTerm
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.learn.checkpoint import has_checkpoint
from pneumorph.learn.cooptimise import refuse_other_task, refuse_task
from pneumorph.learn.settings import (
    CooptSettings,
    fast_settings,
    paper_settings,
    quick_settings,
)
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.simulation.randomised_simulator import reduction_digests
from pneumorph.study.brought_gait import brought_expert, brought_phases
from pneumorph.study.brought_learning import brought_learning
from pneumorph.study.certified_candidates import (
    LEAST_WORLD_COUNT,
    CertificateSettings,
    RoundSettings,
)
from pneumorph.study.changed_files import (
    ChangedFile,
    changed_calibration,
    changed_digests,
    changed_parts,
)
from pneumorph.study.own_task import OwnTask, task_name
from pneumorph.study.reduce_settings import from_walks
from pneumorph.study.shown_gaits import digests_of_shown, shown_gaits
from pneumorph.study.study_once import study_folder, study_once
from pneumorph.study.training_result import TrainingResult, ranked_by
from pneumorph.study.training_run import run_training
from pneumorph.study.training_worlds import TrainingWorlds
from pneumorph.study.usual_aim import other_physics, usual_aim, usual_worlds


@dataclass(frozen=True)
class TrainingOptions(Checked):
    """The learner, the robots, and the baseline to compare with."""

    resume: bool = False
    """Continue from the newest checkpoint in the run folder."""
    randomize: bool = False
    """Train in new random worlds in every round instead of in one world; --randomisation sets the
    distributions."""
    wandb_project: str | None = None
    """Also log to this Weights & Biases project, besides TensorBoard; offline, into the run folder,
    unless WANDB_API_KEY is set."""
    world_count: Count = 8
    """Number of worlds that --randomize draws in a round, if each design walks in one."""
    randomisation: Randomisation = field(default_factory=Randomisation)
    coopt: Annotated[CooptSettings, flat] = field(default_factory=quick_settings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)
    baseline: PhaseSweepSettings = field(default_factory=PhaseSweepSettings)
    demonstrations: tuple[Path, ...] = ()
    """Gaits that are known to work: files that name their design, or folders of finished runs. Half
    of the robots of a beginning's first round walk them, with some noise, and they compete with
    what is learned at the end."""
    certified_world_count: CountOrNone = 0
    """Number of unseen worlds in which the best pairs are certified at the end, as by `pneumorph
    certify` without finite elements; 0 for no certificate. The expert's phase is tuned in a sixth
    as many worlds of the training, at most 24."""
    certify: bool = False
    """End with a full certificate, as `pneumorph certify --full` does: the pairs also walk as
    finite elements, and where the two models differ the leg is reduced again and the pairs are
    fine-tuned on it."""
    rounds: RoundSettings = field(default_factory=RoundSettings)
    """Limits of --certify."""
    page: bool = True
    """End with a page that shows what was learned, as `pneumorph report` makes it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if 0 < self.certified_world_count < LEAST_WORLD_COUNT:
            raise ValueError(
                f"certified_world_count is {self.certified_world_count}, expected at least "
                f"{LEAST_WORLD_COUNT} for a band, or 0 for no certificate"
            )

    def idle_settings(self) -> dict[str, str]:
        """As `pneumorph.base.idle_settings` has them: of worlds that nobody draws, of a certificate
        that nobody asked for, of an objective over one world, and beginnings that there are not."""
        objective, most = self.coopt.objective, self.coopt.restarts - 1
        found = within("coopt.objective", objective)
        if self.coopt.pooled_restarts > most:
            found["coopt.pooled_restarts"] = (
                f"or to be at most {most}, one less than --restarts, as the first beginning has "
                "nothing to learn from"
            )
        if not self.randomize:
            found["world_count"] = "without --randomize"
        elif objective.is_robust:
            found["world_count"] = (
                f"with --objective.worlds-per-design {objective.worlds_per_design}, which is how "
                "many worlds are drawn for a round"
            )
        if not (self.certify or self.certified_world_count):
            found["rounds"] = "without --certify"  # beside a certificate it is refused by that
            if not self.randomize:
                found["randomisation"] = "without --randomize or --certified-world-count"
        return found

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """Settings that the robots bring with them where they are not set: those as their materials
        were measured are trained in the worlds that they may turn out to live in, those of the
        published physics in one, a robot's file says what its designs, regulators and baseline
        are, robots that start turned to a side have no mirror images, and legs that
        were reduced for lower pressures are inflated to those."""
        physics, robot = other_physics(content, below), described_robot(content)
        learner = brought_learning(content, below, robot)
        if learner["space"].get("mirror") == "none":
            learner["mirror_transitions"] = False
        baseline = {
            "gait": brought_expert(content, below, robot),
            **brought_phases(content, robot),
        }
        brought: dict[str, Any] = {"coopt": learner, "baseline": baseline}
        if robot is not None:
            baseline["design"] = robot.usual_design
            if worlds := robot.worlds_settings():
                brought |= {**worlds, "randomize": True}
        return laid_over({} if physics is None else _of_physics(physics), brought)


# Of legs of 40 modes a third of the work, and with a third of their points, which this tolerance
# leaves, less than a quarter; means over worlds of learned robots change by less than 9 %
# (reproduce/learning_modes). The published leg has 24.
_LEARNING_MODES = 16
_LEARNING_TOLERANCE = 0.006


def _of_physics(name: Any) -> dict[str, Any]:
    measured = name == "measured"
    designs = 24 if measured else CooptSettings().evaluated_design_count
    learner = {
        "evaluated_design_count": designs,
        "learning_modes": _LEARNING_MODES if measured else 0,
        "learning_tolerance": _LEARNING_TOLERANCE if measured else 0.0,
    }
    return {
        "randomize": measured,
        "certified_world_count": 144 if measured else 0,
        "randomisation": usual_worlds(name),
        "coopt": {**usual_aim(name), **learner},
    }


def measured_training(
    learner: CooptSettings, changes: Mapping[str, Any] | None = None
) -> TrainingOptions:
    """A training of robots as their materials were measured, in the worlds that may be.

    Args:
        learner: How it is trained.
        changes: What is other than this physics brings, as nested dictionaries.
    """
    usual = TrainingOptions(coopt=learner, robot=RobotOptions.of("published"))
    return layered(usual, [{**(changes or {}), "robot": {"based_on": "measured"}}])


# So few rounds narrow to few designs while all get better: centred, these would lose what they
# gained on the others. Twelve designs a round in worlds from the first round on are too few to
# find a gait by (reproduce/demo).
_SHORT_OBJECTIVE = {"centring_rounds": 0, "nominal_until_timestep": 10_080}


def quick_training() -> TrainingOptions:
    """A search of a few minutes whose best pairs are certified, in fewer worlds."""
    objective = {**_SHORT_OBJECTIVE, "evaluation_worlds": 16}
    changes = {
        "certified_world_count": 48,
        "coopt": {"objective": objective},
        "baseline": {"phase_step_deg": 20.0},
    }
    return measured_training(quick_settings(), changes)


def fast_training() -> TrainingOptions:
    """A search of two and a half hours: twelve short trainings, of the best of which designs are
    fine-tuned."""
    return measured_training(fast_settings(), {"coopt": {"objective": _SHORT_OBJECTIVE}})


PRESETS: dict[str, Callable[[], TrainingOptions]] = {
    "quick": quick_training,
    "fast": fast_training,
    "paper": lambda: measured_training(paper_settings()),
}
"""Ready options by name."""


def train(
    folder: Path | str = "runs/training",
    robot: Path | str | None = None,
    *,
    preset: Literal["quick", "fast", "paper"] = "quick",
    changes: Mapping[str, Any] | None = None,
    own_task: OwnTask | None = None,
) -> TrainingResult:
    """Learn design and gait together, in a folder that every verb reads.

    As ``pneumorph coopt --preset PRESET --robot FILE --settings CHANGES --out FOLDER`` does; a
    stopped training goes on, and one that has ended is read.

    Args:
        folder: The run folder.
        robot: File that describes the robot; None for the paper's.
        preset: Ready settings to start from.
        changes: Settings laid over them, nested by name as in ``settings.json``:
            ``{"coopt": {"total_timesteps": 5000}}``, or ``{"robot": {"based_on": "published"}}``
            for ``--physics published``.
        own_task: Turns the environment of the robots into one of another task, such as a
            `TaskWrapper`; None for the task of the settings.

    Raises:
        FileNotFoundError: No such file of a robot.
        TypeError: The robot is no path, or the changes are no dictionary.
        ValueError: No such preset or setting, one that would be ignored beside the others, the
            folder holds another run, or the environment is none for the settings.
        ArtefactError: The file describes no robot, or the folder is damaged.
    """
    if preset not in PRESETS:
        raise ValueError(f"preset is {preset!r}, expected {' or '.join(PRESETS)}")
    if not (robot is None or isinstance(robot, (str, Path))):
        way = isinstance(robot, RobotDescription)
        raise TypeError(
            f"robot is a {type(robot).__name__}, expected the path of the file that describes it: "
            "the run keeps what the file says"
            + ("; robot.write('robot.toml') writes one and returns its path" if way else "")
        )
    if not (changes is None or isinstance(changes, Mapping)):
        raise TypeError(f"changes is {changes!r:.60}, expected settings as nested dictionaries")
    named = {} if robot is None else {"robot": {"described": str(robot)}}
    usual, layers = PRESETS[preset](), [laid_over(named, changes or {})]
    options = layered(usual, layers)
    refuse_idle(options, usual, layers, Path(folder))
    return train_once(options, study_folder(Path(folder), "coopt"), own_task=own_task)


cooptimise = train
"""The same by the verb's name."""


def train_once(
    options: TrainingOptions, folder: RunFolder, threads: int = 0, own_task: OwnTask | None = None
) -> TrainingResult:
    """Train as the options say, or go on with it; a finished run of the same options is read.

    Args:
        options: The training.
        folder: Where it is.
        threads: The engine's, where the options leave their number open: it does not change what
            comes out.
        own_task: As `train` takes it.

    Raises:
        ValueError: The folder holds another run, one of another task or of other legs, or another
            process writes into it.
        ArtefactError: The folder is damaged.
    """
    wanted = None if own_task is None else task_name(own_task)
    _refuse_other_task(folder, wanted)
    terms = _terms_of(own_task)
    sided = options.coopt.sided_reward or any(term.depends_on_side for term in terms)
    coopt = replace(options.coopt, sided_reward=sided)
    options = replace(options, resume=True, coopt=coopt)
    robot = replace(options.robot, threads=options.robot.threads or threads)
    # Where robots are computed decides nothing either.
    anywhere = replace(options.robot, executor=ExecutorSettings())
    found = study_once(
        folder,
        TrainingResult,
        replace(options, robot=anywhere),
        lambda: train_as_asked(replace(options, robot=robot), folder, own_task),
        begun=has_checkpoint(folder.path / TRAINING_FOLDER),
        # Whether a run was begun alone; where gaits lie that are compared below.
        free=("resume", "demonstrations"),
    )
    spec = robot.spec()
    if options.demonstrations or found.shown:
        shown = shown_gaits(options.demonstrations, options.coopt, spec)
        if list(found.shown) != (asked := digests_of_shown(shown, options.coopt)):
            raise ValueError(
                f"{folder.path} holds a training that was shown {list(found.shown)}, expected "
                f"{asked}; choose another folder"
            )
    said = ranked_by(options.coopt, wanted, terms)
    if isinstance(own_task, type) and found.ranked_by != said:
        raise ValueError(
            f"{folder.path} holds a training ranked by {found.ranked_by}, and {wanted} asks for "
            f"{said}; choose another folder"
        )
    # Before the parts, which are as stiff as it says.
    _refuse_changed(folder, changed_calibration(found.calibration, robot), "calibration")
    theirs, ours = found.leg, spec.describe()["leg"]
    if theirs is not None and theirs.sizes != ours.sizes:
        raise ValueError(
            f"{folder.path} holds a training on another reduction of its legs ({theirs.sizes}, "
            f"and {ours.sizes} now: modes, sampled points, mesh), expected the same; choose another"
            " folder"
        )
    _refuse_changed(folder, changed_parts(theirs, found.calibration, robot), "reduced leg")
    then = _digests_of_reductions(found)
    now = reduction_digests(options.randomisation) if then else {}
    _refuse_changed(folder, changed_digests(then, now), "reduction that worlds have")
    return found


def _refuse_other_task(folder: RunFolder, own_task: str | None) -> None:
    """Refuse a folder whose training, finished or not, is of another task: before its settings,
    which differ then as well.

    Raises:
        ValueError: It is.
    """
    if not (folder.path / SUMMARY).exists():
        refuse_other_task(folder.path / TRAINING_FOLDER, own_task)
        return
    folder.refuse_other_verb()
    refuse_task(folder.path, read_summary(folder.path).get("own_task"), own_task)


def _digests_of_reductions(found: TrainingResult) -> dict[str, str]:
    """What a training said of the reductions that its worlds may have; empty where nothing."""
    drawn = (found.randomisation or {}).get("reduction_digests")
    if drawn is None and found.certificate is not None:
        drawn = found.certificate.reduction_digests
    return dict(drawn or {})


def _refuse_changed(folder: RunFolder, changed: Sequence[ChangedFile], what: str) -> None:
    """Refuse a finished run one of whose files has another content now.

    Raises:
        ValueError: There is one.
    """
    if changed:
        raise ValueError(
            f"{folder.path} holds a training with another {what} "
            f"({', '.join(each.said for each in changed)}), expected the same: the file was "
            "written again since; put back the earlier one, or choose another folder"
        )


def _terms_of(own_task: OwnTask | None) -> tuple[RewardTerm, ...]:
    """Terms of a class of `TaskWrapper`; those of anything else are known once it is made."""
    terms = getattr(own_task, "terms", ())
    known = isinstance(terms, tuple)
    return tuple(each for each in terms if isinstance(each, RewardTerm)) if known else ()


def train_as_asked(
    options: TrainingOptions, folder: RunFolder, own_task: OwnTask | None = None
) -> TrainingResult:
    """Train as the options say; arguments and what is raised as of `run_training`."""
    robot = options.robot.spec()
    drawn = robot.agreeing_worlds(options.randomisation)
    worlds = TrainingWorlds.of_objective(drawn, options.coopt.objective, options.world_count)
    certificate = None
    if options.certified_world_count or options.certify:
        count = options.certified_world_count or CertificateSettings.world_count
        certificate = CertificateSettings(
            pair_count=options.coopt.kept_pair_count,
            world_count=count,
            tuning_world_count=min(24, max(1, count // 6)),
            full=options.certify,
            rounds=options.rounds,
            randomisation=drawn,
        )
    described = options.robot.description
    told = () if described is None else (
        damping_note(described, options.robot.physics),
        design_note(described, options.baseline.design),
    )  # fmt: skip
    notes = tuple(note for note in told if note is not None)
    if options.randomize or certificate is not None:
        notes = (*notes, *idle_notes(robot, drawn))
    for note in notes:
        folder.progress.say(note)
    found = run_training(
        options.coopt,
        folder,
        robot,
        baseline=options.baseline,
        worlds=worlds if options.randomize else None,
        certificate=certificate,
        reduction=from_walks(options.robot.leg_name),
        resume=options.resume,
        wandb_project=options.wandb_project,
        own_task=own_task,
        demonstrations=shown_gaits(options.demonstrations, options.coopt, robot),
    )
    new = tuple(note for note in notes if note not in found.notes)
    return replace(found, notes=(*found.notes, *new)) if new else found
