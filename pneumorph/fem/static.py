"""Static equilibrium of a clamped part under pressure and given forces."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone, Positive
from pneumorph.fem.cavity import Pressure
from pneumorph.fem.frontal_cholesky import FrontalCholesky, FrontPattern
from pneumorph.fem.part_model import PartModel
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
    return next(
        _equilibria(
            part,
            [pressure_kPa],
            held_nodes,
            start,
            start_pressure_kPa,
            external_force,
            rotation,
            settings or StaticSettings(),
        )
    )


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
        (tried,) = _equilibria(
            part,
            [target * pressure_kPa],
            held_nodes,
            found.positions,
            share * pressure_kPa,
            target * external_force,
            rotation,
            settings,
            load_halvings=0,
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
        part,
        pressures_kPa,
        held_nodes,
        None,
        0.0,
        None,
        rotation,
        settings or StaticSettings(),
        kept,
    )


class UnstableError(ArithmeticError):
    """A state under load is no stable equilibrium."""


def static_answers(
    part: PartModel,
    x: np.ndarray,
    pressure_kPa: Pressure,
    held_nodes: np.ndarray,
    forces_mN: np.ndarray,
    rotation: Rotation = "edge",
) -> np.ndarray:
    """How the nodes move under small further forces, with the whole tangent at an equilibrium.

    Args:
        part: The part.
        x: The equilibrium [mm], (node, 3).
        pressure_kPa: Pressure in the cavities, or of each [kPa].
        held_nodes: Nodes that stay, (n,).
        forces_mN: Forces on the nodes, (node, 3, force).
        rotation: Where the elements take their rotation from.

    Returns:
        Displacements [mm], (node, 3, force).

    Raises:
        UnstableError: The equilibrium is not stable; small forces say nothing of where it goes.
    """
    tangent = _SymmetricTangent if part.has_potential(rotation) else _Tangent
    solver = tangent(part, np.unique(np.asarray(held_nodes)), rotation)
    flat = forces_mN.reshape(x.size, -1)[solver.free]
    try:
        return solver.answers(x, pressure_kPa, flat).reshape(forces_mN.shape)
    except np.linalg.LinAlgError as error:
        raise UnstableError(
            f"the state at {pressure_kPa} kPa is no stable equilibrium, expected one for its "
            "answers to small forces; the part may buckle"
        ) from error


def _equilibria(
    part: PartModel,
    pressures_kPa: Iterable[float],
    held_nodes: np.ndarray,
    start: np.ndarray | None,
    start_pressure_kPa: float,
    external_force: np.ndarray | None,
    rotation: Rotation,
    settings: StaticSettings,
    kept: np.ndarray | None = None,
    load_halvings: int | None = None,
) -> Iterator[StaticResult]:
    """Equilibria along one path of pressure, up to the first that is not found; `load_halvings`
    tells how often a load step may be halved, as the settings say if None."""
    held = np.unique(np.asarray(held_nodes))
    if len(held) < 3:
        raise ValueError(f"held_nodes must name at least 3 nodes, got {len(held)}: it would float")
    tangent = _SymmetricTangent if part.has_potential(rotation) else _Tangent
    solver = tangent(part, held, rotation)
    x = np.array(part.rest_nodes if start is None else start, dtype=float)
    external = np.zeros_like(x) if external_force is None else np.asarray(external_force)
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
                tried = _newton(
                    part, x, keeping, target, current, external, kept, solver, rotation, settings
                )
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
    part: PartModel,
    start: np.ndarray,
    keeping: float,
    pressure: float,
    before: float,
    external: np.ndarray,
    kept: np.ndarray | None,
    solver: _Tangent,
    rotation: Rotation,
    settings: StaticSettings,
) -> StaticResult:
    """One load step, from positions and the force along `kept`.

    The first Newton step has the tangent at the pressure `before`, whose equilibrium they are: with
    the pressure to come it may be of a leg that snaps, where the leg has yet to bend by that much.
    """

    def unbalanced(x: np.ndarray, keeping: float) -> tuple[np.ndarray, float]:
        load = external + (part.pressure_force(x, pressure) if pressure != 0.0 else 0.0)
        if kept is not None:
            load = load + keeping * kept
        residual = (part.internal_force(x, rotation) + load).ravel()[solver.free]
        return residual, float(np.linalg.norm(residual)) / max(float(np.linalg.norm(load)), 1.0)

    def mean(x: np.ndarray) -> float:
        return 0.0 if kept is None else float(np.sum(kept * (x - part.rest_nodes)))

    x, step, best, since = start, np.zeros_like(start), np.inf, 0
    residual, relative = unbalanced(x, keeping)
    iteration = 0
    while np.isfinite(relative):
        if relative < settings.tolerance and abs(mean(x)) < _KEPT_MM:
            return StaticResult(x, True, relative, iteration, pressure, keeping)
        best, since = (relative, 0) if relative < best else (best, since + 1)
        if iteration == settings.iteration_limit or since == settings.patience:
            break
        known = before if iteration == 0 else pressure
        step, more = _step(solver, x, known, residual, step, kept, mean(x))
        longest = float(np.linalg.norm(step, axis=1).max())
        shorter = min(1.0, settings.largest_move_mm / max(longest, 1e-300))
        step, more = shorter * step, shorter * more
        residual, relative = unbalanced(x + step, keeping + more)
        # Rubber that a step turns inside out has no energy: a shorter one does not.
        for _ in range(settings.halving_limit):
            if np.isfinite(relative):
                break
            step, more = 0.5 * step, 0.5 * more
            residual, relative = unbalanced(x + step, keeping + more)
        x, keeping = x + step, keeping + more
        iteration += 1
    return StaticResult(x, False, relative, iteration, pressure, keeping)


def _step(
    solver: _Tangent,
    x: np.ndarray,
    pressure: float,
    residual: np.ndarray,
    before: np.ndarray,
    kept: np.ndarray | None,
    mean: float,
) -> tuple[np.ndarray, float]:
    """Newton's step, (node, 3), and the change of the force along `kept`.

    With weights w, tangent K, residual r and mean m: K dx = r + df w and w . dx = -m, by
    elimination of dx.
    """
    if kept is None:
        return solver.solve(x, pressure, residual[:, None], before).reshape(-1, 3), 0.0
    weights = kept.ravel()
    right = np.stack([residual, weights[solver.free]], axis=1)
    to_residual, to_force = solver.solve(x, pressure, right, before).T
    more = -(mean + weights @ to_residual) / float(weights @ to_force)
    return (to_residual + more * to_force).reshape(-1, 3), float(more)


class _Tangent:
    """Solves for the free unknowns with the whole tangent of a part.

    Attributes:
        met_indefinite: Whether a tangent was not definite where it has to be.
        raises: Whether such a tangent's diagonal is raised.
    """

    met_indefinite = raises = False

    def __init__(self, part: PartModel, held: np.ndarray, rotation: Rotation) -> None:
        self._part, self._rotation = part, rotation
        free_node = np.ones(part.node_count, dtype=bool)
        free_node[held] = False
        self.free: np.ndarray = np.flatnonzero(np.repeat(free_node, 3))

    def solve(
        self, x: np.ndarray, pressure: Pressure, forces: np.ndarray, before: np.ndarray
    ) -> np.ndarray:
        """A step of Newton's method; `before` is the one that led to x, (node, 3)."""
        return self.answers(x, pressure, forces)

    def answers(self, x: np.ndarray, pressure: Pressure, forces: np.ndarray) -> np.ndarray:
        """Changes of all unknowns, (3 node, column), by forces on the free ones, (free, column)."""
        from scipy.sparse.linalg import splu

        tangent = self._part.tangent(x, pressure, self._rotation)
        change = np.zeros((tangent.shape[0], forces.shape[1]))
        change[self.free] = splu(
            tangent[self.free][:, self.free].tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        ).solve(forces)
        return change


_RAISED = (1e-3, 4e-3, 1.6e-2, 6.4e-2, 0.25)
"""By which shares of itself a tangent's diagonal is raised until the tangent is definite."""


class _SymmetricTangent(_Tangent):
    """The same by frontal Cholesky factors, many times as fast.

    Where the tangent is not definite, away from stable equilibria, another leads down the energy:
    Newton's method would go on to a saddle. The nearest definite matrix of the elements, without
    the pressure's, carries a part that buckles as a whole. Where a few elements snap, as at sharp
    inner edges of fine meshes, it creeps, and the tangent whose diagonal is raised until it is
    definite (Nocedal and Wright, Numerical Optimization, algorithm 3.3) needs a few steps.
    """

    def __init__(self, part: PartModel, held: np.ndarray, rotation: Rotation) -> None:
        super().__init__(part, held, rotation)
        self._pattern = FrontPattern(part.assembly, held, "tree")

    def solve(
        self, x: np.ndarray, pressure: Pressure, forces: np.ndarray, before: np.ndarray
    ) -> np.ndarray:
        """As `_Tangent.solve`.

        Raises:
            numpy.linalg.LinAlgError: The held nodes leave the part free to move.
        """
        part, rotation = self._part, self._rotation
        data = part.tangent_data(x, pressure, rotation, change=before)
        diagonal = data[part.assembly.diagonal]
        for share in (0.0, *(_RAISED if self.raises else ())):
            data[part.assembly.diagonal] = diagonal + share * np.abs(diagonal)
            try:
                return self._by(data, forces)
            except np.linalg.LinAlgError:
                self.met_indefinite = True
        return self._by(part.tangent_data(x, pressure, rotation, definite=True), forces)

    def answers(self, x: np.ndarray, pressure: Pressure, forces: np.ndarray) -> np.ndarray:
        """As `_Tangent.answers`.

        Raises:
            numpy.linalg.LinAlgError: The tangent is not definite.
        """
        return self._by(self._part.tangent_data(x, pressure, self._rotation), forces)

    def _by(self, data: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Changes of all unknowns by the tangent of these data."""
        change = np.zeros((3 * self._part.node_count, forces.shape[1]))
        change[self.free] = forces
        factor = FrontalCholesky(self._pattern, data)
        change[self._pattern.unknowns] = factor.solve(change[self._pattern.unknowns])
        return change
