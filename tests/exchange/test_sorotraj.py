"""sorotraj files: every way to write a trajectory, and gaits written and read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.exchange.conversion import ConversionSettings, convert
from pneumorph.exchange.sorotraj import SWITCH_S, read_sorotraj, write_sorotraj
from pneumorph.gait.gait_file import gait_remarks, read_gait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.interpolated_gait import InterpolatedGait

pytest.importorskip("yaml")

DIRECT = """settings: {traj_type: direct}
config:
  setpoints:
    main: [[0.0, 10, 0], [1.0, 30, 20], [2.0, 10, 0]]
    prefix: [[0.0, 0, 0], [1.0, 10, 0]]
    suffix: [[0.0, 10, 0], [1.0, 0, 0]]
"""


def _read(text: str, path: Path, **options: float) -> InterpolatedGait:
    (path / "gait.yaml").write_text(text)
    return read_sorotraj(path / "gait.yaml", **options)  # type: ignore[arg-type]


def test_prefix_main_and_suffix_follow_one_another(tmp_path: Path) -> None:
    gait = _read(DIRECT, tmp_path, repetitions=2)
    assert gait.duration_s == 6.0
    for time_s, expected in [(0.5, [5, 0]), (1.5, [20, 10]), (2.0, [30, 20]), (4.0, [30, 20]),
                             (5.5, [5, 0])]:  # fmt: skip
        np.testing.assert_allclose(gait.pressure_kPa(time_s), expected)


def test_psi(tmp_path: Path) -> None:
    gait = _read(
        DIRECT.replace("30", "5").replace("10", "1").replace("20", "2"),
        tmp_path,
        kPa_per_unit=6.894757,
    )
    np.testing.assert_allclose(gait.pressure_kPa(2.0)[0], 34.47, atol=0.01)


def test_a_gait_in_psi_reads_back(tmp_path: Path) -> None:
    gait = HeldGait.evenly(np.array([[68.94757, 0.0], [34.473785, 6.894757]]), 1.0)
    path = write_sorotraj(tmp_path / "psi.yaml", gait, kPa_per_unit=6.894757)
    assert "[0.0, 10.0, 0.0]" in path.read_text()
    assert "# pressures in units of 6.89476 kPa" in path.read_text()
    read = read_sorotraj(path, 6.894757)
    # It says so itself, and contradicts whoever says otherwise.
    np.testing.assert_array_equal(read_sorotraj(path).waypoint_kPa, read.waypoint_kPa)
    with pytest.raises(ValueError, match=r"a unit of its pressures is 6\.89476 kPa, got 1:"):
        read_sorotraj(path, 1.0)
    np.testing.assert_allclose(read.pressure_kPa(1.5), [34.473785, 6.894757], rtol=1e-12)


def test_a_held_gait_that_is_repeated_jumps_where_it_begins_again(tmp_path: Path) -> None:
    """From what it ends with to what it begins with, and not along a line for a whole second."""
    gait = HeldGait.evenly(np.array([[90.0, 0.0], [0.0, 90.0]]), 1.0)
    path = write_sorotraj(tmp_path / "held.yaml", gait)
    read = read_sorotraj(path, repetitions=3)
    assert read.duration_s == pytest.approx(6.0)
    for time_s in (0.5, 1.5, 2.1, 2.5, 3.5, 4.5, 5.5):
        np.testing.assert_allclose(read.pressure_kPa(time_s), gait.pressure_kPa(time_s % 2.0))


def test_a_gait_in_another_unit_is_refused(tmp_path: Path) -> None:
    in_bar = DIRECT.replace("10", "0.1").replace("20", "0.2").replace("30", "0.3")
    with pytest.raises(ValueError, match=r"go up to 0\.3 kPa, expected 1 kPa or more"):
        _read(in_bar, tmp_path)


def test_a_design_stays_with_its_gait(tmp_path: Path) -> None:
    held = HeldGait.evenly(np.array([[40.0, 0.0, 0.0]]), 1.0)
    yaml = write_sorotraj(tmp_path / "g.yaml", held, {"design": "1.0.0.2"}, kPa_per_unit=6.894757)
    for to in ("csv", "sorotraj"):
        convert(str(yaml), ConversionSettings(to=to), RunFolder(tmp_path / to, "exchange"))
    assert read_gait(tmp_path / "csv" / "gait.csv")[1] == {"design": "1.0.0.2"}
    assert gait_remarks(tmp_path / "sorotraj" / "gait.yaml")["design"] == "1.0.0.2"
    read = read_sorotraj(tmp_path / "sorotraj" / "gait.yaml")
    assert read.pressure_kPa(0.5)[0] == pytest.approx(40.0)


def test_cubic_goes_through_its_waypoints(tmp_path: Path) -> None:
    text = """settings: {traj_type: interp}
config:
  interp_type: cubic
  subsample_num: 40
  setpoints: {main: [[0, 40], [1, 60], [2, 40], [3, 20], [4, 40]], prefix: , suffix: }
"""
    gait = _read(text, tmp_path)
    waypoints = [gait.pressure_kPa(t)[0] for t in range(5)]
    np.testing.assert_allclose(waypoints, [40, 60, 40, 20, 40], atol=1e-9)
    # A sampled periodic spline through a sine's extremes is near the sine.
    assert gait.pressure_kPa(0.5)[0] == pytest.approx(40 + 20 * np.sin(np.pi / 4), abs=0.5)


@pytest.mark.parametrize(
    ("kind", "quarter", "half"),
    [
        ("sin", 60.0, 40.0),
        ("cos-down", 40.0, 60.0),
        ("triangle", 40.0, 60.0),
        ("square", 20.0, 60.0),
    ],
)
def test_wave_forms(kind: str, quarter: float, half: float, tmp_path: Path) -> None:
    text = f"""settings: {{traj_type: waveform}}
config: {{subsample_num: 80, num_cycles: 2, channels: [1, 0], waveform_type: {kind},
  waveform_freq: 0.25, waveform_max: [60, 50], waveform_min: [20, 10],
  setpoints: {{main: , prefix: , suffix: }}}}
"""
    gait = _read(text, tmp_path)
    assert gait.duration_s == 8.0
    for cycle in (0.0, 4.0):
        np.testing.assert_allclose(gait.pressure_kPa(cycle + 1.0), [quarter, 0.0], atol=1e-9)
        np.testing.assert_allclose(gait.pressure_kPa(cycle + 2.0), [half, 0.0], atol=1e-9)


def test_a_held_gait_reads_back_but_for_its_switches(tmp_path: Path) -> None:
    held = HeldGait.evenly(np.array([[90.0, 0, 10], [0, 45.5, 10], [0, 45.5, 90]]), 1.0)
    path = write_sorotraj(tmp_path / "gait.yaml", held, {"design": "1.0.0.2.2.0.0.1"})
    read = read_sorotraj(path)
    assert read.duration_s == held.duration_s
    for time_s in np.arange(0.0, 3.0, 0.01):
        if (time_s % 1.0) < 1.0 - SWITCH_S:
            np.testing.assert_array_equal(read.pressure_kPa(time_s), held.pressure_kPa(time_s))


@pytest.mark.parametrize("hold_s", [1e-3, 5e-4])
def test_short_holds_read_back_but_for_half_of_them(hold_s: float, tmp_path: Path) -> None:
    held = HeldGait.evenly(np.array([[90.0, 0.0], [0.0, 45.0], [10.0, 90.0]]), hold_s)
    path = write_sorotraj(tmp_path / "gait.yaml", held)
    for repetitions in (1, 2):
        read = read_sorotraj(path, repetitions=repetitions)
        assert read.duration_s == pytest.approx(repetitions * held.duration_s)
        for number in range(3):
            # In the first half a command that begins is held, but where a repetition jumps to it.
            for time_s in (number + 0.25) * hold_s + held.duration_s * np.arange(repetitions):
                jumps = number == 0 and time_s > held.duration_s
                at = time_s + (0.25 * hold_s if jumps else 0.0)
                np.testing.assert_allclose(read.pressure_kPa(at), held.held_kPa[number], atol=1e-6)


def test_a_main_part_that_begins_before_zero_is_repeated_whole(tmp_path: Path) -> None:
    text = """settings: {traj_type: direct}
config: {setpoints: {main: [[-1, 10], [1, 40], [2, 10]]}}
"""
    gait = _read(text, tmp_path, repetitions=2)
    np.testing.assert_array_equal(gait.time_s, [0.0, 2.0, 3.0, 5.0, 6.0])
    np.testing.assert_array_equal(gait.waypoint_kPa[:, 0], [10.0, 40.0, 10.0, 40.0, 10.0])


@pytest.mark.parametrize("way", ["linear", "none", "None", "~"])
def test_lines_are_straight_where_nothing_else_is_said(way: str, tmp_path: Path) -> None:
    text = DIRECT.replace("direct", "interp").replace("config:", f"config:\n  interp_type: {way}")
    np.testing.assert_array_equal(
        _read(text, tmp_path).waypoint_kPa, _read(DIRECT, tmp_path).waypoint_kPa
    )


def test_an_interpolated_gait_reads_back_to_the_bit(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    gait = InterpolatedGait(np.arange(8.0) / 3.0, 90.0 * rng.random((8, 3)))
    read = read_sorotraj(write_sorotraj(tmp_path / "gait.yaml", gait))
    np.testing.assert_array_equal(read.time_s, gait.time_s)
    np.testing.assert_array_equal(read.waypoint_kPa, gait.waypoint_kPa)
    held = gait.held(0.1)
    assert held.duration_s == gait.duration_s
    np.testing.assert_allclose(held.pressure_kPa(0.32), gait.pressure_kPa(0.35))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("- 1\n", "is not a sorotraj trajectory"),
        (DIRECT.replace("30", "300"), "expected a finite number from 0 to 90"),
        (DIRECT.replace("direct", "magic"), "traj_type is 'magic'"),
        (DIRECT.replace("direct", "interp").replace("config:", "config:\n  interp_type: quintic"),
         "interp_type is 'quintic', expected linear, cubic or none"),
        (DIRECT.replace("[1.0, 30, 20]", "[0.0, 30, 20]"), "expected rising ones"),
        (f"{DIRECT}config: {{}}\n", "'config' stands twice in one table, expected once"),
        (DIRECT.replace("[1.0, 30, 20]", "[.nan, 30, 20]"), "expected rising ones"),
    ],
)  # fmt: skip
def test_what_is_no_trajectory_is_refused(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=message):
        _read(text, tmp_path)
