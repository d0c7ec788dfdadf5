"""The calibration file: what was measured of the real robot and goes back into simulation.

It is JSON of the kind ``Calibration``: the map of real to simulated pressure and, where they were
fitted, the leg's modulus, the damping, the friction and the regulators' conductances, each with its
95 % confidence interval; and what tests on a bench found, which narrows the worlds that robots are
expected to live in.
Simulation, training and deployment read it, and every summary says which one.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import NoneType
from typing import Any

from pneumorph.base.artefact import UNITS, read_json, reading, write_json
from pneumorph.base.checked import Bounds
from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.physics.air import Air
from pneumorph.physics.friction import FRICTION_BOUNDS
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap

FORMAT_VERSION = 1

PUBLISHED = "the published line"
"""How summaries name the pressure map of the paper, which is used without a calibration file."""
NOT_CALIBRATED = "not calibrated"
"""What summaries say in place of a file where nothing was measured of the robot."""
_EARLIER_NOT_CALIBRATED = "the run's own settings"
"""What summaries of earlier versions say there."""

_BOUNDS = {
    "modulus_factor": Bounds(
        most=50.0, why="it is the measured modulus over the model's, not a modulus"
    ),
    "stiffness_damping_s": Bounds(most=10.0, why="it is in seconds"),
    "friction": FRICTION_BOUNDS,
}
"""Of what was measured, all of which is positive."""


@dataclass(frozen=True)
class Calibration:
    """Measured parameters of one real robot; None stands for "not measured".

    Raises:
        ValueError: A parameter is not positive, or larger than any is.
    """

    pressure_map: PressureMap = field(default_factory=PressureMap)
    """Real to simulated pressure."""
    modulus_factor: float | None = None
    """Young's moduli of silicone and sheet over those of the model."""
    stiffness_damping_s: float | None = None
    """Rayleigh stiffness coefficient [s]."""
    friction: float | None = None
    """Coulomb friction coefficient."""
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """95 % confidence interval of each fitted parameter by name."""
    fit: Mapping[str, Any] = field(default_factory=dict)
    """Figures of fit: ``r_squared``, ``rms`` ... of each fit by name."""
    source: Mapping[str, Any] = field(default_factory=dict)
    """What was measured, and with which leg the simulated side was computed."""
    path: Path | None = field(default=None, compare=False)
    """The file it was read from."""
    measured: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """What tests of the robot found of numbers that worlds differ in, such as ``friction sheet``:
    value and standard deviation."""
    air: Air | None = None
    """How air fills and vents the legs, with the conductances of each regulator."""

    def __post_init__(self) -> None:
        for name, bounds in _BOUNDS.items():
            value = getattr(self, name)
            if value is not None and not (value > 0.0 and value in bounds):
                raise ValueError(
                    f"{name} must be positive and at most {bounds.most:g}, got {value}; "
                    f"{bounds.why}"
                )

    def applied_to(self, physics: Physics) -> Physics:
        """Physics with everything that was measured in place; the modulus is the leg's."""
        measured = {
            name: getattr(self, name)
            for name in ("stiffness_damping_s", "friction")
            if getattr(self, name) is not None
        }
        air = physics.air if self.air is None else self.air
        return replace(physics, pressure_map=self.pressure_map, air=air, **measured)

    def content(self) -> dict[str, Any]:
        """As saved, without the format's header."""
        return {
            "slope": self.pressure_map.slope,
            "intercept_kPa": self.pressure_map.intercept_kPa,
            "modulus_factor": self.modulus_factor,
            "stiffness_damping_s": self.stiffness_damping_s,
            "friction": self.friction,
            "air": None if self.air is None else settings_to_dict(self.air),
            "measured": {name: list(pair) for name, pair in self.measured.items()},
            "confidence_intervals_95": {name: list(pair) for name, pair in self.intervals.items()},
            "fit": dict(self.fit),
            "source": dict(self.source),
        }

    def digest(self) -> str:
        """Hash of the parameters, in hexadecimal; names the calibration in summaries."""
        names = ("slope", "intercept_kPa", "modulus_factor", "stiffness_damping_s", "friction")
        content = self.content()
        told = {name: content[name] for name in names}
        # Earlier files, which had neither, keep their digests.
        if self.air is not None:
            told["air"] = content["air"]
        if self.measured:
            told["measured"] = content["measured"]
        text = json.dumps(told, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def save(self, path: Path | str) -> Path:
        """Write the calibration as JSON."""
        header = {"kind": "Calibration", "format_version": FORMAT_VERSION, "units": UNITS}
        return write_json(path, {**header, **self.content()})

    @classmethod
    def load(cls, path: Path | str) -> Calibration:
        """Read a calibration.

        Raises:
            FileNotFoundError: No such file.
            ArtefactError: Not a calibration, of another version, or with a value out of range.
        """
        path = Path(path)
        content = read_json(path, "calibration")
        with reading(path, "calibration"):
            if content.get("kind") != "Calibration":
                held = f"a {content['kind']}" if "kind" in content else "no kind of artefact"
                raise ValueError(
                    f"it holds {held}, expected a Calibration, such as calibration.json of "
                    "`pneumorph calibrate`"
                )
            if content.get("format_version") != FORMAT_VERSION:
                raise ValueError(
                    f"it has format version {content.get('format_version')}, this pneumorph reads "
                    f"version {FORMAT_VERSION}"
                )
            for name in ("measured", "confidence_intervals_95", "fit", "source"):
                if not isinstance(content.get(name, {}), Mapping):
                    raise ValueError(f"{name} is {content[name]!r:.60}, expected a table")
            for name in ("slope", "intercept_kPa"):
                if type(content[name]) not in (int, float):
                    raise ValueError(f"{name} is {content[name]!r:.60}, expected a number")
            for name in ("modulus_factor", "stiffness_damping_s", "friction"):
                if type(content[name]) not in (int, float, NoneType):
                    raise ValueError(f"{name} is {content[name]!r:.60}, expected a number or null")
            return cls(
                PressureMap(float(content["slope"]), float(content["intercept_kPa"])),
                content["modulus_factor"],
                content["stiffness_damping_s"],
                content["friction"],
                air=None if (air := content.get("air")) is None else settings_from_dict(Air, air),
                intervals=_pairs(content["confidence_intervals_95"], "confidence_intervals_95"),
                measured=_pairs(content.get("measured", {}), "measured", deviation=True),
                fit=content["fit"],
                source=content["source"],
                path=path,
            )


def _pairs(
    content: Mapping[str, Any], where: str, deviation: bool = False
) -> dict[str, tuple[float, float]]:
    """Two numbers for each name.

    Raises:
        ValueError: They are others, or the second is no standard deviation.
    """
    for name, pair in content.items():
        numbers = isinstance(pair, list) and len(pair) == 2
        numbers = numbers and all(type(n) in (int, float) and math.isfinite(n) for n in pair)
        if not numbers or (deviation and pair[1] < 0.0):
            what = "a value and a standard deviation" if deviation else "the ends of an interval"
            raise ValueError(f"{where} {name} is {pair!r:.60}, expected {what}")
    return {name: (pair[0], pair[1]) for name, pair in content.items()}


@dataclass(frozen=True)
class UsedCalibration:
    """What a summary says of the calibration it was made with; None for what was not measured."""

    file: str
    """Where it was read from, or that it has no file; without one `PUBLISHED` or
    `NOT_CALIBRATED`."""
    slope: float
    intercept_kPa: float
    digest: str | None = None
    modulus_factor: float | None = None
    stiffness_damping_s: float | None = None
    friction: float | None = None
    filling_mm3_per_s_kPa: tuple[float, ...] | None = None
    venting_mm3_per_s_kPa: tuple[float, ...] | None = None

    @property
    def said(self) -> str:
        """The file for a person, in the words of this version."""
        earlier = self.digest is None and self.file == _EARLIER_NOT_CALIBRATED
        return NOT_CALIBRATED if earlier else self.file


def describe_calibration(
    calibration: Calibration | None, pressure_map: PressureMap
) -> UsedCalibration:
    """What a summary says of the calibration it was made with."""
    slope, intercept_kPa = pressure_map.slope, pressure_map.intercept_kPa
    if calibration is None:
        usual = PUBLISHED if pressure_map == PressureMap() else NOT_CALIBRATED
        return UsedCalibration(usual, slope, intercept_kPa)
    air = calibration.air
    return UsedCalibration(
        "a calibration without a file" if calibration.path is None else str(calibration.path),
        slope,
        intercept_kPa,
        digest=calibration.digest(),
        modulus_factor=calibration.modulus_factor,
        stiffness_damping_s=calibration.stiffness_damping_s,
        friction=calibration.friction,
        filling_mm3_per_s_kPa=None if air is None else air.filling_mm3_per_s_kPa,
        venting_mm3_per_s_kPa=None if air is None else air.venting_mm3_per_s_kPa,
    )
