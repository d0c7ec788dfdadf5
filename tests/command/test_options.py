"""Which options a verb gets from its preset, an earlier run, a settings file and flags."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from helpers.run_folders import write_run
from helpers.synthetic_part import synthetic_reduced_part

import pneumorph as pm
from pneumorph.base.layers import _flags, _switched_off, layered
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.leg_kinds import HYPERELASTIC_PRESSURE_MAP, leg_kind, load_default_leg
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_identity import reduction_digest
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.cli import VERBS, run
from pneumorph.command.simulate import SimulateOptions
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.physics.air import Air
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study import training_options
from pneumorph.study.campaign import CampaignSettings
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.training_options import TrainingOptions

Ask = Callable[[str], Any]
PLATES = Path(__file__).parent.parent.parent / "examples"
PUBLISHED = RobotOptions.of("published")
PUBLISHED_MAP = PressureMap()
OTHER_MAP = PressureMap(5.0, -1.0)
"""A map that is no leg's own."""


@pytest.mark.parametrize("verb", VERBS)
def test_every_verbs_options_are_found_on_its_command_line(
    verb: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A flag that is spelled otherwise than we look for it would count for nothing."""
    monkeypatch.setenv("COLUMNS", "100")  # one column
    with pytest.raises(SystemExit):
        run([verb, "--help"])
    text = capsys.readouterr().out
    shown = set(text.split())
    flags = [flag for _, flag in _flags(import_module(f"pneumorph.command.{verb}").VERB.options)]
    missing = [flag for flag in flags if flag and not {flag, _switched_off(flag)} & shown]
    assert missing == []
    plain = " ".join(text.translate(dict.fromkeys(map(ord, "│╭╮╰╯─"), " ")).split())
    # A reader of help has no files of the package, and a verb has defaults of its own.
    found = re.findall(r"\S+\.py\b|the defaults are|Of --\w+", plain)
    assert [words for words in found if words != "scene.py"] == []  # which `exchange` writes


def learned(folder: Path, **robot: Any) -> Path:
    """A finished coopt run whose robot has these settings."""
    options = TrainingOptions(robot=layered(PUBLISHED, [robot]))
    return write_run(folder, "coopt", options)


def test_flags_win_over_the_file_and_the_file_over_the_run(tmp_path: Path, asked: Ask) -> None:
    objective = {"physics": {"damping": "objective", "friction": 0.5}, "threads": 3}
    folder = learned(tmp_path / "run", **objective)
    file = tmp_path / "file.toml"
    file.write_text('[robot.physics]\ndamping = "objective"\nfriction = 0.7\n')
    assert asked(f"evaluate {folder}").robot == layered(PUBLISHED, [objective])
    over = asked(f"evaluate {folder} --settings {file}").robot
    assert (over.physics.friction, over.threads) == (0.7, 3)
    # `published` and 1.2 are what the physics has anyway; said, they count.
    flags = "--physics.damping published --physics.friction 1.2 --threads 0"
    most = asked(f"evaluate {folder} --settings {file} {flags}").robot
    assert most == PUBLISHED
    one = asked(f"evaluate {folder} --settings {file} --physics.damping=published").robot
    assert (one.physics.damping, one.physics.friction, one.threads) == ("published", 0.7, 3)
    assert asked(f"evaluate {folder} --afresh").robot == RobotOptions()


def test_of_presets_the_last_counts_and_is_told(asked: Ask, tmp_path: Path) -> None:
    twice = "coopt --preset paper --preset=quick"
    assert asked(twice) == asked("coopt --preset quick") != asked("coopt --preset paper")
    told = [json.loads(file.read_text()) for file in sorted(tmp_path.glob("out*/summary.json"))]
    assert [each["preset"] for each in told] == ["quick", "quick", "paper"]


def test_a_second_settings_file_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The last one alone would be read."""
    files = [tmp_path / f"{name}.toml" for name in "ab"]
    for file in files:
        file.write_text("[walk]\nrecord_every = 3\n")
    flags = [f"--settings={files[0]}", "--settings", str(files[1])]
    assert run(["simulate", *flags, "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert f"--settings is given 2 times ({files[0]}, {files[1]}), expected one file" in said


def test_of_robots_the_last_counts(asked: Ask) -> None:
    """Also for what its file brings with it."""
    plates = [PLATES / f"{name}.toml" for name in ("large_plate", "plate")]
    twice = f"coopt --robot {plates[0]} --robot {plates[1]}"
    assert asked(twice) == asked(f"coopt --robot {plates[1]}")


def test_the_librarys_training_is_that_of_the_verb(
    tmp_path: Path, asked: Ask, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its worlds, objective, tilt and certificate, whatever is said of the physics."""
    trained: list[TrainingOptions] = []

    def train_once(options: TrainingOptions, *_: Any, **__: Any) -> None:
        trained.append(options)

    monkeypatch.setattr(training_options, "train_once", train_once)
    pm.train(tmp_path / "usual")
    pm.train(tmp_path / "published", changes={"robot": {"based_on": "published"}})
    usual, published = trained
    assert usual == asked("coopt --preset quick") == asked("coopt")
    assert published == asked("coopt --preset quick --physics published")
    assert (usual.randomize, published.randomize) == (True, False)
    assert pm.cooptimise is pm.train


def test_friction_by_surface_is_kept_with_a_run_and_said_by_flag_or_file(
    tmp_path: Path, asked: Ask
) -> None:
    named = (("sheet", 0.6), ("hub", 0.3))
    folder = learned(tmp_path / "run", physics={"friction_by_surface": named})
    assert asked(f"evaluate {folder}").robot.physics.friction_by_surface == named
    file = tmp_path / "file.toml"
    file.write_text(
        '[robot.physics]\nfriction_by_surface = [["skin", 0.9]]\n'
        "[robot.physics.friction_pressure]\nexponent = -0.3\n"
    )
    said = asked(f"evaluate {folder} --settings {file}").robot.physics
    assert (said.friction_by_surface, said.friction_pressure.exponent) == ((("skin", 0.9),), -0.3)
    flag = "--physics.friction-by-surface sheet 0.5 skin 0.7"
    most = asked(f"evaluate {folder} --settings {file} {flag}").robot.physics
    assert most.friction_by_surface == (("sheet", 0.5), ("skin", 0.7))
    drawn = asked("coopt --randomisation.friction-by-surface sheet U(0.4,1)")
    assert drawn.randomisation.friction_by_surface == (("sheet", "U(0.4,1)"),)


def test_a_leg_brings_its_own_pressure_map(tmp_path: Path, asked: Ask) -> None:
    def map_of(command: str) -> PressureMap:
        found: PressureMap = asked(command).robot.physics.pressure_map
        return found

    other = "--physics.pressure-map.slope 5 --physics.pressure-map.intercept-kPa -1"
    assert map_of("simulate") == PressureMap(1.0, 0.0)
    assert map_of("simulate --physics published") == PUBLISHED_MAP
    assert map_of("simulate --leg hyperelastic") == HYPERELASTIC_PRESSURE_MAP
    assert map_of(f"simulate --leg hyperelastic {other}") == OTHER_MAP
    half = map_of("simulate --leg hyperelastic --physics.pressure-map.slope 5")
    assert half == PressureMap(5.0, HYPERELASTIC_PRESSURE_MAP.intercept_kPa)
    # A preset's leg gives way with its map, a map that was said with it does not.
    assert map_of("simulate --preset hyperelastic") == HYPERELASTIC_PRESSURE_MAP
    assert map_of("simulate --preset hyperelastic --leg published") == PUBLISHED_MAP
    folder = learned(tmp_path / "paper", physics={"pressure_map": settings_to_dict(OTHER_MAP)})
    assert map_of(f"evaluate {folder}") == OTHER_MAP
    assert map_of(f"evaluate {folder} --leg hyperelastic") == HYPERELASTIC_PRESSURE_MAP
    file = tmp_path / "leg.toml"
    file.write_text('[robot]\nleg = "hyperelastic"\n')
    assert map_of(f"evaluate {folder} --settings {file}") == HYPERELASTIC_PRESSURE_MAP


def test_another_flag_leaves_the_legs_pressure_map_alone(tmp_path: Path, asked: Ask) -> None:
    """At the published map a hyperelastic leg would have three times its pressure."""
    folder = learned(tmp_path / "run", leg="hyperelastic")
    file = tmp_path / "file.toml"
    file.write_text("[robot.physics]\nfriction = 0.8\n")
    for command in (
        f"evaluate {folder}",
        f"evaluate {folder} --physics.friction 0.8 --threads 1",
        f"evaluate {folder} --settings {file}",
        f"evaluate {folder} --leg hyperelastic",
        "simulate --preset hyperelastic --physics.friction 0.8",
    ):
        robot = asked(command).robot
        assert robot.leg == "hyperelastic"
        assert robot.physics.pressure_map == HYPERELASTIC_PRESSURE_MAP, command


def test_a_leg_brings_its_masses_and_a_run_keeps_its_own(tmp_path: Path, asked: Ask) -> None:
    def masses_of(command: str) -> str:
        found: str = asked(command).robot.masses.model
        return found

    assert masses_of("simulate") == "cast"
    assert masses_of("simulate --physics published") == "published"
    assert masses_of("simulate --leg hyperelastic") == "cast"
    assert masses_of("simulate --preset hyperelastic") == "cast"
    assert masses_of("simulate --leg hyperelastic --masses.model published") == "published"
    # What is built of a run's best design stands beside the masses it was learned with.
    cast = learned(tmp_path / "cast", masses={"model": "cast"})
    assert masses_of(f"fabricate {cast}") == "cast"
    assert masses_of(f"fabricate {cast} --masses.model published") == "published"
    assert masses_of("fabricate 1.0.0.2.2.0.0.1") == "cast"


def test_the_measured_physics_is_the_default_of_every_robot(asked: Ask) -> None:
    """With nothing said: leg, masses, hub, steps and physics are those of its name."""
    usual = asked("simulate").robot
    assert usual == asked("simulate --physics measured").robot == RobotOptions()
    assert usual == RobotOptions.of("measured")
    spec, named = usual.spec(), paper_robot("measured")
    assert (spec.physics, spec.full_order) == (named.physics, named.full_order)
    assert spec.hub.mass_numbers() == named.hub.mass_numbers() == paper_robot().hub.mass_numbers()
    assert reduction_digest(spec) == reduction_digest(named) == reduction_digest(paper_robot())
    for verb in ("baseline", "coopt", "search", "bench", "compare"):
        assert asked(verb).robot == usual
    assert asked("compare --physics published").robot == PUBLISHED


def test_a_leg_or_a_part_of_another_physics_brings_that_with_it(tmp_path: Path, asked: Ask) -> None:
    assert asked("simulate --leg published").robot == PUBLISHED
    other = asked("simulate --leg hyperelastic --physics.friction 0.8").robot
    assert other.physics == Physics(friction=0.8, pressure_map=HYPERELASTIC_PRESSURE_MAP)
    assert (other.based_on, other.full, other.masses.model) == ("published", PUBLISHED.full, "cast")
    # In a robot of its own physics a leg brings no more than what is its own.
    folder = learned(tmp_path / "run", physics={"friction": 0.5})
    assert asked(f"evaluate {folder} --leg hyperelastic").robot.physics.friction == 0.5
    assert asked(f"evaluate {folder} --leg measured").robot == RobotOptions()
    part = synthetic_reduced_part().save(tmp_path / "leg.npz")
    assert asked(f"simulate --part {part}").robot == replace(PUBLISHED, part=part)
    threaded = replace(PUBLISHED, part=part, threads=2)
    assert asked(f"simulate --part {part} --threads 2").robot == threaded
    fresh = replace(threaded, stepper=replace(PUBLISHED.stepper, linearised="ahead"))
    fresh_flags = f"--part {part} --threads 2 --stepper.linearised ahead"
    assert asked(f"simulate {fresh_flags}").robot == fresh
    assert asked(f"evaluate {folder} --part {part}").robot.physics.friction == 0.5
    relaxing = load_default_leg("measured").save(tmp_path / "relaxing.npz")
    assert asked(f"evaluate {folder} --part {relaxing}").robot == RobotOptions(part=relaxing)
    # Said together they are as they are said.
    said = asked(f"simulate --physics measured --part {part}").robot
    assert said == RobotOptions(part=part)


def test_a_run_that_says_no_physics_is_of_the_published_one(tmp_path: Path, asked: Ask) -> None:
    """All were, before there was a choice; one that says it keeps what it says."""
    kept = settings_to_dict(TrainingOptions(robot=PUBLISHED))
    del kept["robot"]["based_on"], kept["robot"]["full"], kept["robot"]["masses"]
    del kept["certified_world_count"], kept["coopt"]["objective"]
    folder = write_run(tmp_path / "run", "coopt", kept)
    assert FinishedRun.read(folder).robot == asked(f"evaluate {folder}").robot == PUBLISHED
    again = asked(f"coopt --settings {folder / 'settings.json'}")
    assert (again.robot, again.randomize, again.certified_world_count) == (PUBLISHED, False, 0)
    assert not again.coopt.objective.is_robust
    kept["robot"]["based_on"] = "measured"
    assert asked(f"evaluate {write_run(tmp_path / 'now', 'coopt', kept)}").robot.based_on == (
        "measured"
    )


def test_a_choice_of_physics_brings_leg_masses_hub_and_damping(tmp_path: Path, asked: Ask) -> None:
    measured = asked("simulate --physics measured").robot
    assert (measured.leg, measured.masses.model) == ("measured", "cast")
    assert (measured.full.hub, measured.full.integrator) == ("rigid", "implicit_euler")
    assert measured.physics == leg_kind("measured").physics
    some = asked(
        "simulate --physics measured --physics.friction 0.8 --masses.model published"
    ).robot
    assert some.physics == replace(measured.physics, friction=0.8)
    assert some.masses.model == "published"
    # A run's own friction gives way: it was asked for other physics.
    folder = learned(tmp_path / "run", based_on="measured", physics={"friction": 0.5})
    assert asked(f"evaluate {folder}").robot.physics == replace(measured.physics, friction=0.5)
    assert asked(f"evaluate {folder} --physics published").robot == PUBLISHED


def test_a_variant_of_a_campaign_is_a_layer(tmp_path: Path) -> None:
    texts = {"leg": '[robot]\nleg = "hyperelastic"\n', "updates": "[coopt]\nupdates = 4\n"}
    for name, text in texts.items():
        (tmp_path / f"{name}.toml").write_text(text)
    files = tuple(tmp_path / f"{name}.toml" for name in texts)
    base = TrainingOptions(robot=replace(PUBLISHED, physics=Physics(friction=0.5)))
    variants = CampaignSettings(variants=files, run=base).bases()
    assert variants["leg"].robot.physics == Physics(
        friction=0.5, pressure_map=HYPERELASTIC_PRESSURE_MAP
    )
    assert variants["updates"] == replace(base, coopt=replace(base.coopt, updates=4))
    (tmp_path / "updates.toml").write_text("[coopt]\nsed = 4\n")
    with pytest.raises(ValueError, match=r"updates\.toml: unknown setting coopt\.sed"):
        CampaignSettings(variants=files[1:], run=base).bases()


def test_switches_win_over_the_file_and_the_run(tmp_path: Path, asked: Ask) -> None:
    file = tmp_path / "file.json"
    file.write_text('{"coopt": {"mirror_transitions": true}, "resume": true}')
    assert asked(f"coopt --preset paper --settings {file}").coopt.mirror_transitions
    (tmp_path / "turned.toml").write_text("[physics.start]\nheading_deg = 90\n")
    example = Path(__file__).parents[2] / "examples/plate.toml"
    (tmp_path / "plate.toml").write_text(f"{example.read_text()}\n[physics.start]\nroll_deg = 30\n")
    for start, mirrored in (
        (f"--robot {tmp_path / 'plate.toml'}", False),
        (f"--robot {example}", True),
        ("--physics.start.heading-deg 90", False),
        ("--physics.start.roll-deg 90", False),
        (f"--settings {tmp_path / 'turned.toml'}", False),
        ("--physics.start.pitch-deg 90", True),
    ):
        found = asked(f"coopt --preset quick {start}").coopt
        assert (found.mirror_transitions, found.space.has_mirror) == (mirrored, mirrored)
        assert asked(f"search {start}").search.space.has_mirror == mirrored
    off = asked(f"coopt --preset paper --settings {file} --no-mirror-transitions --no-resume")
    assert (off.coopt.mirror_transitions, off.resume) == (False, False)
    options = replace(
        TrainingOptions(), randomize=True, randomisation=Randomisation(friction="0.4")
    )
    folder = write_run(tmp_path / "run", "coopt", options)
    # The run's own worlds are taken, not that it walks in them.
    assert not asked(f"evaluate {folder}").evaluation.randomize
    drawn = asked(f"evaluate {folder} --randomize").evaluation
    assert (drawn.randomize, drawn.randomisation.friction) == (True, "0.4")


def test_positional_arguments_win_over_the_file(tmp_path: Path, asked: Ask) -> None:
    file = tmp_path / "file.toml"
    file.write_text('subject = "full"\n')
    assert asked(f"bench --settings {file}").subject == "full"
    assert asked(f"bench engine --settings {file}").subject == "engine"
    assert asked("bench full --threads 2").subject == "full"


def test_air_is_asked_for_by_flags_and_files(tmp_path: Path, asked: Ask) -> None:
    """Settings of before there was air, as all others, have the published rate."""
    flags = "--physics.air.law orifice --physics.air.filling-mm3-per-s-kPa 50 60 70"
    air = asked(f"simulate {flags}").robot.physics.air
    assert (air.law, air.filling_mm3_per_s_kPa) == ("orifice", (50.0, 60.0, 70.0))
    file = tmp_path / "air.toml"
    file.write_text('[robot.physics]\nair = { law = "orifice", venting_mm3_per_s_kPa = [900.0] }\n')
    air = asked(f"simulate --settings {file}").robot.physics.air
    assert (air.law, air.venting_mm3_per_s_kPa) == ("orifice", (900.0,))
    file.write_text("[robot.physics]\nfriction = 0.8\n")
    published = "simulate --physics published"
    assert asked(f"{published} --settings {file}").robot.physics.air == Air()
    file.write_text("[robot.physics.air]\nfilling_mm3_per_s_kPa = [900.0, 800.0]\n")
    assert run(["simulate", "--settings", str(file), "--out", str(tmp_path / "s")]) == 1


@pytest.mark.parametrize("verb", ["evaluate", "certify", "analyse"])
def test_a_robot_that_the_runs_gaits_are_not_for_is_refused(
    verb: str, tmp_path: Path, asked: Ask, capsys: pytest.CaptureFixture[str]
) -> None:
    """By what was given and what the run has; a flag that nobody gave is not named."""
    folder, plate = learned(tmp_path / "run"), PLATES / "plate.toml"
    out = f"--out {tmp_path / 'out'}"
    for rest in ("", " --afresh"):
        assert run(f"{verb} {folder} --robot {plate} {out}{rest}".split()) == 1
        told = capsys.readouterr().err
        assert f"--robot {plate} has 6 sites and 4 regulators, and {folder} is of the" in told
        assert "robot, which has 8 sites and 3 regulators, expected as many" in told
        assert "leave out --robot" in told
        assert "leg and physics" not in told
    # Of its own robot's file the same robot walks.
    kept = layered(TrainingOptions(), [{"robot": {"described": str(plate)}}])
    described = write_run(tmp_path / "plate", "coopt", kept, ("b1.0.2.2.0.b1",))
    assert asked(f"{verb} {described} --robot {plate}").robot.described == plate
    three = f"--robot {plate} --physics.regulator-count 3"
    fewer = layered(kept, [{"robot": {"physics": {"regulator_count": 3}}}])
    described = write_run(tmp_path / "three", "coopt", fewer, ("b1.0.2.2.0.b1",))
    assert asked(f"{verb} {described} {three}").robot.physics.regulator_count == 3
    assert "(yours: " not in capsys.readouterr().err


def test_a_leg_of_a_run_is_not_said_to_be_given(
    tmp_path: Path, leg: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = TrainingOptions(robot=layered(PUBLISHED, [{"part": str(leg)}]))
    best = "1.0.0.2.2.0.0.1"
    folder = write_run(tmp_path / "run", "coopt", options, (best,), best_design=best)
    plate = PLATES / "plate.toml"
    assert run(f"evaluate {folder} --robot {plate} --out {tmp_path / 'out'}".split()) == 1
    told = capsys.readouterr().err
    assert f"--robot {plate} is given, and {folder} is of the paper's robot with the leg {leg}" in (
        told
    )
    assert "--afresh" in told
    # A verb that takes another design besides says whose the rest is, and names no flag for it.
    assert run(f"fabricate {folder} --robot {plate} --out {tmp_path / 'out'}".split()) == 1
    told = capsys.readouterr().err
    assert f"{folder} (published damping) (yours: --robot)" in told
    assert f"(--robot {plate} is given, what it does not say is of {folder}" in told


def test_a_verb_says_what_it_takes_over_and_what_flags_change(
    tmp_path: Path, asked: Ask, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = learned(tmp_path / "run", physics={"damping": "objective"})
    asked(f"evaluate {folder}")
    said = f"leg and physics of {folder} (objective damping)"
    assert said in capsys.readouterr().err.splitlines()
    summaries = list(tmp_path.glob("out*/summary.json"))
    assert json.loads(summaries[0].read_text())["taken_over_from"] == str(folder)
    anew = "--physics.damping published --physics.friction 1.2 --pair-count 1 --record"
    asked(f"evaluate {folder} {anew} --randomize")
    # What is said anew counts where it differs, and where the run has a say.
    assert f"{said} (yours: --physics.damping)" in capsys.readouterr().err.splitlines()
    options = replace(
        TrainingOptions(), randomize=True, randomisation=Randomisation(friction="0.4")
    )
    drawn = write_run(tmp_path / "drawn", "coopt", options)
    for command in ("certify {} --world-count 8", "evaluate {} --randomize"):
        asked(f"{command.format(drawn)} --randomisation.friction 0.3")
        told = capsys.readouterr().err.splitlines()
        line = next(each for each in told if each.startswith("leg, physics and worlds of"))
        assert line.endswith(" (yours: --randomisation.friction)")
    asked(f"evaluate {folder} --afresh")
    assert "leg and physics" not in capsys.readouterr().err
    asked(f"search --run {folder}")
    assert "leg, physics, worlds, task and designs of" in capsys.readouterr().err


def test_periodic_walks_are_compared_where_finite_elements_have_walked(
    tmp_path: Path, asked: Callable[[str], Any]
) -> None:
    def count(flags: str) -> int:
        found: int = asked(f"compare {flags}").comparison.periodic_count
        return found

    assert count("") == 8
    assert count("--preset quick") == 0
    assert count("--physics published") == 0
    assert count("--physics published --periodic-count 2") == 2
    for same in ("--threads 1", "--physics measured", "--full.thread-count 2 --leg measured",
                 "--executor.process-count 1 --physics.friction 0.55"):  # fmt: skip
        assert count(same) == 8
    assert count("--physics.friction 0.56 --threads 1") == 0
    file = tmp_path / "asked.json"
    other = {"robot": {"physics": {"friction": 0.56}}}
    for said, wanted in ((other, 0), ({**other, "comparison": {"periodic_count": 8}}, 8)):
        file.write_text(json.dumps(said))
        assert count(f"--settings {file}") == count(f"--settings {file} --threads 1") == wanted


def test_a_gait_of_ones_own_beside_a_number_of_regulators_is_no_experts() -> None:
    four = {"robot": {"physics": {"regulator_count": 4}}}
    walk = layered(SimulateOptions(), [four, {"walk": {"gait": "g.csv"}}]).walk
    assert walk.expert.regulator_count == ExpertGait().regulator_count
    assert layered(SimulateOptions(), [four]).walk.expert.regulator_count == 4
