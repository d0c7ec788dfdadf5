"""What a reduction says of itself: sizes, measured errors, and the time of each stage."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from typing import Any

from pneumorph.base.progress import ProgressReport


@dataclass(frozen=True)
class ReductionReport:
    """Measured errors and costs of a reduction; errors in percent or millimetres."""

    mode_count: int
    symmetric_mode_count: int
    projection_error: float
    """Relative, in the POD's norm; the mode tolerance bounds it unless the mode limit cuts."""
    tetrahedron_count: int
    """Sampled integration points of the solid; a linear element has one."""
    membrane_count: int
    """The same of the membrane."""
    pressure_count: int
    """Pressures that the volumes of a nearly incompressible part are seen by."""
    stress_count: int
    """Fields of stress that a stiff membrane is seen by."""
    sampling_residual: float
    """||G w - b|| / ||b|| of the element selection."""
    sampling_converged: bool
    training_node_error_mm: float
    """Mean over snapshots and nodes of the distance to the nearest modal state."""
    heldout_node_error_mm: float | None
    """The same for snapshots not used; None where all were, and so are the next two."""
    heldout_worst_node_error_mm: float | None
    """Mean over nodes in the worst snapshot not used."""
    heldout_force_error_percent: float | None
    """Root mean square over snapshots not used of the sampled force's relative error."""
    bend_error_percent: float | None
    """Largest error of the bend against the full model over the pressures of `bend`, and of each
    cavity alone, each relative to its bend or 5 % of the largest; none of a part without cavity."""
    bend_error_unsampled_percent: float | None
    """The same with every element: the part of the modes alone."""
    bend: dict[str, list[float]]
    """Pressure [kPa], bend of the full and the reduced part [degrees], mean node error [mm]."""
    bend_of_cavities: dict[str, dict[str, list[float]]] = field(default_factory=dict, kw_only=True)
    """The same by the cavity that is inflated alone, where there are several; the bend is the end
    face's turn about any axis."""
    chamber_growth: list[float] | None = field(default=None, kw_only=True)
    """Growth of all chambers with pressure along `bend`, see `chamber_growth.py`."""
    blocked_error_percent: float | None
    """Largest error of the force that keeps the tip down, over the pressures of `blocked`, relative
    as that of the bend; None where no snapshot has a blocked tip."""
    blocked_error_unsampled_percent: float | None
    """The same with every element."""
    blocked: dict[str, list[float]]
    """Pressure [kPa], force of the full and the reduced part [mN]."""
    compliance_error_percent: float | None
    """Largest error of the tip's compliance under small forces over the pressures of `compliance`,
    by Frobenius' norm; none of a part without cavity or outer end face, or on a soft mount."""
    compliance: dict[str, list[float]]
    """Pressure [kPa], the tip's way along each axis under a force along it [mm/N], of the full and
    the reduced part."""
    snapshot_count: int
    stage_seconds: dict[str, float]
    """Wall time of each stage [s]."""
    peak_memory_mb: float
    """Largest resident memory of the process so far [MB]."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-serialisable content."""
        return asdict(self)


class StageTimes:
    """Wall time of named stages, one after the other.

    Args:
        progress: Called with each stage's name as it starts.
    """

    def __init__(self, progress: ProgressReport | None) -> None:
        self.seconds: dict[str, float] = {}
        """[s]"""
        self._progress = progress
        self._name, self._since = "", 0.0

    def start(self, name: str) -> None:
        """Begin a stage; the one before it ends."""
        self.stop()
        self._name, self._since = name, time.perf_counter()
        if self._progress:
            self._progress(0, 1, name)

    def stop(self) -> None:
        """End the stage."""
        if self._name:
            self.seconds[self._name] = time.perf_counter() - self._since
        self._name = ""
