"""Which measurements of a real robot a calibration is fitted to."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from pneumorph.base.checked import Checked, Count, Positive
from pneumorph.hardware.marker_track import VideoSettings
from pneumorph.hardware.parameter_fit import ParameterFitSettings
from pneumorph.study.recorded_walk import Model


@dataclass(frozen=True)
class CalibrationSettings(Checked):
    """Which measurements to fit to. Give one or more."""

    bends: Path | None = None
    """CSV table of the measured bends of one leg held at its root, with columns
    pressure_kPa,bend_deg."""
    pairs: Path | None = None
    """CSV table of real and simulated pressures that give the same bend, with columns
    real_pressure_kPa,simulated_pressure_kPa; instead of --bends."""
    trials: Path | None = None
    """Deployment folder; modulus, friction and damping are fitted to the tracked paths of its
    trials."""
    air: Path | None = None
    """Deployment folder; the filling and venting conductance of each regulator is fitted to its
    sensed pressures."""
    bench: Path | None = None
    """CSV table of bench tests, with columns test,reading; tests are named as in a certificate. Not
    together with --bends, --pairs or --trials: fit those first and pass their file as
    --calibration."""
    trial_count: Count = 5
    """Number of trials to fit to, the first ones."""
    model: Model = "reduced"
    """Model of the leg that is bent in the simulation: reduced, or finite elements (minutes)."""
    largest_simulated_kPa: Positive = 450.0
    """Highest simulated pressure of the bend, unless the simulation fails before [kPa]."""
    fit: ParameterFitSettings = field(default_factory=ParameterFitSettings)
    video: VideoSettings = field(default_factory=VideoSettings)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bends is not None and self.pairs is not None:
            raise ValueError("both bends and pairs were given, expected one: they fit one line")
        for name in ("bends", "pairs", "trials"):
            if self.bench is not None and getattr(self, name) is not None:
                raise ValueError(
                    f"both bench and {name} were given, expected one after the other: tests on a "
                    "bench are read against the robot that --calibration makes of the other"
                )
