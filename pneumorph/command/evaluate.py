"""Simulate the design-gait pairs of a coopt run once more.

With the reduced model all pairs walk side by side in a second and must repeat the distances that
the run reported. With --model full each pair walks as finite elements, which takes minutes and
tells how far the reduction can be trusted for these gaits. Physics can be changed:
--simulation.friction 0.8. With --randomize the pairs walk in worlds drawn from --randomisation
(friction, modulus, mass, regulator lag and floor slope, written like "U(0.9, 1.5)") as well.

Writes evaluation.json, robustness.json with --randomize, and with --record or --model full each
pair's trajectory and replay.html, which shows them side by side.

Example: pneumorph evaluate runs/quick --model full --pair-count 1 --out runs/check
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from pneumorph.artefact import write_json
from pneumorph.command.learned_run import read_learned_run
from pneumorph.command.robots import Model, RobotOptions, Workshop
from pneumorph.command.robustness import distances_in_worlds, draw_worlds, robustness
from pneumorph.command.run_folder import RunFolder, finite
from pneumorph.command.verb import Verb
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.walk import walk
from pneumorph.report.film import side_by_side
from pneumorph.report.replay.page import write_replay
from pneumorph.report.scene import Actor
from pneumorph.report.skin import with_skin_only
from pneumorph.robot.design import Design
from pneumorph.settings import settings_to_dict
from pneumorph.simulation.randomisation import Randomisation

flat = tyro.conf.arg(name="")

REPEATS_WITHIN_CM = 0.05
"""A replay of the same physics on another machine may round differently, but no more than this."""


@dataclass(frozen=True)
class EvaluateOptions:
    """Which pairs, and how to simulate them."""

    run: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder of a coopt run."""
    model: Model = "reduced"
    """The reduced robots, or the finite elements they stand for."""
    pair_count: int = 5
    """How many of the best pairs."""
    afresh: bool = False
    """Take leg and physics from the flags alone, not from the run with what the flags change: so a
    run of `objective` damping can be walked with the usual, published one."""
    record: bool = False
    """Save the trajectory of each pair."""
    randomize: bool = False
    """Walk the pairs in worlds drawn at random as well, and report how their ranking changes."""
    world_count: int = 64
    """Worlds of --randomize."""
    world_seed: int = 0
    """Seed of their draws."""
    randomisation: Randomisation = field(default_factory=Randomisation)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    def __post_init__(self) -> None:
        if self.pair_count < 1:
            raise ValueError(f"pair_count is {self.pair_count}, expected at least 1")
        if self.world_count < 1:
            raise ValueError(f"world_count is {self.world_count}, expected at least 1")
        if self.randomize and self.model == "full":
            raise ValueError(
                "randomize walks reduced robots only (a full robot takes minutes for each world), "
                "got --model full"
            )


def evaluate(options: EvaluateOptions, folder: RunFolder) -> dict[str, Any]:
    """Walk the best pairs again and return the distances beside those of the run."""
    start = time.monotonic()
    run = read_learned_run(options.run, options.robot, options.pair_count, options.afresh)
    pairs, designs, gaits, task = run.pairs, run.designs, run.gaits, run.task
    workshop = Workshop(run.robot)
    if options.model == "full":
        workshop.check_reduction()
    else:
        workshop.refuse_full_options()
    folder.progress.stage(f"walking {len(pairs)} pairs with the {options.model} model")
    if options.model == "reduced" and not options.record:
        distances = _together(workshop, designs, gaits, task, folder)
    else:
        distances = _one_by_one(workshop, designs, gaits, task, options.model, folder)
    results = [
        {
            "design": pair["design"],
            "gait": pair["gait"],
            "reported_distance_cm": pair["distance_cm"],
            "distance_cm": distance,
        }
        for pair, distance in zip(pairs, distances, strict=True)
    ]
    write_json(folder / "evaluation.json", {"pairs": finite(results)})
    worlds = {}
    if options.randomize:
        worlds["robustness"] = _in_worlds(
            workshop, options, designs, gaits, distances, task, folder
        )
    return {
        "run": str(options.run),
        "model": options.model,
        "best_design": results[0]["design"],
        "best_distance_cm": results[0]["distance_cm"],
        "reported_distance_cm": results[0]["reported_distance_cm"],
        "damping": run.robot.simulation.damping,
        "calibration": workshop.calibration_description,
        **workshop.leg_used(options.model),
        "notes": _notes(results) if options.model == "reduced" else [],
        "pairs": results,
        **worlds,
        "wall_s": time.monotonic() - start,
    }


def _in_worlds(
    workshop: Workshop,
    options: EvaluateOptions,
    designs: list[Design],
    gaits: list[HeldGait],
    nominal_cm: list[float],
    task: CrawlingTask,
    folder: RunFolder,
) -> dict[str, Any]:
    worlds = draw_worlds(options.randomisation, options.world_count, options.world_seed)
    folder.progress.stage(f"walking in {len(worlds)} worlds")
    distances = distances_in_worlds(
        workshop, designs, gaits, worlds, task.settling_step_count, folder
    )
    labels = [f"L{rank}" for rank in range(1, len(designs) + 1)]
    found = robustness(labels, np.array(nominal_cm), distances)
    drawn = [
        {**world.as_dict(), "distances_cm": row.tolist()}
        for world, row in zip(worlds, distances, strict=True)
    ]
    write_json(folder / "robustness.json", finite({**found, "worlds": drawn}))
    return {**found, "distributions": settings_to_dict(options.randomisation)}


def _notes(results: list[dict[str, Any]]) -> list[str]:
    """Remarks where a reduced robot did not repeat what its run reported."""
    return [
        f"{each['design']} walked {each['distance_cm']:.2f} cm, the run reported "
        f"{each['reported_distance_cm']:.2f} cm: physics, leg or machine differ"
        for each in results
        if not abs(each["distance_cm"] - each["reported_distance_cm"]) < REPEATS_WITHIN_CM
    ]


def _together(
    workshop: Workshop,
    designs: list[Design],
    gaits: list[HeldGait],
    task: CrawlingTask,
    folder: RunFolder,
) -> list[float]:
    walked = walk(
        workshop.simulator([workshop.robot(design) for design in designs]),
        gaits,
        duration_s=gaits[0].duration_s,
        time_step_s=workshop.options.simulation.time_step_s,
        settling_step_count=task.settling_step_count,
        progress=folder.progress,
    )
    return [float(distance) for distance in walked.distance_cm]


def _one_by_one(
    workshop: Workshop,
    designs: list[Design],
    gaits: list[HeldGait],
    task: CrawlingTask,
    model: Model,
    folder: RunFolder,
) -> list[float]:
    distances, actors = [], []
    for number, (design, gait) in enumerate(zip(designs, gaits, strict=True), start=1):
        settling = task.settling_step_count
        if model == "full":
            checkpoint = folder / f"checkpoint_L{number}.npz"
            trajectory = workshop.recorded_full(
                design, gait, checkpoint, settling_steps=settling, progress=folder.progress
            )
        else:
            trajectory = workshop.recorded(design, gait, settling_steps=settling)
        thin = with_skin_only(trajectory)
        thin.save(folder / f"trajectory_{model}_L{number}.npz")
        if thin.skin_triangles is not None:  # a leg of another program may have no skin
            actors.append(Actor.of(thin, f"L{number} {design}"))
        sound = trajectory.status == "completed"
        distances.append(trajectory.forward_distance_cm if sound else float("nan"))
        folder.progress(number, len(designs), "walking")
    if actors:
        write_replay(folder / "replay.html", side_by_side(actors), title=str(folder.path))
    return distances


VERB = Verb(EvaluateOptions, evaluate)
