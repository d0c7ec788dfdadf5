"""Pressures that a calibration makes of a gait's, and where the limits of a rig cut them off."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.progress import Progress
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.vented_gait import VentedGait
from pneumorph.hardware.rig import Channel, RigSettings
from pneumorph.physics.calibration import Calibration
from pneumorph.physics.pressure import PressureMap
from pneumorph.robot.design import Design
from pneumorph.study.gait_source import bending_map
from pneumorph.study.robot_at_rig import calibrated

TWO_REGULATORS = Design.parse("1.0.0.2.2.0.0.1")
TRAINED, TWICE = PressureMap(2.0, 0.0), PressureMap(1.0, 0.0)
"""The second takes twice the pressure of the first."""


@pytest.fixture(scope="module")
def spec() -> RobotSpec:
    return RobotOptions.of("published").spec()


def _gait(*held_kPa: float) -> VentedGait:
    return VentedGait.of(HeldGait.evenly(np.array([held_kPa])), TWO_REGULATORS)


def _rig(*highest_kPa: float) -> RigSettings:
    return RigSettings(channels=tuple(Channel(highest_kPa=each) for each in highest_kPa))


def test_a_line_and_a_modulus_scaled_alike_leave_a_gait_as_it_was(
    spec: RobotSpec, tmp_path: Path
) -> None:
    """A leg of 1.2 times the modulus bends under 1.2 times the pressure as it did."""
    usual = spec.physics.pressure_map
    scaled = PressureMap(1.2 * usual.slope, 1.2 * usual.intercept_kPa)
    stiff = spec.calibrated(Calibration(scaled, modulus_factor=1.2))
    folder = RunFolder(tmp_path, "deploy")
    gait, _ = calibrated(_gait(50.0, 3.0, 0.0), usual, bending_map(stiff), _rig(90, 90, 90), folder)
    assert gait.pressure_kPa(0.0) == pytest.approx([50.0, 3.0, 0.0], rel=1e-12)
    # Of a stiffer leg alone the line stays.
    stiff = spec.calibrated(Calibration(usual, modulus_factor=1.2))
    gait, _ = calibrated(_gait(50.0, 0.0, 0.0), usual, bending_map(stiff), _rig(90, 90, 90), folder)
    assert float(usual.simulated(gait.pressure_kPa(0.0)[0])) == pytest.approx(
        1.2 * float(usual.simulated(50.0))
    )
    assert bending_map(spec) == usual


def test_every_channel_is_cut_off_at_its_own_limit(tmp_path: Path) -> None:
    """And one without a leg, which is vented, at none."""
    said = io.StringIO()
    folder = RunFolder(tmp_path, "deploy", Progress(said))
    gait, cut = calibrated(_gait(20.0, 30.0, 40.0), TRAINED, TWICE, _rig(90.0, 45.0, 1.0), folder)
    assert gait.pressure_kPa(0.0).tolist() == [40.0, 45.0, 0.0]
    assert cut == {"highest_meant_kPa": 60.0, "cut_off_at_kPa": 45.0}
    assert "is cut off there: 60.0 kPa (channel 2, 45 kPa)\n" in said.getvalue()
    gait, cut = calibrated(_gait(20.0, 22.0, 40.0), TRAINED, TWICE, _rig(90.0, 45.0, 1.0), folder)
    assert gait.pressure_kPa(0.0).tolist() == [40.0, 44.0, 0.0]
    assert cut == {}
    with pytest.raises(ValueError, match=r"70\.0 kPa, .* limit of channel 2, 45 kPa"):
        calibrated(_gait(20.0, 35.0, 40.0), TRAINED, TWICE, _rig(90.0, 45.0, 1.0), folder)
