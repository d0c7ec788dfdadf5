"""Snapshots of a single part at rest under load: free bending, and contact-like forces.

Free-bending equilibria belong among the snapshots: a basis from crawling alone represented every
crawling snapshot to 0.02 mm and was still 30 % too stiff in free air.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.base.checked import Checked, Count, CountOrNone, NotNegative, Positive
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.static import (
    StaticSettings,
    raised_equilibrium,
    rising_equilibria,
    static_equilibrium,
)
from pneumorph.geometry.face_tie import FaceTie
from pneumorph.geometry.region_names import current_name
from pneumorph.physics.physics import Rotation
from pneumorph.reduction.snapshots import BEND, Snapshots

GRAVITY_MM_S2 = 9800.0
# Snapshots are stored in single precision.
_SOLVER = StaticSettings(tolerance=1e-6)


@dataclass(frozen=True)
class StaticSnapshotSettings(Checked):
    """Equilibria of a single leg, from which the reduction learns."""

    bend_pressure_kPa: Positive = 360.0
    """Highest simulated pressure of free bending, which starts from 0 [kPa]."""
    bend_count: Count = 24
    """Number of free-bending equilibria, evenly spaced in pressure."""
    load_count: CountOrNone = 120
    """Number of equilibria under gravity and a random force on the loaded surface."""
    load_pressure_kPa: NotNegative = 350.0
    """Highest simulated pressure of the equilibria under load [kPa]; pressures are drawn uniformly
    from 0."""
    load_limit_mN: NotNegative = 1500.0
    """Largest normal force [mN]; forces are drawn uniformly from 0."""
    friction: NotNegative = 1.2
    """Friction coefficient: tangential forces are drawn uniformly up to this many times the normal
    force. Robots that walk for snapshots have it too."""
    patch_radius_mm: Positive = 9.0
    """A force is spread over the surface nodes within this distance of a randomly drawn one
    [mm]."""
    loaded_surface: str = "sheet"
    """Surface region that touches the ground."""
    pitch_deg: float = 15.0
    """How far the leg's x axis points below the horizontal, which gives gravity's direction
    [degrees]."""
    seed: CountOrNone = 0
    """Seed of the drawn pressures and forces."""
    rotation: Rotation = "edge"
    """Rotation of linear elastic elements. `edge`: from the first edge and face, as published,
    which is not mirror-symmetric. `polar`: polar decomposition."""

    @classmethod
    def upgraded(cls, content: Mapping[str, Any]) -> dict[str, Any]:
        """Settings of an earlier version, with the region as it is called now."""
        surface = content.get("loaded_surface")
        return {**content, "loaded_surface": current_name(surface)} if surface else dict(content)


def bend_snapshots(part: PartModel, settings: StaticSnapshotSettings) -> Snapshots:
    """Free bending from zero to the largest pressure, without gravity: with it in all cavities
    (source ``bend``), and where there are several in each alone (``bend of NAME``).

    Args:
        part: The part, held at its attachment nodes.
        settings: Pressures.
    """
    pressures = np.linspace(0.0, settings.bend_pressure_kPa, settings.bend_count + 1)[1:]
    held = FaceTie.of(part.mesh).nodes
    pieces = []
    for source, inflated in _directions(part):
        found = [
            each
            for each in rising_equilibria(inflated, pressures, held, rotation=settings.rotation)
            if each.converged
        ]
        states = [each.positions - part.rest_nodes for each in found]
        reached = [each.pressure_kPa for each in found]
        pieces.append(_snapshots(part, states, reached, source, {"asked": len(pressures)}))
    return pieces[0] if len(pieces) == 1 else Snapshots.joined(pieces)


def _directions(part: PartModel) -> list[tuple[str, PartModel]]:
    """The part as it is, and where it has several cavities inflated in each alone."""
    if len(part.cavities) < 2:
        return [(BEND, part)]
    alone = map(part.inflated_in, np.eye(len(part.cavities)))
    names = [f"{BEND} of {name}" for name in part.cavity_names]
    return [(BEND, part), *zip(names, alone, strict=True)]


def load_snapshots(
    part: PartModel,
    settings: StaticSnapshotSettings,
    numbers: Sequence[int],
    bend: Snapshots | None = None,
) -> Snapshots:
    """Equilibria under gravity, pressure and one random contact-like force each.

    One that is not found at once is sought again from rest, force and pressure rising together.

    Args:
        part: The part, held at its attachment nodes.
        settings: Ranges.
        numbers: Which of the settings' ``load_count`` random loads to compute; each depends on
            the seed and its own number only.
        bend: Free-bending equilibria to start from, which saves raising the pressure each time.
    """
    held = FaceTie.of(part.mesh).nodes
    pitch = np.radians(settings.pitch_deg)
    up = np.array([-np.sin(pitch), 0.0, np.cos(pitch)])
    forward = np.array([np.cos(pitch), 0.0, np.sin(pitch)])
    sideways = np.array([0.0, 1.0, 0.0])
    nodes = np.unique(part.mesh.surface(settings.loaded_surface))
    weight = -GRAVITY_MM_S2 * part.node_mass[:, None] * up
    outer, likelihood = _touched(part.rest_nodes, nodes)
    states, pressures, failed = [], [], []
    for number in numbers:
        rng = np.random.default_rng([settings.seed, number])
        # Every fourth is without pressure: a leg spends much of a gait empty.
        pressure = 0.0 if number % 4 == 0 else rng.uniform(0.0, settings.load_pressure_kPa)
        normal = rng.uniform(0.0, settings.load_limit_mN)
        angle, radius = rng.uniform(0.0, 2.0 * np.pi), np.sqrt(rng.uniform())
        tangential = settings.friction * normal * radius
        force = (
            normal * up
            + tangential * np.cos(angle) * forward
            + tangential * np.sin(angle) * sideways
        )
        centre = part.rest_nodes[rng.choice(outer, p=likelihood)]
        patch = nodes[
            np.linalg.norm(part.rest_nodes[nodes] - centre, axis=1) < settings.patch_radius_mm
        ]
        external = weight.copy()
        external[patch] += force / len(patch)
        inflated, shares = part, np.ones(len(part.cavities))
        if len(shares) > 1:
            # Of several cavities each at its own pressure, the highest at that which was drawn.
            shares = np.random.default_rng([settings.seed, number, 1]).uniform(size=len(shares))
            inflated = part.inflated_in(shares / shares.max())
        start, start_pressure = _nearest(part, bend if inflated is part else None, pressure)
        result = static_equilibrium(
            inflated,
            pressure,
            held,
            start=start,
            start_pressure_kPa=start_pressure,
            external_force=external,
            rotation=settings.rotation,
            settings=_SOLVER,
        )
        if not result.converged:
            result = raised_equilibrium(
                inflated,
                pressure,
                held,
                external,
                rotation=settings.rotation,
                settings=_SOLVER,
            )
        if result.converged:
            states.append(result.positions - part.rest_nodes)
            pressures.append(pressure)
        else:
            failed.append(int(number))
    return _snapshots(part, states, pressures, "load", {"failed": failed})


def _touched(rest_nodes: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of a surface that may touch the ground, and how likely each is to be the middle of what
    does: its outer half, wherever on the leg that is, and the likelier the further out; all of a
    surface across the leg alike."""
    along = rest_nodes[nodes, 0]
    outwards = along - 0.5 * (along.min() + along.max())
    if not np.any(outwards > 0.0):
        return nodes, np.full(len(nodes), 1.0 / len(nodes))
    likelihood = outwards[outwards > 0.0] ** 2
    return nodes[outwards > 0.0], likelihood / likelihood.sum()


def _nearest(
    part: PartModel, bend: Snapshots | None, pressure: float
) -> tuple[np.ndarray | None, float]:
    # Positions to start from and the pressure they are at.
    if bend is None or len(bend) == 0:
        return None, 0.0
    nearest = int(np.abs(bend.pressure_kPa - pressure).argmin())
    if pressure < 0.5 * bend.pressure_kPa[nearest]:
        return None, 0.0
    start = part.rest_nodes + bend.displacement[nearest].astype(float)
    return start, pressure


def _snapshots(
    part: PartModel,
    states: list[np.ndarray],
    pressures: list[float],
    source: str,
    details: dict[str, Any],
) -> Snapshots:
    return Snapshots(
        np.array(states, dtype=np.float32).reshape(-1, part.node_count, 3),
        np.array(pressures),
        np.zeros(len(states), dtype=np.int32),
        {"mesh_digest": part.mesh.digest(), "sources": [source], "details": details},
    )
