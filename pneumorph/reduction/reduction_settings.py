"""How a part is reduced."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from pneumorph.base.checked import Checked, Count, CountOrNone, Share
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.tolerance import Tolerance, ToleranceOrNone

STRESS_LIMIT = 32
"""Stretches of a sheet that the engine takes, `kMaximumStretches`."""


@dataclass(frozen=True)
class ReductionSettings(Checked):
    """How a part is reduced."""

    norm: Literal["energy", "shape", "mass"] = "energy"
    """Inner product of the POD. `energy`: mean stiffness over the snapshots. `shape`: stiffness
    against changes of the solid's shape alone, if pressure and stress fields represent volumes and
    a stiff membrane. `mass`: the mass matrix."""
    mode_tolerance: Tolerance = 0.0032
    """Relative projection error of the snapshots at which no more modes are added. Smaller: more
    exact, more modes, slower steps."""
    mode_limit: Count = 24
    """Largest number of modes, whatever the tolerance asks for. The cost of a step grows with its
    square; the batched simulator takes up to 40."""
    pressure_tolerance: Tolerance = 0.01
    """For a nearly incompressible leg: relative error of the snapshots' volume changes at which no
    more pressure fields are added."""
    pressure_limit: Count = 8
    """Largest number of pressure fields, whatever the tolerance asks for."""
    stress_limit: CountOrNone = 0
    """Number of stress fields that represent a stiff membrane instead of sampled triangles, so that
    no modes are spent on keeping its length; 0: sampled triangles. The membrane's law must be St.
    Venant-Kirchhoff's."""
    symmetric: bool = True
    """If the mesh has a mirror plane: make each mode symmetric or antisymmetric, and give mirrored
    elements equal weights."""
    equal_snapshots: bool = True
    """Give all snapshots of a kind the same weight. Otherwise each has its energy as weight, and
    those at the highest pressures dominate."""
    bend_share: Share = 0.3
    """Share of the free bends in the weight of all snapshots."""
    load_share: Share = 0.2
    """Share of the equilibria under load."""
    blocked_share: Share = 0.0
    """Share of the equilibria with the tip held down. What the shares leave is that of walking
    robots."""
    answer_share: Share = 0.0
    """Share of the responses of the outer end face to small forces, at some of the free bends. They
    train the modes, not the sampled elements. Only for legs that are held rigidly and have that
    face."""
    contact_flexibility: bool = False
    """Let contact points give way beyond the modes, by their residual flexibility at rest. Reduced
    robots then follow finite elements more closely while legs slip, for the same modes. Only for
    legs that are held rigidly."""
    curve_tolerance: ToleranceOrNone = 0.0
    """Relative projection error to which free bends and blocked tips are represented before modes
    are spent on other snapshots; 0: only their shares count. Of a part with a mirror plane what
    symmetric and what antisymmetric modes leave is held to it each, and both to sqrt(2) times it.
    """
    rotation: Rotation = "edge"
    """Rotation of linear elastic elements while sampled elements are trained: `edge` (as published)
    or `polar`."""
    training_state_limit: Count = 240
    """Largest number of snapshots that train the sampled elements."""
    holdout_every: CountOrNone = 6
    """Every how many snapshots one is held out of the training, to measure errors on it; never free
    bends or blocked tips. 0: none."""
    ecsw: EcswSettings = field(default_factory=EcswSettings)
    """Hyperreduction by ECSW: which elements are sampled."""

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
