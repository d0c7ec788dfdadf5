"""Verbs around a rig: small runs of each, and what they refuse."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from helpers.published_pairs import PAPER_PAIRS
from helpers.run_json import run_json

from pneumorph.catalogue.leg_kinds import LegName, pressure_map
from pneumorph.cli import run
from pneumorph.command.deploy import DeployOptions
from pneumorph.gait.gait_file import read_gait
from pneumorph.hardware.bend_staircase import BendTestSettings
from pneumorph.hardware.marker_track import MarkerTrack, read_track, write_track
from pneumorph.hardware.parameter_fit import ParameterFitSettings
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA
from pneumorph.physics.pressure import PressureMap
from pneumorph.study.deployment_settings import DeploymentSettings

SHORT = "--expert.duration-s 1 --expert.period-s 1"


def _refused(command: str, capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert run(command.split()) == 1
    return capsys.readouterr().err.splitlines()[-1]


@pytest.fixture(scope="module")
def calibration(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("calibration")
    (folder / "pairs.csv").write_text(PAPER_PAIRS)
    assert run(f"calibrate --pairs {folder / 'pairs.csv'} --out {folder / 'c'}".split()) == 0
    return folder / "c" / "calibration.json"


def test_calibrate_pairs_gives_the_papers_line(calibration: Path) -> None:
    summary = json.loads((calibration.parent / "summary.json").read_text())
    assert summary["slope"] == pytest.approx(4.0785, abs=1e-4)
    assert summary["intercept_kPa"] == pytest.approx(-20.361, abs=5e-3)
    low, high = summary["confidence_intervals_95"]["slope"]
    assert low < 4.0785 < high
    assert (calibration.parent / "calibration.png").stat().st_size > 5000


def test_deploy_and_transfer_on_the_virtual_rig(
    calibration: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    deployed = run_json(
        f"deploy --physics published --model reduced {SHORT} --trials 2 "
        f"--calibration {calibration} --out {tmp_path / 'B'}",
        capsys,
    )
    assert deployed["calibration"]["file"] == str(calibration)
    assert deployed["calibration"]["slope"] == pytest.approx(4.0785, abs=1e-4)
    assert [trial["completed"] for trial in deployed["trials"]] == [True, True]
    assert all(trial["vented"] for trial in deployed["trials"])
    gait, comments = read_gait(tmp_path / "B" / "schedule.csv")
    assert comments["design"] == deployed["design"]
    assert gait.duration_s == 1.0
    compared = run_json(
        f"transfer --physics published B={tmp_path / 'B'} --cycle-s 1 --step-s 0.5 "
        f"--out {tmp_path / 't'}",
        capsys,
    )
    (robot,) = compared["robots"]
    assert robot["distances_cm"] == pytest.approx(
        [trial["distance_cm"] for trial in deployed["trials"]], abs=0.05
    )
    assert compared["calibration"]["file"] == "the published line"
    # Which the calibration's is: it walks next to nowhere, and that is all there is to note.
    assert ["no ratio to so little" in note for note in compared["notes"]] == [True]
    assert len(robot["mean_reward_per_step_cm"]) == 2
    for figure in compared["figures"]:
        assert Path(figure).stat().st_size > 5000
    other = f"transfer B={tmp_path / 'B'} --cycle-s 1 --step-s 0.5 --out {tmp_path / 'other'}"
    assert run(other.split()) == 0
    said = "deployed in the published physics and is simulated in the measured one"
    assert said in capsys.readouterr().err
    notes = json.loads((tmp_path / "other" / "summary.json").read_text())["notes"]
    assert said in notes[0]
    assert f"B was deployed with {calibration} (slope 4.079, intercept -20.36 kPa)" in notes[1]


def test_a_fit_of_trials_of_something_else_is_no_calibration(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As of a camera that stood on its head."""
    out = tmp_path / "B"
    asked = f"deploy --physics published --model reduced {SHORT} --trials 1 --out {out}"
    assert run(asked.split()) == 0
    file = out / "trial_1" / "track.csv"
    seen = read_track(file)
    write_track(file, MarkerTrack(seen.time_s, -seen.position_mm))
    told = _refused(
        f"calibrate --physics published --trials {out} --fit.names friction "
        f"--fit.search-count 1 --fit.evaluation-limit 1 --out {tmp_path / 'c'}",
        capsys,
    )
    assert re.search(r"r_squared is -?\d\.\d\d, expected 0\.5 or more", told)
    assert "--video.heading-deg" in told
    assert not (tmp_path / "c").exists()


def test_pages_read_another_program_s_track_as_transfer_did(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A table of pixels of a camera that began earlier; the deployment's page does not know them
    and leaves the path out."""
    out = tmp_path / "B"
    asked = f"deploy --physics published --model reduced {SHORT} --trials 1 --out {out}"
    assert run(asked.split()) == 0
    seen = read_track(out / "trial_1" / "track.csv")
    rows = np.column_stack([seen.time_s + 30.0, 5.0 * seen.position_mm])
    table = "\n".join(f"{t:.4f},{x:.4f},{y:.4f}" for t, x, y in rows)
    (out / "trial_1" / "track.csv").write_text(f"t,x,y\n{table}\n")
    video = "--video.units-per-mm 5 --video.start-s 30"
    compared = f"transfer --physics published B={out} --cycle-s 1 --step-s 0.5 {video}"
    assert run([*compared.split(), "--out", str(tmp_path / "t")]) == 0
    for run_folder in (out, tmp_path / "t"):
        page = tmp_path / f"page_{run_folder.name}"
        asked = f"report {run_folder} --figure-files --out {page}"
        assert run(asked.split()) == 0, capsys.readouterr().err
    assert "below, the marker" not in (tmp_path / "page_B" / "page.html").read_text()
    assert "B trial 1" in (tmp_path / "page_t" / "page.html").read_text()
    bends = tmp_path / "bends"
    asked = f"deploy --bend-test --physics published --model reduced --out {bends}"
    assert run(asked.split()) == 0
    assert "is a bend test" in _refused(f"transfer {bends} --out {tmp_path / 'x'}", capsys)


def test_a_rig_whose_supply_the_gait_exceeds_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A supply in psi or bar, where the rig's file tells of its own air."""
    rig = tmp_path / "rig.toml"
    rig.write_text('[air]\nlaw = "orifice"\nsupply_kPa = 20.0\n')
    assert run(f"deploy --dry-run {SHORT} --rig {rig} --out {tmp_path / 'd'}".split()) == 1
    said = capsys.readouterr().err
    assert f"rig file {rig}: a command asks for" in said
    assert "from a supply of 20 kPa" in said


def test_a_bend_test_of_a_robot_that_has_no_design_is_planned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = Path(__file__).parent.parent.parent / "examples" / "two_chambers.toml"
    asked = f"deploy --dry-run --bend-test --robot {robot} --out {tmp_path / 'd'}"
    assert run_json(asked, capsys)["verb"] == "deploy"


def test_parameters_are_fitted_to_trials(
    calibration: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the fit finds is tested in test_virtual_rig.py; here, that the verb writes it down."""
    run_json(
        f"deploy --physics published --model reduced {SHORT} --trials 1 --out {tmp_path / 'B'}",
        capsys,
    )
    fitted = run_json(
        f"calibrate --physics published --trials {tmp_path / 'B'} "
        f"--calibration {calibration} --fit.names friction "
        f"--fit.search-count 1 --fit.evaluation-limit 3 --out {tmp_path / 'c'}",
        capsys,
    )
    said = " ".join(fitted["fit"]["trajectories"]["notes"])
    assert fitted["slope"] == pytest.approx(4.0785, abs=1e-4)  # kept from the file
    low, high = fitted["confidence_intervals_95"]["friction"]
    assert low < fitted["friction"] < high
    assert fitted["modulus_factor"] is None
    quality = fitted["fit"]["trajectories"]
    assert quality["rms_mm"] <= quality["start_rms_mm"]
    assert quality["r_squared"] > 0.5
    assert quality["notes"] == [] if quality["converged"] else "come to their end" in said
    source = json.loads((tmp_path / "c" / "calibration.json").read_text())["source"]
    assert source["trajectories"]["trials"] == ["trial_1"]
    assert (tmp_path / "c" / "path_fit.png").stat().st_size > 1000
    assert source["pressure"]["measured"].endswith("pairs.csv")


def test_valves_are_fitted_to_logs_and_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the fit finds is tested in test_air_fit.py; here, that verbs hand it on."""
    gait = tmp_path / "steps.csv"
    rows = "".join(f"{1.32 * n},{80 * (n % 2)},{80 * (n % 2)},0\n" for n in range(5))
    header = "time_s,regulator_1_kPa,regulator_2_kPa,regulator_3_kPa\n"
    gait.write_text(f"{header}{rows}6.6,0,0,0\n")
    (tmp_path / "rig.toml").write_text("sample_interval_s = 0.02\n")
    asked = f"{gait} --design 1.0.0.2.2.0.0.1 --rig {tmp_path / 'rig.toml'} --model reduced"
    deployed = run_json(
        f"deploy {asked} --physics.air.law orifice --trials 1 --out {tmp_path / 'B'}", capsys
    )
    assert deployed["rig"]["air"]["law"] == "orifice"
    assert deployed["rig"]["chambers_mm3"] == pytest.approx([7056.0, 7056.0, 0.0])
    fitted = run_json(f"calibrate --air {tmp_path / 'B'} --out {tmp_path / 'c'}", capsys)
    for kind, believed in (("filling", 78.0), ("venting", 1100.0)):
        found = fitted[f"{kind}_mm3_per_s_kPa"]
        for number in (1, 2):
            low, high = fitted["confidence_intervals_95"][f"{kind}_{number}_mm3_per_s_kPa"]
            assert low < found[number - 1] < high
            assert abs(found[number - 1] / believed - 1.0) < 0.35  # the draws' limit, and noise
        assert found[2] == believed
    assert fitted["fit"]["air"]["rms_kPa"] < 0.3
    # Of the third valve nothing was learned, so worlds stay as wide as they were.
    assert fitted["measured"] == {}
    bench = tmp_path / "bench.csv"
    bench.write_text("test,reading\nstep up of pressure,0.9\n")
    asked = f"calibrate --air {tmp_path / 'B'} --bench {bench} --out {tmp_path / 'both'}"
    assert "readings of filling_factor, which --air fits as well" in _refused(asked, capsys)
    assert (tmp_path / "c" / "air_fit.png").stat().st_size > 1000
    file = tmp_path / "c" / "calibration.json"
    walked = run_json(f"simulate {SHORT} --calibration {file} --out {tmp_path / 's'}", capsys)
    assert walked["calibration"]["filling_mm3_per_s_kPa"] == fitted["filling_mm3_per_s_kPa"]
    dry = run_json(f"deploy --dry-run {SHORT} --calibration {file} --out {tmp_path / 'd'}", capsys)
    assert dry["rig"]["air"]["filling_mm3_per_s_kPa"] == fitted["filling_mm3_per_s_kPa"]
    # Sampled each 0.1 s, as usual, smooth commands are reached before anyone looks.
    run_json(
        f"deploy {SHORT} --physics.air.law orifice --model reduced --trials 1 "
        f"--out {tmp_path / 'seldom'}",
        capsys,
    )
    told = _refused(f"calibrate --air {tmp_path / 'seldom'} --out {tmp_path / 'n'}", capsys)
    assert "cannot tell how fast regulator" in told or "the log shows no" in told


def test_dry_run_commands_nothing_and_prints_the_schedule(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    summary = run_json(f"deploy --dry-run {SHORT} --out {tmp_path / 'd'}", capsys)
    assert summary["trials"] == []
    assert "kPa" in summary["schedule"][1]
    assert len(summary["schedule"]) == summary["command_count"] + 1
    assert not list((tmp_path / "d").glob("trial_*"))


def test_a_calibration_moves_the_gaits_pressures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A leg that needs half the slope gets the pressures that mean the same to it."""
    lines = ["real_pressure_kPa,simulated_pressure_kPa"]
    lines += [f"{p},{8.157 * p - 40.722 + 1e-6 * (p % 3)}" for p in range(10, 100, 10)]
    (tmp_path / "pairs.csv").write_text("\n".join(lines) + "\n")
    run(f"calibrate --pairs {tmp_path / 'pairs.csv'} --out {tmp_path / 'c'}".split())
    file = tmp_path / "c" / "calibration.json"
    gait = tmp_path / "gait.csv"
    gait.write_text("time_s,regulator_1_kPa,regulator_2_kPa,regulator_3_kPa\n0,40,4,0\n2,40,4,0\n")
    run_json(
        f"deploy {gait} --physics published --dry-run --calibration {file} --out {tmp_path / 'd'}",
        capsys,
    )
    planned, _ = read_gait(tmp_path / "d" / "schedule.csv")
    # 4.0785 p - 20.361 = 8.157 q - 40.722  gives  q = (p + 4.9923) / 2.
    assert planned.held_kPa[0] == pytest.approx([22.496, 4.0, 0.0], abs=1e-3)


def test_a_calibrated_gait_that_the_rig_cuts_off_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Half the slope takes twice the pressure: 4.0785 (60 kPa - 4.99) = 2 (q - 10)."""
    lines = ["real_pressure_kPa,simulated_pressure_kPa"]
    lines += [f"{p},{2.0 * p - 20.0 + 1e-6 * (p % 3)}" for p in range(10, 100, 10)]
    (tmp_path / "pairs.csv").write_text("\n".join(lines) + "\n")
    run(f"calibrate --pairs {tmp_path / 'pairs.csv'} --out {tmp_path / 'c'}".split())
    gait = tmp_path / "gait.csv"
    gait.write_text("time_s,regulator_1_kPa,regulator_2_kPa,regulator_3_kPa\n0,60,4,0\n2,60,4,0\n")
    file = tmp_path / "c" / "calibration.json"
    summary = run_json(
        f"deploy {gait} --physics published --dry-run --calibration {file} --out {tmp_path / 'd'}",
        capsys,
    )
    assert summary["highest_meant_kPa"] == pytest.approx(
        0.5 * (4.0785 * 60 - 20.361) + 10, abs=0.01
    )
    assert summary["cut_off_at_kPa"] == HIGHEST_COMMAND_KPA
    planned, _ = read_gait(tmp_path / "d" / "schedule.csv")
    assert planned.held_kPa.max() == HIGHEST_COMMAND_KPA


@pytest.mark.parametrize("leg", get_args(LegName))
def test_the_legs_own_map_as_calibration_leaves_the_experts_gait_alone(
    leg: LegName, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A gait that does not say what it was made for was made for the leg that is asked for."""
    file = Calibration(pressure_map(leg)).save(tmp_path / "calibration.json")
    command = f"deploy --dry-run --leg {leg} {SHORT}"
    usual = run_json(f"{command} --out {tmp_path / 'a'}", capsys)
    same = run_json(f"{command} --calibration {file} --out {tmp_path / 'b'}", capsys)
    assert same["schedule"] == usual["schedule"]


def test_a_gait_that_a_calibration_would_cut_to_another_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A leg that needs nearly half the slope takes nearly twice the pressure."""
    file = Calibration(PressureMap(2.0, -20.0)).save(tmp_path / "calibration.json")
    refused = _refused(
        f"deploy --physics published --dry-run {SHORT} --calibration {file} --out {tmp_path / 'd'}",
        capsys,
    )
    assert re.search(r"asks for 147\.6 kPa, expected at most 1\.5 times the limit", refused)
    assert not (tmp_path / "d" / "schedule.csv").exists()


def test_the_papers_line_is_refused_for_the_measured_leg(
    calibration: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    refused = _refused(f"simulate {SHORT} --calibration {calibration} --out {tmp_path}", capsys)
    assert "the measured leg that ships with 347 kPa" in refused
    assert "such as the published leg" in refused


def test_a_calibration_with_a_modulus_changes_the_robot(
    calibration: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = json.loads(calibration.read_text())
    (tmp_path / "stiff.json").write_text(json.dumps({**content, "modulus_factor": 1.3}))
    walk = f"simulate --physics published {SHORT}"  # whose bends were calibrated
    usual = run_json(f"{walk} --calibration {calibration} --out {tmp_path / 'a'}", capsys)
    stiff = run_json(
        f"{walk} --calibration {tmp_path / 'stiff.json'} --out {tmp_path / 'b'}", capsys
    )
    assert stiff["distance_cm"] != usual["distance_cm"]
    assert stiff["calibration"]["modulus_factor"] == 1.3
    assert stiff["calibration"]["digest"] != usual["calibration"]["digest"]


def test_gaits_are_exchanged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gait = tmp_path / "gait.csv"
    gait.write_text(
        "# design: 1.0.0.2.2.0.0.1\ntime_s,regulator_1_kPa,regulator_2_kPa\n0,40,4\n1,0,9\n2,0,9\n"
    )
    there = run_json(f"exchange {gait} --to sorotraj --out {tmp_path / 'y'}", capsys)
    assert there["duration_s"] == 2.0
    back = run_json(
        f"exchange {there['gait']} --to csv --hold-s 0.5 --out {tmp_path / 'c'}", capsys
    )
    held, _ = read_gait(back["gait"])
    assert held.held_kPa.tolist() == [[40.0, 4.0], [40.0, 4.0], [0.0, 9.0], [0.0, 9.0]]


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("calibrate", "nothing to calibrate from"),
        ("calibrate --pairs none.csv", "none.csv does not exist"),
        ("deploy --rig none.toml", "none.toml does not exist"),
        ("deploy none.csv --dry-run", "none.csv does not exist"),
        ("deploy policy.npz --dry-run", "policy.npz does not exist"),
        (
            "deploy --dry-run --expert.amplitude-kPa 48",
            "expected a finite number from 0 to 90",
        ),
        (
            "deploy --dry-run --expert.amplitude-kPa 48 --expert.maximum-pressure-kPa 100",
            "beyond the channel's hard limits",
        ),
        ("simulate --expert.amplitude-kPa 60", "a wave goes to twice its amplitude"),
        ("baseline --gait.amplitude-kPa 60", "expected a finite number from 0 to 90"),
        ("transfer B=.", "holds no trials"),
        ("fabricate 1.0.1", "3 locations, expected 8"),
        ("fabricate 0.0.0.0.0.0.0.0", "has no legs"),
        ("exchange none --to part", "modes.txt does not exist"),
        ("simulate --calibration none.json", "none.json does not exist"),
        ("evaluate . --randomize --model full", "randomize walks reduced robots only"),
    ],
)
def test_bad_input_is_refused_in_one_line(
    command: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert message in _refused(f"{command} --out {tmp_path / 'run'}", capsys)


def test_stairs_and_fits_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="highest_kPa must be"):
        BendTestSettings(highest_kPa=float("nan"))
    with pytest.raises(ValueError, match=r"source is gait\.csv, expected none with --bend-test"):
        DeployOptions(Path("gait.csv"), DeploymentSettings(bend_test=True))
    with pytest.raises(ValueError, match="expected at most highest_kPa"):
        BendTestSettings(step_kPa=100.0)
    with pytest.raises(ValueError, match=r"samples_per_s must be positive, got 0\.0"):
        ParameterFitSettings(samples_per_s=0.0)
