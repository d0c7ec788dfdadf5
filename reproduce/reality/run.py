"""From the published simulation to the measured one, change by change, as finite elements.

    python reproduce/reality/run.py --out runs/reality

Each robot walks once in each physics, in a folder of its own; walks that are finished are not made
again, and one that was stopped goes on. `--only NAME` makes some of them, for several machines;
`expert` are the reduced walks of expert_in_worlds.py. What is known so far goes to steps.json,
steps.png and summary.json beside this file.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyro
from expert_in_worlds import bands_figure, expert_bands
from statements import summary

from pneumorph.base.artefact import write_json
from pneumorph.base.run_folder import SUMMARY, read_summary
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.paper_leg import (
    MEASURED_MATERIALS,
    leg_kind,
    paper_leg,
    scaled_materials,
)
from pneumorph.catalogue.paper_robot import friction_coefficients, paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.part_ingredients import materials_text
from pneumorph.fem.prony import PronySeries
from pneumorph.physics.air import Air
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.report.style import figure_style, new_figure, save_figure
from pneumorph.study.simulated_walk import SimulatedWalk, WalkSettings, simulate
from pneumorph.study.study_once import study_folder, study_once

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(os.path.relpath(Path(__file__).parent))


@dataclass(frozen=True)
class Step:
    """A physics on the way, and what is new in it."""

    change: str
    robot: Callable[[], RobotSpec]


def published() -> RobotSpec:
    """As the paper simulated its robots."""
    return paper_robot("published")


def to_scale() -> RobotSpec:
    """Stiffness, masses and pressures of the real robot; they belong together.

    The leg's law, mesh and damping stay. With modulus and pressure scaled alike it bends as before.
    """
    published = leg_kind("published").materials
    modulus = MEASURED_MATERIALS.silicone.young_modulus_kPa
    factor = modulus / published.silicone.young_modulus_kPa
    usual, masses = PressureMap(), Masses("cast")
    pressures = PressureMap(factor * usual.slope, factor * usual.intercept_kPa)
    leg = paper_leg("published", materials=scaled_materials(published, factor), masses=masses)
    return paper_robot(leg, Physics(pressure_map=pressures), masses)


def measured_law() -> RobotSpec:
    """Yeoh's law without locking, a thin stiff sheet, no map of pressures, the printed hub."""
    elastic = replace(MEASURED_MATERIALS, relaxation=PronySeries())
    masses = Masses("cast")
    leg = paper_leg("measured", materials=elastic, masses=masses)
    physics = Physics(pressure_map=PressureMap(1.0, 0.0))
    return paper_robot(leg, physics, masses, hub_model="rigid")


def relaxing() -> RobotSpec:
    """Silicone that relaxes is all that damps."""
    return paper_robot("measured")


def with_air() -> RobotSpec:
    """Regulators fill and vent the legs through valves, as a small PneuNet was measured."""
    spec = paper_robot("measured")
    return replace(spec, physics=replace(spec.physics, air=Air(law="orifice")))


def by_surface() -> RobotSpec:
    """Every surface with a coefficient in the middle of what is known of it."""
    spec = with_air()
    by_name = friction_coefficients()
    return replace(spec, physics=replace(spec.physics, friction_by_surface=by_name))


STEPS = {
    "published": Step("as published", published),
    "to_scale": Step("stiffness, masses, pressures", to_scale),
    "law": Step("law and sheet", measured_law),
    "damping": Step("damping", relaxing),
    "air": Step("air", with_air),
    "friction": Step("friction by surface", by_surface),
}
"""Each has the changes of those before it."""

ROBOTS = {
    "expert": WalkSettings(model="full"),
    "published L1": WalkSettings(model="full", gait=HERE.parent / "paper_scale/gaits/L1.csv"),
    "objective L1": WalkSettings(
        model="full", gait=HERE.parent / "damping_gap/objective/gaits/L1.csv"
    ),
}
"""The expert's at 110 degrees; the best pair of a training in the published physics, which drags
its disk; the best of one under objective damping."""


def walk(robot: str, step: str, out: Path) -> SimulatedWalk:
    """One robot in one physics."""
    settings, spec = ROBOTS[robot], STEPS[step].robot()
    place = study_folder(walk_folder(robot, step, out), "simulate")
    asked = {
        "walk": settings,
        "step": step,
        "physics": spec.physics,
        "leg": materials_text(spec.module.full),
        "full": settings_to_dict(spec.full_order),
    }
    return study_once(place, SimulatedWalk, asked, lambda: simulate(settings, spec, place))


def walk_folder(robot: str, step: str, out: Path) -> Path:
    """Where a walk is kept."""
    return out / robot.replace(" ", "_") / step


def known(out: Path) -> dict[str, dict[str, Any]]:
    """What is known of every robot in every physics so far."""
    found: dict[str, dict[str, Any]] = {robot: {} for robot in ROBOTS}
    for robot in ROBOTS:
        for step in STEPS:
            place = walk_folder(robot, step, out)
            if (place / SUMMARY).exists():
                summary = read_summary(place)
                kept = ("status", "distance_cm", "simulated_s", "steps", "simulation_wall_s")
                found[robot][step] = {name: summary[name] for name in kept}
    return found


@figure_style()
def steps_figure(found: dict[str, dict[str, Any]]) -> Figure:
    """Distance of each robot, change by change."""
    figure = new_figure(6.0, 3.2)
    axes = figure.add_subplot()
    names = list(STEPS)
    for number, (robot, walks) in enumerate(found.items()):
        done = [name for name in names if walks.get(name, {}).get("distance_cm") is not None]
        at = [names.index(name) + 0.25 * (number - 1) for name in done]
        axes.bar(at, [walks[name]["distance_cm"] for name in done], 0.22, label=robot)
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_xticks(range(len(names)), [step.change for step in STEPS.values()], fontsize="x-small")
    axes.set_ylabel("distance in 20 s (cm)")
    axes.legend(fontsize="x-small")
    return figure


def main(out: Path = Path("runs/reality"), only: tuple[str, ...] = ()) -> None:
    """Walk every robot in every physics, and draw what is known.

    Args:
        out: Folder of the walks.
        only: Names of the physics to walk in, and `expert`; none for all of them.
    """
    asked = only or ("expert", *STEPS)
    if "expert" in asked:
        bands = expert_bands(out)
        save_figure(bands_figure(bands), HERE / "expert_in_worlds.png", ("png",))
        write_json(HERE / "summary.json", summary(bands))
    for step in (each for each in asked if each != "expert"):
        for robot in ROBOTS:
            found = walk(robot, step, out)
            distance = "no" if found.distance_cm is None else f"{found.distance_cm:.1f}"
            print(f"{step}, {robot}: {distance} cm, {found.status}", flush=True)
            told = known(out)
            write_json(HERE / "steps.json", told)
            save_figure(steps_figure(told), HERE / "steps.png", ("png",))


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
