"""Parts, robots and physics as the compiled engine takes them: arrays and numbers by name."""

from __future__ import annotations

from typing import Any

import numpy as np

import pneumorph._engine as _engine
from pneumorph.fem.law_registry import make_law
from pneumorph.physics.floor import HeightField
from pneumorph.physics.height_grid import HeightGrid
from pneumorph.physics.physics import Physics
from pneumorph.physics.regulators import CELL_COUNT, AirRegulators
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.robot.robot import Robot
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.robot_air import regulators_of
from pneumorph.simulation.stepper_settings import StepperSettings

_PART_ARRAYS = (
    "tetrahedron_rest", "tetrahedron_mode_gradient", "membrane_rest", "membrane_mode_gradient",
    "dilatation_1", "dilatation_2", "dilatation_3", "stretch_1", "stretch_2",
    "wall_axis", "wall_axis_modes", "wall_pair_gap", "wall_pair", "wall_pair_modes",
    "wall_pair_stiffness",
    "linear_stiffness", "cavity_volume_1", "cavity_volume_2", "cavity_volume_3",
    "first_moment", "first_moment_modes", "second_moment", "second_moment_modes",
    "second_moment_mode_pairs", "contact_points", "contact_modes", "contact_flexibility",
    "snapshot_range",
)  # fmt: skip


def part_arrays(part: ReducedPart, physics: Physics) -> dict[str, object]:
    """A reduced part as the engine has it.

    Args:
        part: The part.
        physics: What acts on it.

    Raises:
        ValueError: A law that the engine does not know, constants that the law refuses, or a part
            that relaxes under published damping.
    """
    arrays: dict[str, object] = {
        name: np.ascontiguousarray(getattr(part, name), dtype=float) for name in _PART_ARRAYS
    }
    arrays["mass"] = float(part.mass)
    sampled = (("tetrahedron", part.tetrahedra, 3), ("membrane", part.membrane, 2))
    for name, elements, dimension in sampled:
        law = elements.material.law
        if law not in _engine.LAWS:
            raise ValueError(
                f"a reduced part's law must be one of {', '.join(_engine.LAWS)} to be stepped, got "
                f"{law!r}; a robot of your own law walks as finite elements"
            )
        make_law(elements.material, dimension)
        arrays[f"{name}_law"] = _engine.LAWS.index(law)
        arrays[f"{name}_lambda"], arrays[f"{name}_mu"] = elements.weighted_lame_constants
    return arrays | _rubber_arrays(part, physics)


def _rubber_arrays(part: ReducedPart, physics: Physics) -> dict[str, object]:
    """What parts of measured silicone have besides; as good as nothing of others."""
    material, series = part.tetrahedron_material, part.relaxation
    if series is not None and physics.damping != "objective":
        raise ValueError(
            f"physics.damping is {physics.damping!r}, expected 'objective' for a part that "
            "relaxes: its branches damp it, and resist no turn of the whole"
        )
    mixed = len(part.dilatation_1) + len(part.stretch_1) + len(part.wall_axis)
    if material.law == "corotational" and (series is not None or mixed > 0):
        raise ValueError(
            "the solid's law is 'corotational', expected one of large strain, such as 'yeoh', for "
            "a part that relaxes, has volumes of whole elements, a sheet seen by fields of stress "
            "or walls that may meet"
        )
    return {
        "yeoh_c2_over_c1": material.yeoh_c2_over_c1,
        "yeoh_c3_over_c1": material.yeoh_c3_over_c1,
        "dilatation_lambda": material.lame_lambda,
        "stretch_modulus": part.membrane_material.young_modulus_kPa,
        "branch_ratio": np.zeros(0) if series is None else series.branch_ratios,
        "branch_time": np.ascontiguousarray(part.relaxation_time, dtype=float),
    }


def contact_friction(robot: Robot, physics: Physics) -> np.ndarray:
    """Coefficient of each contact point, and the normal impulse at which it is so, (point, 2)."""
    surfaces = robot.contact_surfaces
    given = physics.surface_friction(surfaces), physics.reference_impulses(surfaces)
    return np.stack(given, axis=1)


def pressure_rates(robot: Robot, physics: Physics) -> np.ndarray:
    """Rates of each regulator's pressure, rising and falling, as the engine has them [kPa/s]."""
    regulators = regulators_of(robot, physics)
    if not isinstance(regulators, AirRegulators):
        return np.zeros(0)
    rates = np.stack([regulators.rising_kPa_per_s, regulators.falling_kPa_per_s], axis=1)
    return rates.ravel()


def floor_height(robot: Robot, physics: Physics) -> float:
    """What a robot's floor is counted from [mm]."""
    if physics.ground.is_plane:
        return physics.floor_height_mm
    floor = physics.floor(robot.standing_points)
    assert isinstance(floor, HeightField)
    return floor.base_mm


def ground_arrays(grid: HeightGrid) -> tuple[Any, ...]:
    """A ground as engine/model.hpp has it."""
    corner = np.array([grid.x_mm[0], grid.y_mm[0]])
    tiles = grid.tile_cells, grid.ceilings
    return corner, grid.spacing_mm, grid.nodes, grid.steepest, *tiles


def conditions(physics: Physics, world: World | None, floor_height_mm: float) -> np.ndarray:
    """What of a robot's world the engine keeps for it alone; see engine/conditions.hpp."""
    factors = (
        (1.0, 1.0, 1.0)
        if world is None
        else (world.modulus_factor, world.mass_factor, world.damping_factor)
    )
    damping = physics.stiffness_damping_s
    return np.array([*physics.gravity_vector, damping, *factors, floor_height_mm])


def engine_settings(physics: Physics, stepper: StepperSettings) -> dict[str, Any]:
    """Numbers that all robots of a batch share, as engine/model.hpp names them."""
    return {
        "time_step": physics.time_step_s,
        "gravity": physics.gravity_vector,
        "mass_damping": physics.mass_damping_per_s,
        "stiffness_damping": physics.stiffness_damping_s,
        "published_damping": physics.damping == "published",
        "edge_rotations": physics.rotation == "edge",
        "friction_exponent": physics.friction_pressure.exponent,
        "friction_least": physics.friction_pressure.least_factor,
        "friction_most": physics.friction_pressure.most_factor,
        "floor_height": physics.floor_height_mm,
        "contact_margin": stepper.contact_margin_mm,
        "contact_tolerance": stepper.contact_tolerance_mm_per_s,
        "contact_sweeps": stepper.contact_sweeps,
        "pressure_rate": physics.pressure_rate_kPa_per_s,
        "pressure_cells": 0 if physics.air.law == "rate_limit" else CELL_COUNT,
        "pressure_cell": physics.air.supply_kPa / CELL_COUNT,
        "pressure_slope": physics.pressure_map.slope,
        "pressure_intercept": physics.pressure_map.intercept_kPa,
        "speed_limit": stepper.speed_limit_mm_per_s,
        "tangent_tolerance": stepper.tangent_tolerance_mm_per_s,
        "foreseen": stepper.linearised == "ahead",
        "regulator_count": physics.regulator_count,
    }
