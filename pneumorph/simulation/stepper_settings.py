"""Numerics of the compiled stepper of reduced robots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pneumorph.base.checked import Bounds, Checked, Count, NotNegative, Positive

Precision = Literal["single", "double"]
Linearised = Literal["start", "ahead"]
InstructionSet = Literal["best", "avx512", "avx2", "baseline"]


@dataclass(frozen=True)
class StepperSettings(Checked):
    """How the steps of reduced robots are computed.

    Raises:
        ValueError: A number is out of range, or no such precision or instruction set.
    """

    contact_margin_mm: Annotated[
        float,
        Bounds(least=0.1, why="less leaves no room for how the ground bends on a step's way"),
    ] = 2.0
    """Contact points that are expected within this distance of the floor at the end of a step are
    checked one by one, all others by a bound for each leg [mm]. It changes how long a step takes,
    not its result. The bound takes a step's way for straight, and leaves a quarter of the margin
    for how the ground bends along it: less than 0.1 mm is too little for that."""
    contact_tolerance_mm_per_s: Positive = 1e-2
    """The friction solver stops when no contact law is violated by more than this [mm/s]."""
    contact_sweeps: Count = 100
    """Largest number of Gauss-Seidel sweeps in a step; they are made only where Newton's method
    fails."""
    speed_limit_mm_per_s: Positive = 1e4
    """A robot faster than this counts as diverged [mm/s]."""
    tangent_tolerance_mm_per_s: NotNegative = 1.0
    """A leg keeps its stiffness from step to step while two predictions of its error, from the last
    step and from the last two, differ by no more than this velocity [mm/s] (root mean square over
    the leg), and while it is less than three tenths short along the motion. 0: a new stiffness in
    every step. Applies to corotational parts, and to the solid of measured silicone under objective
    damping."""
    linearised: Linearised = "ahead"
    """Where a step finds its forces and the motion of contact points. `start`: where it begins.
    `ahead`: forces of measured silicone where the motion of the last two steps leads, while that
    changes by less than 0.3 mm in a step (root mean square over a leg), and points with what the
    hub's turning adds to their way; nearly the converged implicit step of finite elements, at the
    same price. Forces of other parts, and of silicone under published or stiffness damping, are
    always found at the start."""
    element_precision: Precision = "single"
    """Precision of element forces and stiffness and of the cavity's cubic term. Everything else is
    in double precision."""
    instruction_set: InstructionSet = "best"
    """Processor instructions that the stepper uses; `best` takes the best that this processor has.
    Results differ in the last digits."""
