"""Which measurement a number of a calibration comes from."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from pneumorph.catalogue.robot_identity import reduction_digest
from pneumorph.catalogue.robot_spec import RobotSpec


def provenance(measured: Path, spec: RobotSpec) -> dict[str, Any]:
    """What was measured, by name and content, and the leg that it was compared with."""
    content = measured.read_bytes() if measured.is_file() else b""
    return {
        "measured": str(measured),
        "sha256": hashlib.sha256(content).hexdigest() if content else None,
        "leg": reduction_digest(spec),
        "damping": spec.physics.damping,
    }
