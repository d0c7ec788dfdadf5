"""Compare reduced robots with the full ones they stand for.

Four animations (the paper's appendix B) run with both models, and a single leg is bent by rising
pressure. Errors are distances of corresponding nodes of the legs, averaged over nodes and time; in
the frame of the hub they tell shapes apart from paths.

Presets: default (3 s of each animation), paper (16 s) and quick (1 s and three pressures).

Writes bend.csv, and each animation's trajectories with --record.

Example: pneumorph compare --preset default --json
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field, replace
from typing import Annotated, Any

import numpy as np
import tyro

from pneumorph.artefact import write_atomically
from pneumorph.command.robots import RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.comparison.animation_error import AnimationError, compare_animation
from pneumorph.comparison.animations import Animation, animations
from pneumorph.comparison.bend_error import BendComparison, compare_bend
from pneumorph.fem.rotation import Rotation
from pneumorph.report.skin import with_skin_only
from pneumorph.simulation.rollout import RobotModel

flat = tyro.conf.arg(name="")


@dataclass(frozen=True)
class CompareOptions:
    """What to compare."""

    animations: tuple[str, ...] = ("hamiltonian", "baseline", "two_leg", "six_leg")
    """Animations to run; none for the bend alone."""
    duration_s: float = 3.0
    """Length of each animation."""
    record_every: int = 5
    """Time steps between compared frames."""
    record: bool = False
    """Save the trajectories of both models."""
    bend_pressures_kPa: tuple[float, ...] = (20.0, 80.0, 140.0, 200.0, 260.0, 300.0, 350.0)
    """Simulated pressures of the bend; none to leave it out."""
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)


def compare(options: CompareOptions, folder: RunFolder) -> dict[str, Any]:
    """Run both models and return the errors and the time ratio."""
    start = time.monotonic()
    workshop = Workshop(options.robot)
    workshop.check_reduction()
    chosen = animations(options.animations, options.duration_s)
    errors = [_compared(each, options, folder) for each in chosen]
    bend = _bent(workshop, options, folder)
    summary: dict[str, Any] = {"leg": workshop.leg_description}
    if errors:
        summary |= {
            "animations_mean_node_error_mm": float(np.mean([e.mean_node_error_mm for e in errors])),
            "animations_mean_node_error_in_hub_mm": float(
                np.mean([e.mean_node_error_in_hub_mm for e in errors])
            ),
            "animations": {e.name: {**asdict(e), "time_ratio": e.time_ratio} for e in errors},
            "time_ratio": float(
                sum(e.full_s_per_step for e in errors) / sum(e.reduced_s_per_step for e in errors)
            ),
            "full_s_per_step": float(np.mean([e.full_s_per_step for e in errors])),
            "reduced_s_per_step": float(np.mean([e.reduced_s_per_step for e in errors])),
        }
    if bend is not None:
        summary |= {
            "bend_error_percent": bend.error_percent,
            "bend_pressures_kPa": bend.pressure_kPa.tolist(),
            "bend_full_deg": bend.full_deg.tolist(),
            "bend_reduced_deg": bend.reduced_deg.tolist(),
        }
    return summary | {
        "full_hub": options.robot.full.hub,
        "damping": options.robot.simulation.damping,
        "calibration": workshop.calibration_description,
        "duration_s": options.duration_s,
        "wall_s": time.monotonic() - start,
    }


def _compared(animation: Animation, options: CompareOptions, folder: RunFolder) -> AnimationError:
    folder.progress.stage(f"animation {animation.name}, full and reduced")
    # The Hamiltonian animation has a regulator for every leg.
    simulation = replace(options.robot.simulation, regulator_count=animation.gait.regulator_count)
    workshop = Workshop(replace(options.robot, simulation=simulation))
    finite_elements: RobotModel[Any] = workshop.full(animation.design)
    error, full, reduced = compare_animation(
        animation,
        finite_elements,
        workshop.reduced(animation.design),
        simulation.time_step_s,
        options.record_every,
    )
    if options.record:
        for trajectory, model in ((full, "full"), (reduced, "reduced")):
            with_skin_only(trajectory).save(folder / f"{animation.name}_{model}.npz")
    folder.progress.say(
        f"  {error.mean_node_error_mm:.2f} mm on average, {error.mean_node_error_in_hub_mm:.2f} mm "
        f"in the hub's frame; {error.time_ratio:.0f} times as fast; distance "
        f"{reduced.forward_distance_cm:.2f} cm reduced, {full.forward_distance_cm:.2f} cm full"
    )
    return error


def _bent(workshop: Workshop, options: CompareOptions, folder: RunFolder) -> BendComparison | None:
    if not options.bend_pressures_kPa:
        return None
    folder.progress.stage("bending one leg, full and reduced")
    rotation: Rotation = "edge" if options.robot.simulation.damping == "published" else "polar"
    bend = compare_bend(
        workshop.full_leg,
        workshop.leg,
        options.bend_pressures_kPa,
        rotation,
        folder.progress,
    )
    rows = zip(bend.pressure_kPa, bend.full_deg, bend.reduced_deg, strict=True)
    lines = ["simulated_kPa,full_deg,reduced_deg", *(f"{p:g},{f:.4f},{r:.4f}" for p, f, r in rows)]
    text = ("\n".join(lines) + "\n").encode()
    write_atomically(folder / "bend.csv", lambda stream: stream.write(text))
    return bend


VERB = Verb(
    CompareOptions,
    compare,
    {
        "default": CompareOptions,
        "paper": lambda: CompareOptions(duration_s=16.0),
        "quick": lambda: CompareOptions(duration_s=1.0, bend_pressures_kPa=(80.0, 200.0, 350.0)),
    },
)
