"""Verbs with a robot's file that is in nothing like the paper's: four sites, legs of two chambers
in two sizes, five regulators. Nothing may take it for the paper's."""

from __future__ import annotations

import json
from dataclasses import replace
from math import comb
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.described_robot import DESIGN, write_described_robot
from helpers.run_folders import write_run
from helpers.run_json import run_json

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.layers import layered
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.cli import run
from pneumorph.command.deploy import DeployOptions
from pneumorph.command.simulate import SimulateOptions
from pneumorph.exchange.sorotraj import write_sorotraj
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.gait_file import read_gait, write_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.pressure import PressureMap
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.design import Design
from pneumorph.study import deployed_gait
from pneumorph.study.analysis import Walker, analysed_robot
from pneumorph.study.gait_source import find_gait, names_no_design, robot_of_source
from pneumorph.study.recorded_walk import recorded_walk
from pneumorph.study.search_options import SearchOptions
from pneumorph.study.search_settings import searched_designs
from pneumorph.study.training_options import quick_training

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = "--expert.duration-s 1 --expert.period-s 1"


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The robot's file."""
    return write_described_robot(tmp_path_factory.mktemp("robot"))


def test_the_pressures_of_a_part_of_ones_own_are_the_physics(robot: Path) -> None:
    """A file that names no leg of the catalogue says by its physics how its part is inflated."""
    spec = RobotDescription.read(robot).spec()
    assert spec.physics.pressure_map == PressureMap(1.5, 2.0)
    named = robot.with_name("named.toml")
    text = robot.read_text()
    named.write_text(text.replace('part = "leg.npz"', 'part = "leg.npz"\nleg = "measured"'))
    with pytest.raises(ValueError, match=r"pressure map of slope 1 .* physics has 1\.5"):
        RobotDescription.read(named).spec()


def test_options_for_other_cavities_than_a_module_has_are_refused_as_they_are_read() -> None:
    plate = RobotDescription.read(EXAMPLES / "plate.toml")
    options = ("0 *+*", "0 *", "0 *", "0 *", "0 *", "0 *+*")
    other = replace(plate, designs=replace(plate.designs, options=options, usual=None))
    with pytest.raises(ValueError, match=r"designs\.options\[0\] gives 2 regulators to long"):
        other.spec()


def test_the_experts_gait_walks_at_every_phase(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = f"baseline --robot {robot} --phase-step-deg 90 --gait.duration-s 1 --gait.period-s 1"
    out = robot.parent / "baseline"
    assert run_json(f"{asked} --out {out}", capsys)["phases_deg"] == [0, 90, 180, 270]
    half = run_json(f"{asked} --last-phase-deg 180 --out {out}", capsys)
    assert half["phases_deg"] == [0, 90, 180]
    at_an_end = half["baseline_best_phase_deg"] in (0, 180)
    assert any("at an end of those that were tried" in each for each in half["notes"]) == at_an_end


def test_bench_draws_its_own_designs(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = run_json(
        f"bench engine --robot {robot} --robot-count 3 --action-count 1 --action-steps 5 "
        f"--settling-steps 1 --threads 1 --out {robot.parent / 'bench'}",
        capsys,
    )
    assert found["robots"] == 3
    assert found["modes"] == 4
    kept = json.loads((robot.parent / "bench" / "settings.json").read_text())
    assert kept["design"] == DESIGN
    assert kept["space"]["regulator_count"] == kept["expert"]["regulator_count"] == 5


def test_explore_shows_its_designs(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = run_json(f"explore --robot {robot} --out {robot.parent / 'explorer'}", capsys)
    assert found["design_count"] == len(RobotDescription.read(robot).space)
    page = Path(found["page"]).read_text()
    assert f"--robot {robot} --design DESIGN" in page
    learned = write_run(robot.parent / "learned", "coopt", quick_training())
    assert run(["explore", str(learned), "--robot", str(robot)]) == 1
    assert "beside the run" in capsys.readouterr().err


def test_a_flag_changes_the_designs_of_the_file_and_not_those_of_the_paper(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nine legs are too many for the paper's eight locations, and not for ten sites."""
    angles = np.arange(10) * 36.0 + 18.0
    sites = "".join(
        f"[[sites]]\nposition_mm = [{x:.2f}, {y:.2f}, 36]\nyaw_deg = {angle}\npitch_deg = 15\n"
        for angle, x, y in zip(
            angles,
            126.5 * np.cos(np.radians(angles)),
            126.5 * np.sin(np.radians(angles)),
            strict=True,
        )
    )
    file = tmp_path / "ring.toml"
    file.write_text(
        'name = "ring"\n[physics]\nbased_on = "measured"\nregulator_count = 2\n'
        '[hub]\nshape = "disk"\nradius_mm = 125\ntop_radius_mm = 125\nheight_mm = 12\n'
        'bottom_mm = 30\ndensity_g_per_ml = 0.3\n[modules.long]\nleg = "measured"\n'
        f"{sites}[designs]\nminimum_legs = 4\nmaximum_legs = 5\n"
    )
    found = run_json(
        f"explore --robot {file} --space.maximum-legs 9 --out {tmp_path / 'page'}", capsys
    )
    # Names of two regulators are alike, so half of all assignments.
    expected = sum(comb(10, legs) * 2 ** (legs - 1) for legs in range(4, 10))
    assert found["design_count"] == expected
    with pytest.raises(SystemExit):
        run(["explore", "--robot", str(file), "--space.maximum-legs", "11"])
    assert "from 4 to 11 on 10 locations" in capsys.readouterr().err


def test_search_tells_the_damping_that_parts_bring(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Made with polar rotations, in a file that names no damping."""
    path = write_described_robot(tmp_path)
    part = ReducedPart.load(tmp_path / "leg.npz")
    polar = {**part.metadata, "settings": {"rotation": "polar"}}
    replace(part, metadata=polar).save(tmp_path / "leg.npz")
    path.write_text(path.read_text().replace('damping = "objective"\n', ""))
    found = run_json(
        f"search --method random --timesteps 10 --task.action-count 5 --environment-count 4 "
        f"--random.population 2 --robot {path} "
        f"--out {tmp_path / 'search'}",
        capsys,
    )
    assert any("goes with the polar rotations of modules.long" in note for note in found["notes"])


def test_deploy_drives_as_many_regulators_as_it_has(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its usual design by the expert's gait, each channel of the virtual rig one regulator."""
    out = robot.parent / "deployed"
    found = run_json(
        f"deploy --robot {robot} --model reduced --trials 1 {SHORT} --out {out}", capsys
    )
    assert found["design"] == DESIGN
    assert len(found["rig"]["channels"]) == 5
    gait, comments = read_gait(out / "schedule.csv")
    assert gait.regulator_count == 5
    assert comments["design"] == DESIGN
    compared = run_json(
        f"transfer {out} --robot {robot} --model reduced --step-s 0.5 --cycle-s 1 "
        f"--out {robot.parent / 'transfer'}",
        capsys,
    )
    assert compared["robots"][0]["design"] == DESIGN


def test_a_line_of_pressures_is_fitted_whatever_its_legs_are(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The summary names all of its legs; bends would be those of one."""
    pairs = robot.with_name("pairs.csv")
    pairs.write_text("real_pressure_kPa,simulated_pressure_kPa\n0,1\n10,16\n20,31\n")
    out = robot.parent / "calibrated"
    found = run_json(f"calibrate --robot {robot} --pairs {pairs} --out {out}", capsys)
    assert found["slope"] == pytest.approx(1.5)
    assert found["leg"]["part"] == "long"
    assert list(found["leg"]["others"]) == ["short"]


def test_an_analysis_knows_where_its_legs_are(robot: Path) -> None:
    """Where each points, and what drives its chambers."""
    spec, design = RobotDescription.read(robot).spec(thread_count=1), Design.parse(DESIGN)
    gait = HeldGait.evenly(np.full((2, 5), 10.0), 0.1)
    walked = recorded_walk(spec, design, gait, record_every=2, settling_steps=0)
    found = analysed_robot(Walker("L1", design, gait, 0), walked, spec, 0.1, 0.2)
    assert [leg.angle_deg for leg in found.legs] == [0.0, 90.0, 180.0, 270.0]
    assert [leg.regulators for leg in found.legs] == [(1, 2), (3,), (4, 5), (3,)]


def test_a_bend_test_of_several_kinds_of_legs_is_refused(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["deploy", "--robot", str(robot), "--bend-test", "--model", "reduced"]) == 1
    refusal = capsys.readouterr().err
    assert "modules long, short, expected one kind" in refusal
    assert "describe a robot with that leg at all of its sites" in refusal


def test_a_gait_of_its_run_has_its_own_design(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The usual design and the expert's regulators are for where no run says what walks."""
    options = layered(quick_training(), [{"robot": {"described": str(robot)}}])
    design = "1+2.3.b1+2.0"
    folder = write_run(robot.parent / "walked", "coopt", options, (design,))
    gait = HeldGait.evenly(np.full((2, 5), 10.0), 0.5)
    write_gait(folder / "training/gaits/L1.csv", gait, {"design": design})
    dry = run_json(f"deploy {folder} --dry-run --out {robot.parent / 'dry'}", capsys)
    assert dry["design"] == design
    kept = json.loads((robot.parent / "dry" / "settings.json").read_text())
    assert kept["robot"]["described"] == str(robot)
    walked = run_json(f"simulate --gait {folder} --out {robot.parent / 'walk'}", capsys)
    assert walked["design"] == design


def test_worlds_of_a_robots_file_are_drawn_in_trainings_and_told_where_one_walks(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A published robot with worlds is trained in them; where one robot walks, they are named."""
    drawn = robot.with_name("drawn.toml")
    drawn.write_text(robot.read_text() + '[randomisation]\nfriction = "U(0.4, 0.7)"\n')
    asked = [{"robot": {"described": str(drawn)}}]
    training = layered(quick_training(), asked)
    assert training.randomize
    assert training.randomisation.friction == "U(0.4, 0.7)"
    assert layered(SearchOptions(), asked).randomisation.friction == "U(0.4, 0.7)"
    out = robot.parent / "nominal"
    found = run_json(f"simulate --robot {drawn} {SHORT} --out {out}", capsys)
    (note,) = found["notes"]
    assert f"in the world as it stands: [randomisation] of {drawn}" in note
    drawn.write_text(robot.read_text() + '[randomisation]\nfrictoin = "1"\n')
    with pytest.raises(ArtefactError, match=rf"{drawn}: .*frictoin: did you mean friction\?"):
        RobotDescription.read(drawn)


def test_without_a_usual_design_it_is_told_which_walks(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nameless = robot.with_name("nameless.toml")
    nameless.write_text(robot.read_text().replace(f'usual = "{DESIGN}"\n', ""))
    design = RobotDescription.read(nameless).usual_design
    assert 0 not in Design.parse(design).assignment
    for verb in ("simulate", "deploy --dry-run"):
        out = robot.parent / verb.split()[0]
        assert run(f"{verb} --robot {nameless} {SHORT} --out {out}".split()) == 0
        assert f"[designs] names no usual design; {design} walks" in capsys.readouterr().err
    assert json.loads((robot.parent / "simulate/summary.json").read_text())["notes"]


def test_a_search_of_gaits_has_the_usual_design(robot: Path) -> None:
    asked = layered(SearchOptions(), [{"robot": {"described": str(robot)}}])
    designs = searched_designs(asked.search, None)
    assert designs[asked.search.space.index(Design.parse(DESIGN))] == "expert's design"


def test_it_is_told_how_long_finite_elements_take(
    robot: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(deployed_gait, "_virtual_trials", lambda planned, *_: planned)
    for model, told in (("full", True), ("reduced", False)):
        out = robot.parent / f"deploy_{model}"
        command = f"deploy --robot {robot} --model {model} --trials 2 --out {out}"
        assert run(command.split()) == 0
        said = capsys.readouterr().err
        assert ("about 10 min for each of 2 trials of 20 s" in said) == told
        assert ("--model reduced takes seconds" in said) == told


def test_a_policy_of_a_run_walks_in_the_robot_of_the_run(robot: Path) -> None:
    """Its file lies in the run, whose robot is not the paper's."""
    options = layered(quick_training(), [{"robot": {"described": str(robot)}}])
    folder = write_run(robot.parent / "trained", "coopt", options, (DESIGN,))
    (folder / "training" / "policy.npz").write_bytes(b"")
    taken = robot_of_source(folder / "training" / "policy.npz")
    assert taken is not None
    assert taken.settings["robot"]["described"] == str(robot)
    assert robot_of_source(robot.with_name("policy.npz")) is None
    (folder / "summary.json").unlink()
    with pytest.raises(ArtefactError, match=r"summary\.json"):
        robot_of_source(folder / "training" / "policy.npz")


@pytest.mark.parametrize("name", ["gait.csv", "gait.yaml"])
def test_a_gait_that_names_no_design_is_the_robots_usual_one(name: str, tmp_path: Path) -> None:
    """Of a robot's file, not of the paper's robot; both formats may name theirs."""
    gait, path = HeldGait.evenly(np.full((2, 4), 20.0)), tmp_path / name
    write: Any = write_gait if name == "gait.csv" else write_sorotraj
    write(path, gait)
    assert names_no_design(path)
    asked = {"robot": {"described": str(EXAMPLES / "plate.toml")}}
    walks = layered(SimulateOptions(), [{**asked, "walk": {"gait": str(path)}}])
    usual = RobotDescription.read(EXAMPLES / "plate.toml").usual_design
    assert walks.walk.design == usual
    assert layered(DeployOptions(), [{**asked, "source": str(path)}]).deployment.design == usual
    write(path, gait, {"design": "1.2.0.0.3.4"})
    assert not names_no_design(path)
    walks = layered(SimulateOptions(), [{**asked, "walk": {"gait": str(path)}}])
    assert walks.walk.design is None
    assert str(find_gait(path, None, ExpertGait()).design) == "1.2.0.0.3.4"
