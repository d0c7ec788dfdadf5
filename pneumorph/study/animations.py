"""The four test animations of the paper's appendix B."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.open_loop_gait import OpenLoopGait
from pneumorph.robot.design import Design

HIGH_KPA = 90.0
"""Real pressure of an inflated leg; it stands for 347 simulated kPa [kPa]."""
CORNER_S = 0.6
"""Time at one corner of the pressure hypercube: the regulators just get there at 150 kPa/s [s]."""
ALTERNATION_S = 2.0
"""Half period of legs that inflate alternately [s]."""


@dataclass(frozen=True)
class Animation:
    """A design and the pressures that animate it.

    Attributes:
        name: Its name.
        design: The design.
        gait: The pressures.
    """

    name: str
    design: Design
    gait: OpenLoopGait


def animations(names: Sequence[str], duration_s: float) -> list[Animation]:
    """Return test animations of the given length.

    - ``hamiltonian``: the baseline's four legs, each on a regulator of its own, along a Gray code
      of the corners of the pressure hypercube.
    - ``baseline``: the expert's design and gait, phase 110 degrees.
    - ``two_leg``: two legs at a right angle, inflated alternately.
    - ``six_leg``: six legs, inflated alternately in two groups of three.

    Args:
        names: Which ones.
        duration_s: Length of each [s].

    Raises:
        ValueError: An unknown name, or a duration that is not positive.
    """
    if not duration_s > 0:
        raise ValueError(f"duration_s is {duration_s}, expected above 0")
    makers: dict[str, tuple[str, Callable[[], OpenLoopGait]]] = {
        "hamiltonian": ("1.0.0.2.3.0.0.4", lambda: _gray_walk(4, duration_s)),
        "baseline": (BASELINE_DESIGN, lambda: ExpertGait(duration_s=duration_s)),
        "two_leg": ("1.0.2.0.0.0.0.0", lambda: _alternation(duration_s)),
        "six_leg": ("1.2.1.0.0.2.1.2", lambda: _alternation(duration_s)),
    }
    unknown = [name for name in names if name not in makers]
    if unknown:
        raise ValueError(f"animation {unknown[0]!r} is unknown, expected {', '.join(makers)}")
    chosen = [(name, *makers[name]) for name in names]
    return [Animation(name, Design.parse(design), make()) for name, design, make in chosen]


def _gray_walk(regulator_count: int, duration_s: float) -> HeldGait:
    """Visit the corners of the pressure hypercube, one regulator changed at a time."""
    corner_count = 2**regulator_count
    number = np.arange(corner_count)
    gray = number ^ (number >> 1)
    corners = HIGH_KPA * ((gray[:, None] >> np.arange(regulator_count)) & 1)
    # From the second corner on: the first has every leg slack, as the settled robot has.
    held = np.roll(corners, -1, axis=0)
    return repeated(held, CORNER_S, duration_s)


def _alternation(duration_s: float) -> HeldGait:
    """Inflate regulator 1 and regulator 2 in turn; regulator 3 stays slack."""
    held = HIGH_KPA * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    return repeated(held, ALTERNATION_S, duration_s)


def repeated(cycle_kPa: np.ndarray, hold_s: float, duration_s: float) -> HeldGait:
    """Repeat a cycle of commands until the end."""
    count = int(np.ceil(duration_s / hold_s - 1e-9))
    commands = cycle_kPa[np.arange(count) % len(cycle_kPa)]
    return HeldGait(hold_s * np.arange(count), commands, duration_s)
