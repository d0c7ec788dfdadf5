"""Compare reduced robots with the full ones they stand for.

Three comparisons: the four test animations of the paper's appendix B; the same floating without
gravity or floor, which tells the error of shapes from what friction makes of it; and held-out
robots, random designs under random gaits that no snapshot came from. A single leg is bent by rising
pressure. Full-order trajectories take minutes each: they are kept in RUN/full_order, those of the
leg that ships come with the package, and an interrupted one goes on.

With --grid, further reductions of the leg walk the four animations too: their errors against the
time of a step are figure 12 of the paper.

Presets: default (10 s), paper (16 s) and quick (1 s of two animations).

Writes bend.csv and figures, and the reduced trajectories with --record.

Example: pneumorph compare --preset default --json
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from pneumorph.artefact import write_atomically
from pneumorph.command.model_pair import ModelPair
from pneumorph.command.reduction_grid import reduction_grid
from pneumorph.command.robots import RobotOptions, Workshop
from pneumorph.command.run_folder import RunFolder
from pneumorph.command.verb import Verb
from pneumorph.comparison.animations import Animation, animations
from pneumorph.comparison.bend_error import BendComparison, bend_of_report, compare_bend
from pneumorph.comparison.full_order_store import FullOrderStore
from pneumorph.comparison.heldout import heldout_animations
from pneumorph.comparison.robot_error import RobotError, node_error, robot_error
from pneumorph.fem.benchmark import FullBenchmark, bench_full
from pneumorph.fem.rotation import Rotation
from pneumorph.presets import data_folder
from pneumorph.report.bend_figure import bend_figure
from pneumorph.report.node_error_figure import node_error_figure
from pneumorph.report.style import save_figure
from pneumorph.report.tolerance_figure import tolerance_figure

flat = tyro.conf.arg(name="")


@dataclass(frozen=True)
class CompareOptions:
    """What to compare."""

    animations: tuple[str, ...] = ("hamiltonian", "baseline", "two_leg", "six_leg")
    """Animations to run, on the floor and floating."""
    heldout_count: int = 12
    """Random designs with random gaits to run."""
    duration_s: float = 10.0
    """Length of each run."""
    floating_duration_s: float = 4.0
    """Length of the animations without gravity or floor; 0 leaves them out."""
    record_every: int = 10
    """Time steps between compared frames."""
    record: bool = False
    """Save the reduced trajectories too."""
    bend_limit_kPa: float = 300.0
    """Largest simulated pressure of the bend; the full model's equilibria are in the reduction's
    report."""
    bend_pressures_kPa: tuple[float, ...] = ()
    """Simulated pressures at which to bend both models anew."""
    timed_steps: int = 21
    """Steps of the full robot that are timed; 0 leaves the time ratio out."""
    grid: tuple[Path, ...] = ()
    """Reductions of the same leg with other tolerances, as `pneumorph reduce` writes them."""
    full_order: Path | None = None
    """Folder of kept full-order trajectories; by default RUN/full_order and what ships."""
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)


def compare(options: CompareOptions, folder: RunFolder) -> dict[str, Any]:
    """Run both models and return the errors and the time ratio."""
    start = time.monotonic()
    workshop = Workshop(options.robot)
    workshop.check_reduction()
    runs = {
        "animations": animations(options.animations, options.duration_s),
        "heldout": heldout_animations(options.heldout_count, options.duration_s),
    }
    if options.floating_duration_s > 0.0:
        runs["floating"] = animations(options.animations, options.floating_duration_s)
    summary: dict[str, Any] = {"leg": workshop.leg_description}
    for kind, chosen in runs.items():
        errors, curves = _errors(chosen, kind, options, folder)
        summary |= _means(kind, errors)
        if curves:
            step_s = options.record_every * options.robot.simulation.time_step_s
            figure = node_error_figure(curves, step_s)
            save_figure(figure, folder / f"{kind}_node_error.png")
    if options.grid:
        summary["tolerance_grid"] = table = _grid(runs["animations"], options, folder)
        save_figure(tolerance_figure(table), folder / "tolerances.png")
    bend = _bent(workshop, options, folder)
    figure = bend_figure(
        bend.pressure_kPa.tolist(), bend.full_deg.tolist(), bend.reduced_deg.tolist()
    )
    save_figure(figure, folder / "bend.png")
    summary |= {
        "bend_error_percent": bend.error_percent,
        "bend_pressures_kPa": bend.pressure_kPa.tolist(),
        "bend_full_deg": bend.full_deg.tolist(),
        "bend_reduced_deg": bend.reduced_deg.tolist(),
    }
    if options.timed_steps > 0:
        summary |= _time_ratio(options, folder)
    return summary | {
        "full_hub": options.robot.full.hub,
        "damping": options.robot.simulation.damping,
        "calibration": workshop.calibration_description,
        "duration_s": options.duration_s,
        "wall_s": time.monotonic() - start,
    }


def _errors(
    chosen: Sequence[Animation], kind: str, options: CompareOptions, folder: RunFolder
) -> tuple[dict[str, RobotError], dict[str, np.ndarray]]:
    """Errors of animations by name, and the mean node error of each frame [mm]."""
    store = _store(options, folder)
    errors, curves = {}, {}
    for animation in chosen:
        name = f"{kind}_{animation.name}" if kind == "floating" else animation.name
        folder.progress.stage(name)
        pair = ModelPair(animation, options.robot, floating=kind == "floating")
        full = pair.full(store, name, options.record_every, folder.progress)
        reduced = pair.reduced(options.record_every, like=full)
        if options.record:
            reduced.save(folder / f"{name}_reduced.npz")
        error = errors[animation.name] = robot_error(full, reduced)
        curves[animation.name] = node_error(full, reduced).mean(axis=(1, 2))
        folder.progress.say(
            f"  {error.mean_node_error_mm:.2f} mm on average, "
            f"{error.mean_node_error_in_hub_mm:.2f} mm in the hub's frame; distance "
            f"{error.forward_reduced_cm:.2f} cm reduced, {error.forward_full_cm:.2f} cm full"
        )
    return errors, curves


def _store(options: CompareOptions, folder: RunFolder) -> FullOrderStore:
    own = options.full_order or folder.path / "full_order"
    return FullOrderStore((own, data_folder("full_order")))


def _grid(
    chosen: Sequence[Animation], options: CompareOptions, folder: RunFolder
) -> list[dict[str, Any]]:
    folder.progress.stage("walking further reductions")
    store = _store(options, folder)
    walks = []
    for animation in chosen:
        pair = ModelPair(animation, options.robot)
        full = pair.full(store, animation.name, options.record_every, folder.progress)
        walks.append((animation, full))
    return reduction_grid(options.grid, walks, options.robot, options.record_every, folder)


def _means(kind: str, errors: dict[str, RobotError]) -> dict[str, Any]:
    """Means over runs of one kind, the worst, and each run's own errors."""
    if not errors:
        return {}
    table = {name: asdict(error) for name, error in errors.items()}
    averaged = ("mean_node_error_mm", "mean_node_error_in_hub_mm", "path_error_mm",
                "leg_force_error_percent", "slip_agreement_percent",
                "slipping_points_overlap_percent")  # fmt: skip
    means = {f"{kind}_{name}": _mean([each[name] for each in table.values()]) for name in averaged}
    distance = [error.distance_error_cm for error in errors.values()]
    return {
        **means,
        f"{kind}_worst_node_error_mm": max(each["mean_node_error_mm"] for each in table.values()),
        f"{kind}_distance_error_cm": float(np.mean(distance)),
        f"{kind}_worst_distance_error_cm": float(np.max(distance)),
        kind: table,
    }


def _mean(values: list[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else float("nan")


def _bent(workshop: Workshop, options: CompareOptions, folder: RunFolder) -> BendComparison:
    folder.progress.stage("bending one leg")
    rotation: Rotation = "edge" if options.robot.simulation.damping == "published" else "polar"
    if options.bend_pressures_kPa:
        bend = compare_bend(
            workshop.full_leg,
            workshop.leg,
            options.bend_pressures_kPa,
            rotation,
            folder.progress,
        )
    else:
        mesh = workshop.full_leg.mesh
        bend = bend_of_report(workshop.leg, mesh, options.bend_limit_kPa, rotation)
    rows = zip(bend.pressure_kPa, bend.full_deg, bend.reduced_deg, strict=True)
    lines = ["simulated_kPa,full_deg,reduced_deg", *(f"{p:g},{f:.4f},{r:.4f}" for p, f, r in rows)]
    text = ("\n".join(lines) + "\n").encode()
    write_atomically(folder / "bend.csv", lambda stream: stream.write(text))
    return bend


def _time_ratio(options: CompareOptions, folder: RunFolder) -> dict[str, float]:
    """Time of a step of both models, of the baseline in contact, each on one thread."""
    folder.progress.stage("timing a step of both models")
    (baseline,) = animations(("baseline",), 10.0)
    pair = ModelPair(baseline, options.robot)
    full = bench_full(
        FullBenchmark(walking_steps=15, timed_steps=options.timed_steps, repetitions=1),
        pair.workshop.full(baseline.design),
        pair.commands_kPa,
        lambda done, total: folder.progress(done, total, "steps of the full robot"),
    )
    reduced = pair.seconds_per_reduced_step()
    return {
        "time_ratio": full["seconds_per_step"] / reduced,
        "full_s_per_step": full["seconds_per_step"],
        "reduced_s_per_step": reduced,
    }


VERB = Verb(
    CompareOptions,
    compare,
    {
        "default": CompareOptions,
        "paper": lambda: CompareOptions(duration_s=16.0),
        "quick": lambda: CompareOptions(
            animations=("baseline", "two_leg"),
            heldout_count=0,
            duration_s=1.0,
            floating_duration_s=0.5,
            timed_steps=3,
        ),
    },
)
