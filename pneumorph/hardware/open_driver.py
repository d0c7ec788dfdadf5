"""From the name of a driver to the driver; each brings its library only when it is asked for."""

from __future__ import annotations

from pneumorph.hardware.driver import RegulatorDriver
from pneumorph.hardware.rig import RigSettings


def open_driver(rig: RigSettings) -> RegulatorDriver:
    """Return the driver of a real rig, not connected yet.

    Raises:
        ValueError: The rig is virtual: it needs a robot.
        ModuleNotFoundError: The driver's library is not installed.
    """
    if rig.driver == "9129b":
        from pneumorph.hardware.analog_rig import AnalogRig

        return AnalogRig(rig)
    if rig.driver == "serial":
        from pneumorph.hardware.serial_controller import SerialController

        return SerialController(rig)
    raise ValueError("a virtual rig is made of a robot, see pneumorph/hardware/virtual_rig.py")
