"""How a part is reduced."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from pneumorph.base.checked import Checked, Count, CountOrNone, NotNegative, Positive, Share
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.ecsw import EcswSettings

STRESS_LIMIT = 32
"""Stretches of a sheet that the engine takes, `kMaximumStretches`."""


@dataclass(frozen=True)
class ReductionSettings(Checked):
    """How a part is reduced."""

    norm: Literal["energy", "shape", "mass"] = "energy"
    """Inner product of the POD: the mean stiffness over the snapshots; that of the solid's shape
    alone, where volumes and a stiff membrane are seen by fields, so that what they resist need not
    be held by modes; or the mass."""
    mode_tolerance: Positive = 0.0032
    """Relative projection error of the snapshots at which to stop adding modes."""
    mode_limit: Count = 24
    """At most so many modes, whatever the tolerance asks for."""
    pressure_tolerance: Positive = 0.01
    """Of a nearly incompressible part: relative error of the snapshots' changes of volume at which
    to stop adding pressures."""
    pressure_limit: Count = 8
    """At most so many pressures, whatever the tolerance asks for."""
    stress_limit: CountOrNone = 0
    """Number of fields of stress that a stiff membrane is seen by instead of sampled triangles, so
    that the modes need not hold its length; 0: its triangles are sampled. Its law must be St.
    Venant-Kirchhoff's."""
    symmetric: bool = True
    """Make modes symmetric or antisymmetric, and weights of mirrored elements equal, where the mesh
    has a mirror plane."""
    equal_snapshots: bool = True
    """Let every snapshot of a kind count alike. Otherwise each counts by its energy, so that those
    of the largest pressures count almost alone."""
    bend_share: Share = 0.3
    """Share of the free-bending equilibria in the weight of all snapshots."""
    load_share: Share = 0.2
    """Share of the loaded equilibria."""
    blocked_share: Share = 0.0
    """Share of the equilibria with a blocked tip; what remains is that of the robots' walks."""
    answer_share: Share = 0.0
    """Share of how the outer end face gives way to small forces at some of the free bends; the
    sampled elements do not learn from it. Of parts that are held rigidly and have that face."""
    curve_tolerance: NotNegative = 0.0
    """Relative projection error at which the modes hold free bends and blocked tips, before any is
    spent on other snapshots; 0: by their shares alone."""
    rotation: Rotation = "edge"
    """Where elements take their rotation from while sampled elements are trained."""
    training_state_limit: Count = 240
    """At most so many snapshots train the sampled elements."""
    holdout_every: CountOrNone = 6
    """One snapshot in so many is kept out of the training, to measure errors on; free bending and
    blocked tips never are. 0: none."""
    ecsw: EcswSettings = field(default_factory=EcswSettings)
    """Choice of elements."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.stress_limit > STRESS_LIMIT:
            raise ValueError(
                f"stress_limit must be at most {STRESS_LIMIT}, as many as the batched simulator "
                f"takes, got {self.stress_limit}"
            )
        given = self.bend_share + self.load_share + self.blocked_share + self.answer_share
        if given > 1.0 + 1e-9:  # rounding
            raise ValueError(
                "bend_share, load_share, blocked_share and answer_share must add up to at most 1, "
                f"got {given:g}; what they leave is the share of the walks"
            )
