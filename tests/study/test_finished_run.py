"""Folders of runs are read by name and type: damage is refused by the file and the field."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.run_folders import crawl, write_run
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.result import result_to_dict
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import run
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.learn.objective import Objective
from pneumorph.learn.settings import CooptSettings
from pneumorph.physics.physics import Physics
from pneumorph.robot.design_space import DesignSpace
from pneumorph.robot.scaled_part import scaled_part
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.furthest import furthest
from pneumorph.study.search_options import SearchOptions
from pneumorph.study.search_settings import SearchSettings

DESIGNS = (BASELINE_DESIGN, "0.0.1.2.1.0.0.0", "0.0.1.2.3.0.0.0")
SPACE = DesignSpace(maximum_legs=5)
TASK = CrawlingTask(action_count=2, settling_step_count=7)
ROBOT = RobotOptions.of("published", physics=Physics(damping="objective", friction=0.9))


@dataclass(frozen=True)
class Learning:
    """Of the settings of a coopt run, what is read here."""

    randomize: bool = False
    randomisation: Randomisation = field(default_factory=Randomisation)
    coopt: CooptSettings = field(default_factory=lambda: CooptSettings(task=TASK, space=SPACE))
    robot: RobotOptions = ROBOT
    baseline: PhaseSweepSettings = field(
        default_factory=lambda: PhaseSweepSettings(gait=ExpertGait(duration_s=4.0))
    )


@dataclass(frozen=True)
class Searching:
    """Of the settings of a search, what is read here: task and space stand at the top."""

    task: CrawlingTask = TASK
    space: DesignSpace = SPACE
    robot: RobotOptions = ROBOT


def learned(folder: Path, **options: Any) -> Path:
    """A finished coopt run."""
    return write_run(folder, "coopt", Learning(**options), DESIGNS, baseline_best_phase_deg=60.0)


def test_a_run_gives_back_what_it_was_asked_and_what_it_found(tmp_path: Path) -> None:
    found = FinishedRun.read(learned(tmp_path))
    assert (found.verb, found.robot, found.task, found.space) == ("coopt", ROBOT, TASK, SPACE)
    assert found.baseline.gait == ExpertGait(duration_s=4.0)
    assert found.best_expert == ExpertGait(duration_s=4.0, phase_deg=60.0)
    pairs = found.pairs()
    assert [str(pair.design) for pair in pairs] == list(DESIGNS)
    assert [pair.distance_cm for pair in pairs] == [9.0, 8.0, 7.0]
    assert (pairs[1].gait.held_kPa == crawl(2, seed=2).held_kPa).all()
    assert [pair.gait_file for pair in found.pairs(2)] == [pair.gait_file for pair in pairs[:2]]
    assert len(found.pairs(9)) == 3


def test_a_later_verb_takes_over_the_robot_and_the_worlds_it_was_trained_in(tmp_path: Path) -> None:
    plain = FinishedRun.read(learned(tmp_path / "plain"))
    assert set(plain.taken_over("robot", "randomisation")) == {"robot"}
    worlds = Randomisation(friction="0.4")
    drawn = FinishedRun.read(learned(tmp_path / "drawn", randomize=True, randomisation=worlds))
    assert drawn.taken_over("randomisation")["randomisation"]["friction"] == "0.4"


@pytest.mark.parametrize("world_count", [1, 4])
def test_a_search_over_worlds_says_what_they_were_drawn_from(
    tmp_path: Path, world_count: int
) -> None:
    """Which has no --randomize; that beside a training of an earlier version does not say it."""
    objective = Objective(worlds_per_design=world_count)
    asked = SearchOptions(
        search=SearchSettings("random", task=TASK, space=SPACE, objective=objective),
        robot=ROBOT,
        randomisation=Randomisation(friction="0.4"),
    )
    folder = write_run(tmp_path / "run", "search", asked, DESIGNS)
    found, robust = FinishedRun.read(folder), world_count > 1
    assert found.has_drawn_worlds == robust
    assert found.worlds == (asked.randomisation if robust else None)
    assert ("randomisation" in found.taken_over("robot", "randomisation")) == robust
    assert found.handed_on_with_worlds("evaluation").settings.keys() == (
        {"robot", "evaluation"} if robust else {"robot"}
    )
    change(folder / "settings.json", lambda settings: settings.pop("randomisation"))
    beside = FinishedRun.read(folder)
    assert (beside.has_drawn_worlds, beside.worlds) == (robust, None)
    assert beside.handed_on_with_worlds("evaluation").settings.keys() == {"robot"}


def test_a_part_that_was_reduced_again_since_is_told_of(tmp_path: Path) -> None:
    """Its file is read again, and what is found is no longer of the run's robot."""
    part = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    file = part.save(tmp_path / "leg.npz")
    folder = learned(tmp_path / "run", robot=replace(ROBOT, part=file))
    known = result_to_dict(FinishedRun.read(folder).spec().describe()["leg"])
    change(folder / "summary.json", lambda summary: summary.update(leg=known))
    run = FinishedRun.read(folder)
    assert run.handed_on(run.taken_over("robot")).said.endswith("(objective damping)")
    scaled_part(part, 0.97, 1.0).save(file)
    said = run.handed_on(run.taken_over("robot")).said
    assert f"(objective damping); {file} is not what it was then" in said
    # Found elsewhere it may be called otherwise, and is the same.
    scaled_part(part, 1.0, 1.0).save(file)
    change(folder / "summary.json", lambda summary: summary["leg"].update(part="leg.npz"))
    again = FinishedRun.read(folder)
    assert again.handed_on({}).said.endswith("(objective damping)")
    change(folder / "summary.json", lambda summary: summary["leg"].pop("digest"))
    earlier = FinishedRun.read(folder)
    assert earlier.handed_on({}).said.endswith("(objective damping)")


def test_a_pair_that_no_robot_survived_has_no_distance(tmp_path: Path) -> None:
    folder = learned(tmp_path)
    change(folder / "summary.json", lambda summary: summary["pairs"][0].update(distance_cm=None))
    assert FinishedRun.read(folder).pairs(1)[0].distance_cm is None


@pytest.mark.parametrize(
    ("distances_cm", "place"), [((1.0, 2.0, -3.0), 1), ((None, -2.0), 1), ((None, None), 0)]
)
def test_what_failed_is_the_furthest_only_where_all_failed(
    distances_cm: tuple[float | None, ...], place: int
) -> None:
    walked = [SimpleNamespace(achieved=far) for far in distances_cm]
    assert furthest(walked) is walked[place]


def test_the_digest_tells_one_training_from_another(tmp_path: Path) -> None:
    folder = learned(tmp_path / "run")
    before = FinishedRun.read(folder).digest()
    assert before == FinishedRun.read(learned(tmp_path / "same")).digest()
    change(folder / "summary.json", lambda summary: summary.update(wall_s=3.0))
    assert FinishedRun.read(folder).digest() == before
    gait = folder / "training" / "gaits" / "L2.csv"
    gait.write_text(gait.read_text().replace("design", "sign"))
    assert FinishedRun.read(folder).digest() != before
    change(folder / "settings.json", lambda settings: settings.update(randomize=True))
    assert FinishedRun.read(folder).digest() not in (
        before,
        FinishedRun.read(learned(tmp_path / "same")).digest(),
    )


Change = Callable[[Any], object]


def change(file: Path, how: Change) -> None:
    """Change the content of a JSON file."""
    content = json.loads(file.read_text())
    how(content)
    file.write_text(json.dumps(content))


def _pair(number: int, **values: Any) -> Change:
    """Change a pair of a summary; None takes the value away."""

    def how(summary: Any) -> None:
        for name, value in values.items():
            if value is None:
                del summary["pairs"][number][name]
            else:
                summary["pairs"][number][name] = value

    return how


DAMAGES: dict[str, tuple[str, Change, str]] = {
    "empty settings": ("settings.json", lambda c: c.clear(), "has no robot, expected a table"),
    "no robot": ("settings.json", lambda c: c.pop("robot"), "has no robot, expected a table"),
    "robot is a word": (
        "settings.json", lambda c: c.update(robot="paper"), "has 'paper' as robot, expected a tab",
    ),
    "no task": (
        "settings.json", lambda c: c["coopt"].pop("task"), "has no coopt.task, expected a table",
    ),
    "task of wrong type": (
        "settings.json", lambda c: c["coopt"]["task"].update(action_count="many"),
        "coopt.task of {file}: CrawlingTask cannot be read: action_count: expected int",
    ),
    "no pairs": ("summary.json", lambda c: c.pop("pairs"), "holds no design-gait pairs"),
    "an empty list of pairs": (
        "summary.json", lambda c: c.update(pairs=[]), "holds no design-gait pairs",
    ),
    "pairs are no list": (
        "summary.json", lambda c: c.update(pairs={"L1": {}}), "as pairs, expected a list",
    ),
    "pairs are numbers": (
        "summary.json", lambda c: c.update(pairs=[1, 2]), "has no pairs.0.gait, expected a text",
    ),
    "pairs are words": (
        "summary.json", lambda c: c.update(pairs=["L1"]), "has no pairs.0.gait, expected a text",
    ),
    "a pair without gait": (
        "summary.json", _pair(1, gait=None), "has no pairs.1.gait, expected a text",
    ),
    "a gait that is a number": (
        "summary.json", _pair(0, gait=5), "has 5 as pairs.0.gait, expected a text",
    ),
    "a pair without design": (
        "summary.json", _pair(2, design=None), "has no pairs.2.design, expected a text",
    ),
    "a design that is none": (
        "summary.json", _pair(0, design="1.a.2"), "{file}: pairs.0.design: ",
    ),
    "a distance that is a word": (
        "summary.json", _pair(0, distance_cm="far"),
        "has 'far' as pairs.0.distance_cm, expected a number",
    ),
}  # fmt: skip


def read_all(folder: Path) -> None:
    """Read what a verb takes of a run."""
    found = FinishedRun.read(folder)
    found.taken_over("robot")
    assert isinstance(found.robot, RobotOptions)
    found.pairs()


def assert_refused(command: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A verb ends with one line that says this; whatever else it raises comes through."""
    capsys.readouterr()
    assert run(command.split()) == 1, command
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert message in error, command


@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_refused_by_the_file_and_the_field(
    damage: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = learned(tmp_path / "run")
    name, how, text = DAMAGES[damage]
    file = folder / name
    change(file, how)
    message = text.format(file=file)
    with pytest.raises(ArtefactError) as refused:
        read_all(folder)
    assert message in str(refused.value)
    assert str(file if "holds no" not in message else folder) in str(refused.value)
    verbs = (
        "evaluate {}",
        "analyse {}",
        "simulate --gait {}",
        "deploy {} --model reduced --dry-run",
    )
    # Where the best pair alone is walked, damage to another one does not matter.
    if "pairs.1" in message or "pairs.2" in message:
        verbs = verbs[:2]
    for verb in verbs:
        command = f"{verb.format(folder)} --out {tmp_path / 'out'}"
        assert_refused(command, message, capsys)
        assert not (tmp_path / "out").exists()


def test_a_missing_phase_of_the_baseline_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = learned(tmp_path / "run")
    change(folder / "summary.json", lambda summary: summary.pop("baseline_best_phase_deg"))
    message = "summary.json has no baseline_best_phase_deg, expected a number"
    with pytest.raises(ArtefactError, match=message):
        _ = FinishedRun.read(folder).best_expert
    assert_refused(f"analyse {folder} --out {tmp_path / 'a'}", message, capsys)
    learned(folder)
    change(folder / "settings.json", lambda settings: settings["baseline"].update(gait="sine"))
    with pytest.raises(ArtefactError, match=r"baseline of .*settings\.json"):
        _ = FinishedRun.read(folder).best_expert


def test_a_damaged_source_or_calibration_is_refused(tmp_path: Path) -> None:
    folder = learned(tmp_path)
    for field_name, value, expected in (
        ("run", 5, "has 5 as run, expected a text"),
        ("run", ["a"], "as run, expected a text"),
        ("calibration", "a.json", "has 'a.json' as calibration, expected a table"),
        ("calibration", {}, "it is no UsedCalibration"),
    ):
        learned(folder)
        change(folder / "summary.json", lambda c, new={field_name: value}: c.update(new))
        found = FinishedRun.read(folder)
        with pytest.raises(ArtefactError, match=r"summary\.json") as refused:
            _ = found.source if field_name == "run" else found.calibration
        assert expected in str(refused.value)
    change(folder / "summary.json", lambda c: c.update(verb="calibrate", calibration="c.json"))
    assert FinishedRun.read(folder).calibration is None
    change(folder / "summary.json", lambda c: c.update(run=str(folder)))
    source = FinishedRun.read(folder).source
    assert source is not None
    assert source.folder == folder
    change(folder / "summary.json", lambda c: c.update(run=str(folder / "gone")))
    assert FinishedRun.read(folder).source is None


@pytest.mark.parametrize("name", ["summary.json", "settings.json"])
def test_files_that_are_cut_short_or_no_table_are_refused_by_name(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = learned(tmp_path / "run")
    file = folder / name
    whole = file.read_bytes()
    for content, message in (
        (whole[: len(whole) // 2], f"{file} is not valid JSON"),
        (b"", f"{file} is not valid JSON"),
        (b"\xff\xfe\x00binary", f"{file} is not text"),
        (b"[1, 2]", f"{file} holds a list, expected a table of values"),
    ):
        file.write_bytes(content)
        with pytest.raises(ArtefactError) as refused:
            FinishedRun.read(folder)
        assert message in str(refused.value)
        for verb in ("evaluate {}", "analyse {}", "simulate --gait {}", "deploy {} --dry-run"):
            assert_refused(f"{verb.format(folder)} --out {tmp_path / 'o'}", message, capsys)
    file.unlink()
    assert_refused(f"evaluate {folder}", f"{folder} holds no {name}", capsys)


def test_a_run_without_a_robot_is_told_by_its_file_once(tmp_path: Path) -> None:
    """As of a mesh, which has none."""
    told = FinishedRun.read(write_run(tmp_path / "run", "mesh", {}, ()))
    with pytest.raises(ArtefactError, match=r"settings\.json has no robot") as said:
        told.spec()
    assert str(said.value).count("settings.json") == 1


def test_a_gait_that_is_gone_or_too_high_is_refused_by_name(tmp_path: Path) -> None:
    folder = learned(tmp_path)
    gait = folder / "training" / "gaits" / "L1.csv"
    lines = gait.read_text().splitlines()
    gait.write_text("\n".join([*lines[:2], "0.0,120.0,0.0,0.0", "2.0,120.0,0.0,0.0"]))
    with pytest.raises(ValueError, match=r"L1\.csv: .*120"):
        FinishedRun.read(folder).pairs()
    gait.unlink()
    with pytest.raises(FileNotFoundError, match=r"L1\.csv does not exist"):
        FinishedRun.read(folder).pairs()


def test_a_search_of_designs_is_a_run_whose_pairs_walk(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_run(tmp_path / "run", "search", Searching(), DESIGNS)
    found = FinishedRun.read(folder)
    assert (found.verb, found.robot, found.task, found.space) == ("search", ROBOT, TASK, SPACE)
    assert [str(pair.design) for pair in found.pairs()] == list(DESIGNS)
    for number, verb in enumerate(("evaluate {}", "simulate --gait {}", "deploy {} --dry-run")):
        command = f"{verb.format(folder)} --out {tmp_path / str(number)}"
        assert run(command.split()) == 0, capsys.readouterr().err
    # It has no expert to stand beside.
    message = "settings.json has no baseline, expected a table of values; it is damaged or of a"
    assert_refused(f"analyse {folder} --out {tmp_path / 'a'}", message, capsys)
    assert_refused(f"analyse {folder} --out {tmp_path / 'a'}", "(`pneumorph search`)", capsys)


@pytest.mark.parametrize("verb", ["search", "baseline", "mesh"])
def test_runs_without_pairs_are_refused_by_the_verb_that_made_them(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A search of gaits holds designs, a baseline phases, a mesh no robot at all."""
    folder = write_run(tmp_path / "run", verb, {} if verb == "mesh" else Searching(), ())
    for command in ("evaluate {}", "simulate --gait {}", "deploy {} --dry-run"):
        expected = "has no robot" if verb == "mesh" else "holds no design-gait pairs"
        assert_refused(f"{command.format(folder)} --out {tmp_path / 'o'}", expected, capsys)
        assert_refused(f"{command.format(folder)} --out {tmp_path / 'o'}", f"`pneumorph {verb}`",
                       capsys)  # fmt: skip
