"""Numerics of full-order robots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from pneumorph.base.checked import Checked, Count, CountOrNone, NotNegative, Positive
from pneumorph.base.settings import settings_to_dict

Integrator = Literal["linearly_implicit", "implicit_euler"]
NewtonMatrix = Literal["fresh", "kept"]
FrictionSolver = Literal["newton", "gauss_seidel"]

_ONCE_USUAL_HALVINGS = 4


@dataclass(frozen=True)
class FullOrderSettings(Checked):
    """How the steps of full-order robots are computed; their physics is in `Physics`.

    Raises:
        ValueError: A number is out of range, or no such integrator or solver.
    """

    integrator: Integrator = "linearly_implicit"
    """`linearly_implicit`: one linear solve a step, as published. `implicit_euler`: Newton's method
    with line search until all forces balance at the end of the step."""
    newton_tolerance: Positive = 1e-8
    """`implicit_euler` ends at this unbalanced impulse, relative to momentum, weight and
    pressure."""
    displacement_tolerance_mm: NotNegative = 0.0
    """`kept` ends as well where the nodes are this close to their places at the step's end [mm],
    root mean square by mass, as the last changes let one expect; 0 for by balance alone."""
    newton_iterations: Count = 30
    """Most Newton iterations of a step."""
    newton_matrix: NewtonMatrix = "fresh"
    """Whose tangents `implicit_euler` iterates with. `fresh`: those of every iteration, with line
    search. `kept`: those of an earlier trial while they do, which takes a part of the time and ends
    in the same step to the tolerance; for legs whose laws the engine knows, such as `yeoh`."""
    thread_count: CountOrNone = 0
    """Threads among which `kept` shares out the legs; what is computed does not depend on it. 0
    leaves it to who lets robots walk: every processor for one by itself, else one."""
    step_halvings: CountOrNone = 8
    """A step that fails is made as two of half the length, and those again, at most so deep."""
    contact_margin_mm: NotNegative = 1.0
    """Points that would come nearer to the floor than this within the step take part in the contact
    solve [mm]."""
    friction_solver: FrictionSolver = "newton"
    """`newton`: semi-smooth Newton after a few Gauss-Seidel sweeps, to the tolerance.
    `gauss_seidel`: sweeps alone, as in the published experiment (250 of them)."""
    contact_tolerance_mm_per_s: Positive = 1e-7
    """The friction solver stops when no contact law is violated by more than this [mm/s]."""
    contact_sweeps: Count = 2000
    """Most Gauss-Seidel sweeps of a contact solve."""
    penetration_tolerance_mm: Positive = 0.01
    """A step that ends with a point deeper in the floor than this is solved again, with that point
    and with the floor linearised where the points came to lie [mm]."""
    contact_passes: Count = 4
    """How often a step is solved at most."""
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
        what earlier versions did not have where it is as usual."""
        own = self.by_name()
        usual = ["thread_count"]
        if self.newton_matrix == "fresh":
            usual.append("newton_matrix")
        if self.displacement_tolerance_mm == 0.0:
            usual.append("displacement_tolerance_mm")
        return {name: value for name, value in own.items() if name not in usual}
