"""Numerics of full-order robots."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from pneumorph.base.checked import Checked, Count, CountOrNone, NotNegative, Positive
from pneumorph.base.settings import settings_to_dict

Integrator = Literal["linearly_implicit", "implicit_euler"]
NewtonMatrix = Literal["fresh", "kept"]
FrictionSolver = Literal["newton", "gauss_seidel"]

_ONCE_USUAL_HALVINGS = 4
_DISPLACEMENTS = "displacement_tolerance_mm"


@dataclass(frozen=True)
class FullOrderSettings(Checked):
    """How the steps of full-order robots are computed; their physics is in `Physics`.

    Raises:
        ValueError: A number is out of range, or no such integrator or solver.
    """

    integrator: Integrator = "linearly_implicit"
    """`linearly_implicit`: one linear solve per step, as published. `implicit_euler`: Newton's
    method with line search until all forces balance at the end of the step."""
    newton_tolerance: Positive = 1e-8
    """Unbalanced impulse at which Newton's method stops, relative to momentum, weight, pressure and
    the elastic forces of the legs. It is of `implicit_euler`, as all settings of Newton's method
    are."""
    displacement_tolerance_mm: NotNegative = 0.0
    """With kept tangents, Newton's method also stops when the nodes are expected to be this close
    to their end positions [mm] (root mean square by mass); 0: only when forces balance."""
    newton_iterations: Count = 30
    """Largest number of Newton iterations in a step."""
    newton_matrix: NewtonMatrix = "fresh"
    """Tangents of Newton's method. `fresh`: new ones in every iteration, with line search. `kept`:
    earlier ones for as long as they serve, which is faster and gives the same step to the
    tolerance; for legs whose laws the engine has, such as `yeoh`."""
    thread_count: CountOrNone = 0
    """Threads over which `kept` distributes the legs; results do not depend on it. 0: every
    processor if one robot walks alone, otherwise one."""
    step_halvings: CountOrNone = 8
    """How often a step that fails may be halved."""
    contact_margin_mm: NotNegative = 1.0
    """Points that would come nearer to the floor than this within the step take part in the contact
    solve [mm]."""
    friction_solver: FrictionSolver = "newton"
    """`newton`: semi-smooth Newton after a few Gauss-Seidel sweeps, to the tolerance.
    `gauss_seidel`: sweeps alone, as in the published experiment (250 of them)."""
    contact_tolerance_mm_per_s: Positive = 1e-7
    """The friction solver stops when no contact law is violated by more than this [mm/s]."""
    contact_sweeps: Count = 2000
    """Largest number of Gauss-Seidel sweeps in a contact solve."""
    penetration_tolerance_mm: Positive = 0.01
    """A step that ends with a point deeper in the floor than this [mm] is solved again, with that
    point, and with the floor linearised where the points ended."""
    contact_passes: Count = 4
    """Largest number of times that a step is solved."""
    penetration_limit_mm: Positive = 0.05
    """A step that still ends with a point deeper than this has failed [mm]."""
    speed_limit_mm_per_s: Positive = 1e5
    """A robot with a node faster than this has diverged [mm/s]."""

    def by_name(self) -> dict[str, Any]:
        """Settings by name, with halvings as those of earlier versions where there are more: these
        change only walks that had ended."""
        halvings = min(self.step_halvings, _ONCE_USUAL_HALVINGS)
        return {**settings_to_dict(self), "step_halvings": halvings}

    def described(self) -> dict[str, Any]:
        """Settings by name, which tell kept things apart: without what decides nothing, and without
        what earlier versions did not have where it is as usual. What Newton's method has is as
        usual where it is not used."""
        own = self._without_unused().by_name()
        usual = ["thread_count"]
        for name in ("newton_matrix", _DISPLACEMENTS):
            if own[name] == getattr(FullOrderSettings, name):
                usual.append(name)
        return {name: value for name, value in own.items() if name not in usual}

    def _without_unused(self) -> FullOrderSettings:
        """The same steps, with the defaults of what these do not use."""
        unused = []
        if self.integrator == "linearly_implicit":
            unused = [_DISPLACEMENTS, "newton_tolerance", "newton_iterations", "newton_matrix"]
        elif self.newton_matrix == "fresh":
            unused = [_DISPLACEMENTS]
        usual: dict[str, Any] = {name: getattr(FullOrderSettings, name) for name in unused}
        return replace(self, **usual)
