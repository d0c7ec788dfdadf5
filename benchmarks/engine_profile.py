"""Where the stepper's time goes on this machine, over batches, legs, modes and threads.

    python benchmarks/engine_profile.py --out runs/engine_profile

One thing varies at a time. Writes engine_profile.json and engine_profile.png.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.machine import processor_count
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.catalogue.site import Site
from pneumorph.reduction.fewer_modes import along
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.report.style import REGULATOR_COLOURS, figure_style, new_figure, save_figure
from pneumorph.robot.design import Design
from pneumorph.robot.design_space import DesignSpace
from pneumorph.study.engine_benchmark import EngineBenchmark, bench_engine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LABELS = {
    "legs": "legs of a robot, one thread",
    "modes": "modes of a leg, one thread",
    "robots": "robots in the batch, all threads",
    "threads": "threads",
}


def with_first_modes(part: ReducedPart, count: int) -> ReducedPart:
    """A part with its first modes alone: it costs what such a part does, but walks too stiffly."""
    return along(part, np.eye(part.mode_count, count))


def measured(spec: RobotSpec, designs: Sequence[Design], robots: int) -> dict[str, Any]:
    """Speed and stages of a batch under one random action."""
    figures = bench_engine(EngineBenchmark(robots, action_count=1), spec, designs)
    leg_steps = figures.steps * figures.mean_legs
    names = ("threads", "mean_legs", "env_steps_per_s", "gemm_gflops", "steps_per_gflop")
    stages = {name: 1e6 * value / leg_steps for name, value in figures.stage_seconds.items()}
    return {**{name: getattr(figures, name) for name in names}, "stage_us": stages}


@figure_style()
def profile_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Stages by legs and by modes, and speed by batch and by threads."""
    figure = new_figure(7.2, 5.2)
    for axes, axis in zip(figure.subplots(2, 2).flat, LABELS, strict=True):
        own = [row for row in rows if row["axis"] == axis]
        values = [row["value"] for row in own]
        axes.set_xlabel(LABELS[axis])
        if axis in ("legs", "modes"):
            bottom, places = np.zeros(len(own)), np.arange(len(own))
            for stage, colour in zip(own[0]["stage_us"], 2 * REGULATOR_COLOURS, strict=False):
                height = np.array([row["stage_us"][stage] for row in own])
                label = stage.replace("_", " ")
                axes.bar(places, height, 0.7, bottom, color=colour, label=label)
                bottom += height
            axes.set_xticks(places, values)
            axes.set_ylabel("us of a thread, leg and step")
        else:
            axes.plot(values, [row["steps_per_gflop"] for row in own], "o-")
            axes.set_xticks(values)
            axes.set_ylim(bottom=0.0)
            axes.set_ylabel("steps/s for each GFLOP/s of sgemm")
    figure.axes[0].legend(fontsize=7, ncols=2)
    return figure


def main(
    out: Path = Path("runs/engine_profile"),
    robots: tuple[int, ...] = (1, 8, 32, 96),
    legs: tuple[int, ...] = (3, 4, 5, 6),
    modes: tuple[int, ...] = (8, 16, 24),
    batch: int = 32,
    threads: int = processor_count(),
    part: Path | None = None,
) -> None:
    """Measure one thing after the other, and draw.

    Args:
        out: Folder of the table and the figure.
        robots: Robots in the batch, on all threads.
        legs: Legs of every robot, on one thread.
        modes: Modes of a leg, on one thread.
        batch: Robots where legs, modes or threads vary.
        threads: Most threads.
        part: Reduced leg; by default the published one that ships.
    """
    spec = RobotOptions.of("published", part=part, threads=threads).spec()
    alone, designs = replace(spec, thread_count=1), DesignSpace().designs

    def cut(count: int) -> RobotSpec:
        reduced = with_first_modes(spec.module.reduced, count)
        module = Module(f"{count} modes", lambda: reduced, spec.module.make_full)
        return replace(alone, sites=tuple(Site(site.pose, module) for site in spec.sites))

    with_legs = {count: [each for each in designs if each.leg_count == count] for count in legs}
    cases = [
        *(("robots", count, spec, designs, count) for count in robots),
        *(("legs", count, alone, with_legs[count], batch) for count in legs),
        *(("modes", count, cut(count), designs, batch) for count in modes),
        *(
            ("threads", count, replace(spec, thread_count=count), designs, batch)
            for count in range(1, threads + 1)
        ),
    ]
    rows = []
    for axis, value, *case in cases:
        rows.append({"axis": axis, "value": value, **measured(*case)})
        print({name: rows[-1][name] for name in ("axis", "value", "steps_per_gflop")}, flush=True)
    write_json(out / "engine_profile.json", {"rows": rows})
    save_figure(profile_figure(rows), out / "engine_profile.png", ("png",))


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
