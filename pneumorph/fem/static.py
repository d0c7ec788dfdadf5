"""Static equilibrium of a clamped part under pressure and given forces."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone, Positive
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static_tangent import Tangent, tangent_of
from pneumorph.physics.physics import Rotation


@dataclass(frozen=True)
class StaticSettings(Checked):
    """How an equilibrium is sought."""

    load_step_kPa: Positive = 20.0
    """Largest pressure step [kPa]."""
    tolerance: Positive = 1e-8
    """Unbalanced force at which a load step has converged, relative to the largest applied
    force."""
    iteration_limit: Count = 40
    """Largest number of Newton iterations in a load step."""
    patience: Count = 15
    """Newton iterations without a smaller imbalance after which a load step has failed."""
    largest_move_mm: Positive = 8.0
    """Largest displacement of a node in one Newton iteration [mm]."""
    halving_limit: CountOrNone = 5
    """How often a load step that fails may be halved, and a Newton step that turns rubber inside
    out."""


_KEPT_MM = 1e-6
"""How far a kept mean may be from zero; it is linear, so a whole Newton step makes it zero."""


@dataclass(frozen=True, eq=False)
class StaticResult:
    """Where the forces balance, and how the search ended."""

    positions: np.ndarray
    """Node positions [mm], (node, 3)."""
    converged: bool
    """Whether the tolerance was reached at the full pressure."""
    relative_residual: float
    """Unbalanced force over the largest applied one."""
    iterations: int
    """Newton steps in all."""
    pressure_kPa: float
    """Pressure of the positions: the wanted one where converged [kPa]."""
    keeping_mN: float = 0.0
    """Force along `kept` that keeps the mean in place."""


def static_equilibrium(
    part: PartModel,
    pressure_kPa: float,
    held_nodes: np.ndarray,
    *,
    start: np.ndarray | None = None,
    start_pressure_kPa: float = 0.0,
    external_force: np.ndarray | None = None,
    rotation: Rotation = "edge",
    settings: StaticSettings | None = None,
) -> StaticResult:
    """Find x with internal_force(x) + p dV/dx + external = 0 on the free nodes.

    Newton's method on the full tangent (rotations and follower load included), its step limited in
    length, along a path of rising pressure.

    Args:
        part: The part.
        pressure_kPa: Pressure in the cavity [kPa]; must be 0 for a part without one.
        held_nodes: Nodes that stay at their place of `start`, (n,).
        start: Positions to start from [mm], (node, 3); rest by default.
        start_pressure_kPa: Pressure at which `start` is an equilibrium [kPa].
        external_force: Further force on the nodes [mN], (node, 3).
        rotation: Where the elements take their rotation from.
        settings: Steps and tolerance.

    Returns:
        The last equilibrium found; look at `converged`.

    Raises:
        ValueError: The pressure is not finite, or too few nodes are held.
    """
    problem = _Problem.of(part, held_nodes, rotation, settings, external_force)
    return next(_equilibria(problem, [pressure_kPa], start, start_pressure_kPa))


def raised_equilibrium(
    part: PartModel,
    pressure_kPa: float,
    held_nodes: np.ndarray,
    external_force: np.ndarray,
    *,
    rotation: Rotation = "edge",
    settings: StaticSettings | None = None,
) -> StaticResult:
    """The same from rest, the load in shares, for forces that are too strong to be applied at once.

    Each share has the same part of force and pressure: its force is applied at once, its pressure
    then rises in load steps, which are not halved. A share that fails is halved as a whole: the
    first is a half, the smallest 2^-`halving_limit` of the load.

    Args:
        part: The part.
        pressure_kPa: Pressure in the cavity [kPa]; must be 0 for a part without one.
        held_nodes: Nodes that stay at rest, (n,).
        external_force: Further force on the nodes [mN], (node, 3).
        rotation: Where the elements take their rotation from.
        settings: Steps and tolerance.

    Returns:
        The last equilibrium found; look at `converged`, which says whether it is of all the load.

    Raises:
        ValueError: The pressure is not finite, or too few nodes are held.
    """
    settings = settings or StaticSettings()
    found = StaticResult(np.array(part.rest_nodes, dtype=float), False, np.inf, 0, 0.0)
    share, step, iterations = 0.0, 0.5, 0
    while share < 1.0 and step >= 0.5**settings.halving_limit:
        target = min(share + step, 1.0)
        problem = _Problem.of(part, held_nodes, rotation, settings, target * external_force)
        (tried,) = _equilibria(
            problem, [target * pressure_kPa], found.positions, share * pressure_kPa, load_halvings=0
        )
        iterations += tried.iterations
        if tried.converged:
            found, share = tried, target
        else:
            step *= 0.5
    return replace(found, converged=share == 1.0, iterations=iterations)


def rising_equilibria(
    part: PartModel,
    pressures_kPa: Iterable[float],
    held_nodes: np.ndarray,
    *,
    kept: np.ndarray | None = None,
    rotation: Rotation = "edge",
    settings: StaticSettings | None = None,
) -> Iterator[StaticResult]:
    """Equilibria at one pressure after the other, each from the one before.

    The last may not have converged: it has none after it. Other arguments as of
    `static_equilibrium`.

    Args:
        kept: Weights (node, 3) of a mean of the displacements that a force along them keeps at
            zero. The force is one more unknown of Newton's method, so it may be one at which the
            part would snap if it were given instead.
    """
    yield from _equilibria(
        _Problem.of(part, held_nodes, rotation, settings, kept=kept), pressures_kPa
    )


@dataclass(frozen=True, eq=False)
class _Problem:
    """What stays the same along a path of pressure."""

    part: PartModel
    solver: Tangent
    external: np.ndarray
    """Further force on the nodes [mN], (node, 3)."""
    kept: np.ndarray | None
    """Weights (node, 3) of the mean that is kept; None for none."""
    rotation: Rotation
    settings: StaticSettings

    @classmethod
    def of(
        cls,
        part: PartModel,
        held_nodes: np.ndarray,
        rotation: Rotation,
        settings: StaticSettings | None,
        external_force: np.ndarray | None = None,
        kept: np.ndarray | None = None,
    ) -> _Problem:
        """As the arguments of the functions above have it."""
        held = np.unique(np.asarray(held_nodes))
        if len(held) < 3:
            raise ValueError(
                f"held_nodes must name at least 3 nodes, got {len(held)}: it would float"
            )
        solver = tangent_of(part, held, rotation)
        still = np.zeros_like(part.rest_nodes, dtype=float)
        external = still if external_force is None else np.asarray(external_force)
        return cls(part, solver, external, kept, rotation, settings or StaticSettings())

    def unbalanced(
        self, x: np.ndarray, pressure: float, keeping: float
    ) -> tuple[np.ndarray, float]:
        """Unbalanced force on the free unknowns, and its norm over that of the load."""
        load = self.external + (self.part.pressure_force(x, pressure) if pressure != 0.0 else 0.0)
        if self.kept is not None:
            load = load + keeping * self.kept
        residual = (self.part.internal_force(x, self.rotation) + load).ravel()[self.solver.free]
        return residual, float(np.linalg.norm(residual)) / max(float(np.linalg.norm(load)), 1.0)

    def mean(self, x: np.ndarray) -> float:
        """The mean that is kept at zero [mm]."""
        return 0.0 if self.kept is None else float(np.sum(self.kept * (x - self.part.rest_nodes)))


def _equilibria(
    problem: _Problem,
    pressures_kPa: Iterable[float],
    start: np.ndarray | None = None,
    start_pressure_kPa: float = 0.0,
    load_halvings: int | None = None,
) -> Iterator[StaticResult]:
    """Equilibria along one path of pressure, up to the first that is not found; `load_halvings`
    tells how often a load step may be halved, as the settings say if None."""
    settings, solver = problem.settings, problem.solver
    x = np.array(problem.part.rest_nodes if start is None else start, dtype=float)
    current, residual, keeping = float(start_pressure_kPa), np.inf, 0.0
    halvings = settings.halving_limit if load_halvings is None else load_halvings
    smallest = settings.load_step_kPa / 2.0**halvings
    for pressure in pressures_kPa:
        if not np.isfinite(pressure):
            raise ValueError(f"pressure_kPa must be finite, got {pressure}")
        iterations, step, arrived = 0, settings.load_step_kPa, False
        while not arrived and step >= smallest:
            target = current + float(np.clip(pressure - current, -step, step))
            solver.met_indefinite = False
            # A search that met indefinite tangents and failed is made again the other way.
            for solver.raises in (False, True):
                tried = _newton(problem, x, keeping, target, current)
                iterations += tried.iterations
                if tried.converged or not solver.met_indefinite:
                    break
            if tried.converged:
                x, keeping, residual = tried.positions, tried.keeping_mN, tried.relative_residual
                current = target
                arrived = current == pressure
            else:
                step = 0.5 * abs(target - current)
        yield StaticResult(x, arrived, residual, iterations, current, keeping)
        if not arrived:
            return


def _newton(
    problem: _Problem, start: np.ndarray, keeping: float, pressure: float, before: float
) -> StaticResult:
    """One load step, from positions and the force along `kept`.

    The first Newton step has the tangent at the pressure `before`, whose equilibrium they are: with
    the pressure to come it may be of a leg that snaps, where the leg has yet to bend by that much.
    """
    settings = problem.settings
    x, step, best, since = start, np.zeros_like(start), np.inf, 0
    residual, relative = problem.unbalanced(x, pressure, keeping)
    iteration = 0
    while np.isfinite(relative):
        if relative < settings.tolerance and abs(problem.mean(x)) < _KEPT_MM:
            return StaticResult(x, True, relative, iteration, pressure, keeping)
        best, since = (relative, 0) if relative < best else (best, since + 1)
        if iteration == settings.iteration_limit or since == settings.patience:
            break
        known = before if iteration == 0 else pressure
        step, more = _step(problem, x, known, residual, step)
        longest = float(np.linalg.norm(step, axis=1).max())
        shorter = min(1.0, settings.largest_move_mm / max(longest, 1e-300))
        step, more = shorter * step, shorter * more
        residual, relative = problem.unbalanced(x + step, pressure, keeping + more)
        # Rubber that a step turns inside out has no energy: a shorter one does not.
        for _ in range(settings.halving_limit):
            if np.isfinite(relative):
                break
            step, more = 0.5 * step, 0.5 * more
            residual, relative = problem.unbalanced(x + step, pressure, keeping + more)
        x, keeping = x + step, keeping + more
        iteration += 1
    return StaticResult(x, False, relative, iteration, pressure, keeping)


def _step(
    problem: _Problem, x: np.ndarray, pressure: float, residual: np.ndarray, before: np.ndarray
) -> tuple[np.ndarray, float]:
    """Newton's step, (node, 3), and the change of the force along `kept`.

    With weights w, tangent K, residual r and mean m: K dx = r + df w and w . dx = -m, by
    elimination of dx.
    """
    kept, solver = problem.kept, problem.solver
    if kept is None:
        return solver.solve(x, pressure, residual[:, None], before).reshape(-1, 3), 0.0
    weights = kept.ravel()
    right = np.stack([residual, weights[solver.free]], axis=1)
    to_residual, to_force = solver.solve(x, pressure, right, before).T
    more = -(problem.mean(x) + weights @ to_residual) / float(weights @ to_force)
    return (to_residual + more * to_force).reshape(-1, 3), float(more)
