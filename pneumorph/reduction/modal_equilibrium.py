"""Static equilibrium of a reduced part held at its attachment, by Newton with load steps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from pneumorph.physics.physics import Rotation
from pneumorph.reduction.reduced_part import ReducedPart


@dataclass(frozen=True)
class ModalEquilibrium:
    """Where the forces on a part balance, and how the search ended."""

    alpha: np.ndarray
    """Modal coordinates, (mode,)."""
    converged: bool
    iterations: int
    relative_residual: float
    """Norm of the unbalanced force over that of the largest applied one."""
    keeping_mN: float = 0.0
    """Force along `kept` that keeps the mean in place."""


def modal_equilibrium(
    part: ReducedPart,
    pressure_kPa: np.ndarray | float,
    *,
    external: np.ndarray | None = None,
    kept: np.ndarray | None = None,
    start: np.ndarray | None = None,
    start_keeping_mN: float = 0.0,
    rotation: Rotation = "edge",
    tolerance: float = 1e-9,
    iteration_limit: int = 200,
) -> ModalEquilibrium:
    """Find alpha with internal_force(alpha) + sum_c p_c dV_c/dalpha + external = 0.

    Newton's method with the exact tangent, taken by central differences of the (cheap) reduced
    force so that the change of the elements' rotations is included. A tangent is kept for as long
    as a step with it lowers the residual tenfold, and steps are limited in length, which also
    serves as continuation.

    Args:
        part: The reduced part.
        pressure_kPa: Pressure of each cavity, (cavity,) or one number for all.
        external: Further constant generalised force, (mode,).
        kept: Weights (mode,) of a mean that a force along them keeps at zero, one more unknown:
            see `pneumorph.fem.static.rising_equilibria`.
        start: Modal coordinates to start from, zero by default.
        start_keeping_mN: Force along `kept` to start from.
        rotation: Where the elements take their rotation from.
        tolerance: Relative residual to reach.
        iteration_limit: Newton steps at most.

    Raises:
        ValueError: A pressure is not finite.
    """
    pressure = np.broadcast_to(np.asarray(pressure_kPa, dtype=float), (part.cavity_count,))
    if not np.all(np.isfinite(pressure)):
        raise ValueError(f"pressure_kPa must be finite, got {pressure_kPa}")
    applied = np.zeros(part.mode_count) if external is None else np.asarray(external, dtype=float)
    alpha = np.zeros(part.mode_count) if start is None else np.array(start, dtype=float)
    residual_size, previous, keeping = np.inf, 0.0, start_keeping_mN
    tangent = np.zeros((part.mode_count, part.mode_count))

    for iteration in range(iteration_limit + 1):
        cavities = [part.cavity(index) for index in range(part.cavity_count)]
        load = applied + sum(
            p * cavity.gradient(alpha) for p, cavity in zip(pressure, cavities, strict=True)
        )
        if kept is not None:
            load = load + keeping * kept
        elastic = part.internal_force(alpha, rotation)
        if not np.all(np.isfinite(elastic)):  # rubber that a step turned inside out
            return ModalEquilibrium(alpha, False, iteration, np.inf, keeping)
        residual = elastic + load
        scale = max(float(np.linalg.norm(load)), float(np.linalg.norm(elastic)), 1e-12)
        residual_size = float(np.linalg.norm(residual) / scale)
        mean = 0.0 if kept is None else float(kept @ alpha)
        if residual_size <= tolerance and abs(mean) <= 1e-6:  # [mm]
            return ModalEquilibrium(alpha, True, iteration, residual_size, keeping)
        if iteration == iteration_limit:
            break
        if not residual_size < 0.1 * previous:
            tangent = modal_tangent(part, alpha, pressure, rotation)
        previous = residual_size
        step, more = np.linalg.solve(tangent, residual), 0.0
        if kept is not None:
            to_force = np.linalg.solve(tangent, kept)
            more = -(mean + float(kept @ step)) / float(kept @ to_force)
            step = step + more * to_force
        movement = float(np.abs(part.modes @ step).max())
        # 8 mm per step keeps a slender part's elements well below a right angle of turn.
        shorter = min(1.0, 8.0 / max(movement, 1e-300))
        alpha, keeping = alpha + step * shorter, keeping + more * shorter
        if movement < 1e-10:  # [mm]; no load leaves only rounding to compare the residual with
            return ModalEquilibrium(alpha, True, iteration + 1, residual_size, keeping)
    return ModalEquilibrium(alpha, False, iteration_limit, residual_size, keeping)


def rising_modal_equilibria(
    part: ReducedPart,
    pressures_kPa: Iterable[float | np.ndarray],
    rotation: Rotation = "edge",
    kept: np.ndarray | None = None,
) -> Iterator[ModalEquilibrium]:
    """Equilibria at one pressure after the other, or one of each cavity (cavity,), each from the
    one before; arguments as of `modal_equilibrium`.

    A step of pressure from which none is found is made in two halves, and in four quarters: the
    state before it may be unstable under the pressure behind it. After one that is not found the
    next starts from the last that was.
    """
    last = ModalEquilibrium(np.zeros(part.mode_count), True, 0, 0.0)
    reached = np.zeros(part.cavity_count)
    for pressure in pressures_kPa:
        wanted = np.broadcast_to(np.asarray(pressure, dtype=float), reached.shape)
        result = last
        for count in (1, 2, 4):
            result = last
            for number in range(1, count + 1):
                share = number / count
                result = modal_equilibrium(
                    part,
                    wanted if number == count else reached + share * (wanted - reached),
                    kept=kept,
                    start=result.alpha,
                    start_keeping_mN=result.keeping_mN,
                    rotation=rotation,
                )
                if not result.converged:
                    break
            if result.converged:
                last, reached = result, wanted
                break
        yield result


def modal_tangent(
    part: ReducedPart, alpha: np.ndarray, pressure_kPa: np.ndarray, rotation: Rotation = "edge"
) -> np.ndarray:
    """-d(internal force + sum_c p_c dV_c/dalpha)/dalpha, nothing left out, (mode, mode).

    Of the elements by central differences, so that the change of their rotations is included.

    Args:
        part: The reduced part.
        alpha: Modal coordinates, (mode,).
        pressure_kPa: Pressure of each cavity [kPa], (cavity,).
        rotation: Where the elements take their rotation from.
    """
    # The largest displacement a mode makes per unit of its coordinate turns mm into alpha.
    difference = 1e-4 / np.abs(part.modes).max(axis=(0, 1))
    forward = part.internal_force(alpha + np.diag(difference), rotation)
    backward = part.internal_force(alpha - np.diag(difference), rotation)
    tangent: np.ndarray = -((forward - backward) / (2.0 * difference[:, None])).T
    for index, pressure in enumerate(pressure_kPa):
        tangent -= pressure * part.cavity(index).hessian(alpha)
    return tangent
