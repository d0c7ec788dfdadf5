"""Gaits as YAML files of sorotraj, which drive Ctrl-P pressure controllers and SoMo simulations.

A trajectory is waypoints ``[time, signal, signal, ...]`` joined by straight lines: a prefix, a main
part that can be repeated, and a suffix, each with times of its own. Three ways to write the main
part are read: ``direct``, ``interp`` (linear, cubic or none) and ``waveform``. The format and its
wave forms are described at https://sorotraj.readthedocs.io.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.base.artefact import read_text, write_text
from pneumorph.base.checked import rises
from pneumorph.base.optional_package import optional_package
from pneumorph.gait.gait_file import LIMIT, UNIT, check_peak, gait_remarks, remark_lines
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.interpolated_gait import InterpolatedGait
from pneumorph.physics.commands import HIGHEST_COMMAND_KPA

SWITCH_S = 1e-3
"""A held command is written as a straight line that lasts this long at its end [s], and no longer
than half of it."""


def read_sorotraj(
    path: Path | str, kPa_per_unit: float | None = None, repetitions: int = 1
) -> InterpolatedGait:
    """Read a trajectory. Pressures above `HIGHEST_COMMAND_KPA` are refused, unless a remark
    ``# maximum_pressure_kPa: 120`` says that it is meant to go higher, as in a CSV file.

    Args:
        path: The YAML file.
        kPa_per_unit: What one unit of the file is [kPa], 6.894757 for psi; None for what the file
            says of itself in a remark ``# kPa_per_unit: 6.894757``, and kPa where it says nothing.
        repetitions: How often the main part is run.

    Raises:
        FileNotFoundError: No such file.
        ModuleNotFoundError: PyYAML is not installed.
        ValueError: Not such a file, a pressure out of range, a unit that the file contradicts, or
            pressures that no valve holds.
    """
    path = Path(path)
    text = read_text(path, "gait")
    remarks = gait_remarks(path)
    unit_kPa = _unit_kPa(path, remarks, kPa_per_unit)
    highest_kPa = _positive_remark(path, remarks, LIMIT) or HIGHEST_COMMAND_KPA
    yaml = optional_package("yaml", "sorotraj files need PyYAML", "hardware")
    try:
        content = yaml.load(text, _named_once(yaml))  # a SafeLoader
        kind, config = str(_group(content, "settings")["traj_type"]), _group(content, "config")
        setpoints = _group(config, "setpoints") if config.get("setpoints") else {}
        parts = [_table(setpoints.get("prefix"))]
        parts += [_main(kind, config, setpoints)] * repetitions
        parts.append(_table(setpoints.get("suffix")))
        table = _joined([part for part in parts if part is not None])
        gait = InterpolatedGait(table[:, 0], unit_kPa * table[:, 1:], highest_kPa)
    except (
        yaml.YAMLError, LookupError, TypeError, ValueError, AttributeError, ArithmeticError,
        RecursionError,
    ) as error:  # fmt: skip
        raise ValueError(
            f"gait file {path} is not a sorotraj trajectory with settings.traj_type, config and "
            f"pressures in range: {_told(error)}"
        ) from error
    check_peak(path, float(gait.waypoint_kPa.max()))
    return gait


def _positive_remark(path: Path, remarks: Mapping[str, str], name: str) -> float | None:
    """A number of kPa that a file says of itself; None where it does not.

    Raises:
        ValueError: It is none, or not positive and finite.
    """
    named = remarks.get(name)
    if named is None:
        return None
    try:
        number = float(named)
    except ValueError:
        number = math.nan
    if not 0.0 < number < math.inf:
        raise ValueError(
            f"gait file {path}: {name} is {named!r}, expected a positive number of kPa"
        )
    return number


def _unit_kPa(path: Path, remarks: Mapping[str, str], asked: float | None) -> float:
    """What one unit of a file is [kPa].

    Raises:
        ValueError: It says what is no unit, or another one than is asked for.
    """
    own = _positive_remark(path, remarks, UNIT)
    if own is None:
        return 1.0 if asked is None else asked
    if asked is not None and not math.isclose(own, asked, rel_tol=1e-4):
        raise ValueError(
            f"gait file {path} says that a unit of its pressures is {own:g} kPa, got "
            f"{asked:g}: leave that out, or the remark {UNIT} if it is wrong"
        )
    return own


def write_sorotraj(
    path: Path | str,
    gait: HeldGait | InterpolatedGait,
    comments: Mapping[str, str] | None = None,
    kPa_per_unit: float = 1.0,
) -> Path:
    """Write a gait as a direct trajectory.

    Held commands switch within `SWITCH_S` at their end, for the format knows straight lines only.
    A gait whose highest pressure is not the usual one says so in a remark, as in a CSV file.

    Args:
        path: Where to write.
        gait: The gait.
        comments: Named remarks, a line each.
        kPa_per_unit: What one unit of the file is [kPa]; 6.894757 for psi.
    """
    if isinstance(gait, HeldGait):
        rows = []
        ends = [*gait.start_s[1:], gait.duration_s]
        for start, end, held in zip(gait.start_s, ends, gait.held_kPa, strict=True):
            last = end if end == gait.duration_s else end - _switch_s(end - start)
            rows += [[start, *held], [last, *held]]
        table = np.array(rows)
    else:
        table = np.column_stack([gait.time_s, gait.waypoint_kPa])
    lines = remark_lines(comments, gait.maximum_pressure_kPa, float(table[:, 1:].max()))
    table[:, 1:] /= kPa_per_unit
    unit = "kPa" if kPa_per_unit == 1.0 else f"units of {kPa_per_unit:g} kPa"
    lines += [f"# pressures in {unit}", f"# {UNIT}: {kPa_per_unit!r}"]
    lines += ["settings:", "  traj_type: direct"]
    lines += ["config:", "  setpoints:", "    main:"]
    for row in table:
        # repr is the shortest text that reads back to the same double.
        lines.append("      - [" + ", ".join(repr(float(value)) for value in row) + "]")
    lines += ["    prefix:", "    suffix:"]
    text = "\n".join(lines) + "\n"
    return write_text(path, text)


def _switch_s(held_s: float) -> float:
    """How long the switch lasts beside a command that is held so long [s]."""
    return min(SWITCH_S, 0.5 * held_s)


def _named_once(yaml: Any) -> Any:
    """A safe loader that refuses a name which stands twice in one table, where YAML's own takes the
    last."""

    class Once(yaml.SafeLoader):
        """Of one file."""

    def table(loader: Any, node: Any) -> dict[Any, Any]:
        names = [loader.construct_object(name, deep=True) for name, _ in node.value]
        twice = [name for name, count in Counter(names).items() if count > 1]
        if twice:
            raise ValueError(f"{twice[0]!r} stands twice in one table, expected once")
        content: dict[Any, Any] = yaml.SafeLoader.construct_mapping(loader, node, deep=True)
        return content

    Once.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, table)
    return Once


def _group(content: Any, name: str) -> Mapping[str, Any]:
    """A table within a table.

    Raises:
        ValueError: There is none.
    """
    if not isinstance(content, Mapping) or name not in content:
        raise ValueError(f"{name} is missing")
    group = content[name]
    if not isinstance(group, Mapping):
        raise ValueError(f"{name} is {group!r:.60}, expected a table")
    return group


def _told(error: Exception) -> str:
    """What is wrong with a file, in one line."""
    mark = getattr(error, "problem_mark", None)
    if mark is not None:
        problem = getattr(error, "problem", "it is no YAML")
        return f"{problem} in line {mark.line + 1}, column {mark.column + 1}"
    if isinstance(error, KeyError):
        return f"{error.args[0]} is missing"
    return " ".join(str(error).split())


def _table(rows: Any) -> np.ndarray | None:
    if not rows:
        return None
    table = np.array(rows, dtype=float)
    if table.ndim != 2 or table.shape[1] < 2:
        raise ValueError(f"waypoints have shape {table.shape}, expected (waypoint, 1 + signal)")
    if not rises(table[:, 0]):
        raise ValueError(f"times of waypoints are {table[:, 0].tolist()}, expected rising ones")
    return table


def _main(kind: str, config: Mapping[str, Any], setpoints: Mapping[str, Any]) -> np.ndarray:
    if kind == "waveform":
        return _waveform(config)
    table = _table(setpoints.get("main"))
    if kind not in ("direct", "interp") or table is None:
        raise ValueError(
            f"traj_type is {kind!r} with {'no' if table is None else 'a'} main part, expected "
            "direct or interp with one, or waveform"
        )
    way = str(config.get("interp_type")).lower() if kind == "interp" else "none"
    if way not in ("linear", "cubic", "none"):
        raise ValueError(
            f"interp_type is {config.get('interp_type')!r}, expected linear, cubic or none"
        )
    if way == "cubic":
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(table[:, 0], table[:, 1:], bc_type="periodic")
        times = np.linspace(table[0, 0], table[-1, 0], int(config["subsample_num"]) + 1)
        return np.column_stack([times, spline(times)])
    return table  # straight lines between the waypoints are what every reader makes of them


def _waveform(config: Mapping[str, Any]) -> np.ndarray:
    """Cycles of a wave between each signal's minimum and maximum."""
    kind, frequency = str(config["waveform_type"]), float(config["waveform_freq"])
    cycles = int(config["num_cycles"])
    channels = np.array(config["channels"], dtype=float)
    low, high = (np.array(config[f"waveform_{name}"], dtype=float) for name in ("min", "max"))
    # Phase and value of one cycle's knots; smooth waves are sampled.
    knots = {
        "triangle": ([0.0, 0.5], [-1.0, 1.0]),
        "sawtooth-f": ([0.0, 0.99], [-1.0, 1.0]),
        "sawtooth-r": ([0.0, 0.01], [-1.0, 1.0]),
        "square": ([0.0, 0.49, 0.5, 0.99], [-1.0, -1.0, 1.0, 1.0]),
    }
    if kind in knots:
        phases, values = knots[kind]
        phase = np.concatenate([c + np.array(phases) for c in range(cycles)] + [[float(cycles)]])
        value = np.concatenate([np.tile(values, cycles), [values[0]]])
    else:
        phase = np.linspace(0.0, cycles, int(config["subsample_num"]) + 1)
        turn = 2.0 * math.pi * phase
        smooth = {
            "sin": np.sin(turn),
            "cos-up": np.cos(turn),
            "cos-down": -np.cos(turn),
            "square-sampled": np.where(phase % 1.0 < 0.5, 1.0, -1.0),
        }
        if kind not in smooth:
            raise ValueError(f"waveform_type {kind!r} is unknown, expected {[*knots, *smooth]}")
        value = smooth[kind]
    signal = (0.5 * (high + low) + 0.5 * (high - low) * value[:, None]) * channels
    return np.column_stack([phase / frequency, signal])


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    """Put parts behind one another, from 0 those that begin before it; of two waypoints at the same
    time that differ the later one comes `SWITCH_S` after, of equal ones it is dropped."""
    joined = _from_zero(parts[0])
    for part in parts[1:]:
        later = _from_zero(part)
        later[:, 0] += joined[-1, 0]
        first, end = later[0], joined[-1]
        jumps = first[0] <= end[0] and not np.array_equal(first[1:], end[1:])
        after_s = _switch_s(float(later[1, 0] - end[0])) if jumps and len(later) > 1 else SWITCH_S
        switch = [[end[0] + after_s, *first[1:]]] if jumps else np.zeros((0, later.shape[1]))
        rest = later[later[:, 0] > end[0] + (after_s if jumps else 0.0)]
        joined = np.concatenate([joined, switch, rest])
    if joined[0, 0] > 0.0:
        joined = np.concatenate([[[0.0, *joined[0, 1:]]], joined])
    return joined


def _from_zero(part: np.ndarray) -> np.ndarray:
    """A copy of a part that begins at 0 where it began before."""
    moved = part.copy()
    moved[:, 0] -= min(float(part[0, 0]), 0.0)
    return moved
