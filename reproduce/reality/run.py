"""From the published simulation to the measured one, change by change, as finite elements.

    python reproduce/reality/run.py --out runs/reality

Each robot walks once in each physics, in a folder of its own; walks that are finished are not made
again, and one that was stopped goes on. `--only NAME` makes some of them, for several machines;
`expert` are the reduced walks of expert_in_worlds.py. What is known so far goes to steps.json,
steps.png and summary.json beside this file.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import tyro
from expert_in_worlds import bands_figure, expert_bands
from statements import summary

from pneumorph.base.artefact import read_json, write_json
from pneumorph.base.run_folder import SUMMARY, read_summary
from pneumorph.catalogue.hub_spec import HubModel
from pneumorph.catalogue.leg_kinds import LegName, leg_kind
from pneumorph.catalogue.leg_module import module_of_leg, scaled_materials
from pneumorph.catalogue.masses import Masses
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.fem.full_order_settings import FullOrderSettings
from pneumorph.fem.material import LegMaterials
from pneumorph.fem.part_ingredients import materials_text
from pneumorph.fem.prony import PronySeries
from pneumorph.geometry.face_tie import tied_over_face
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape, mesh_pneunet
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.physics.physics import Physics
from pneumorph.physics.pressure import PressureMap
from pneumorph.report.style import figure_style, new_figure, save_figure
from pneumorph.study.simulated_walk import SimulatedWalk, WalkSettings, simulate
from pneumorph.study.study_once import study_folder, study_once

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(os.path.relpath(Path(__file__).parent))
DAMPING = ("damping", "mass_damping_per_s", "stiffness_damping_s")
FRICTION = ("friction", "friction_by_surface")
FINER_MM = 4.0
"""Largest edge of the finer mesh [mm], where the one that ships has 6: 13120 nodes, not 9752."""


@dataclass(frozen=True)
class Ingredients:
    """All that a robot of a step is made of; each step replaces some of it."""

    leg: LegName
    """Which mesh of the leg, and how it is tied to the hub."""
    materials: LegMaterials
    masses: Masses
    hub_model: HubModel
    physics: Physics
    full_order: FullOrderSettings
    edge_mm: float | None = None
    """Largest edge of the leg's quadratic tetrahedra [mm]; None for the mesh that ships."""

    def robot(self) -> RobotSpec:
        """The robot."""
        mesh = None if self.edge_mm is None else leg_mesh(self.edge_mm)
        leg = module_of_leg(self.leg, mesh=mesh, materials=self.materials, masses=self.masses)
        return paper_robot(
            leg,
            self.physics,
            self.masses,
            hub_model=self.hub_model,
            full_order=self.full_order,
        )


@cache
def leg_mesh(edge_mm: float) -> Mesh:
    """The measured leg in elements of another size, as reproduce/measured_bend/meshes.py has it."""
    made = mesh_pneunet(PneuNetShape(), MesherSettings(size_mm=edge_mm, grading=0.9))
    return tied_over_face(quadratic_mesh(made))


ROBOTS = {
    "expert": WalkSettings(model="full"),
    "published L1": WalkSettings(model="full", gait=HERE.parent / "paper_scale/gaits/L1.csv"),
    "objective L1": WalkSettings(
        model="full", gait=HERE.parent / "damping_gap/objective/gaits/L1.csv"
    ),
}
"""The expert's at 110 degrees; the best pair of a training in the published physics, which drags
its disk; the best of one under objective damping."""


@dataclass(frozen=True)
class Step:
    """A physics on the way, and what is new in it."""

    change: str
    made_of: Ingredients
    robots: tuple[str, ...] = tuple(ROBOTS)


def steps() -> dict[str, Step]:
    """Every physics on the way; each has the changes of those before it, and one more.

    What a step replaces is all that it changes: tests/reproduce/test_reality.py holds it to that.
    """
    usual, measured = leg_kind("published"), leg_kind("measured")
    published = Ingredients(
        "published",
        usual.materials,
        Masses("published"),
        usual.hub_model,
        usual.physics,
        usual.full_order,
    )
    # With modulus and pressure scaled alike the leg bends as before.
    factor = (
        measured.materials.silicone.young_modulus_kPa / usual.materials.silicone.young_modulus_kPa
    )
    scaled = PressureMap(
        factor * usual.physics.pressure_map.slope,
        factor * usual.physics.pressure_map.intercept_kPa,
    )
    to_scale = replace(
        published,
        materials=scaled_materials(usual.materials, factor),
        masses=Masses("cast"),
        physics=replace(published.physics, pressure_map=scaled),
    )
    # Its elements are stepped by the integrator that they were made for: the linearly implicit
    # step of a sheet of 2 GPa is another error than the law. Floor, air and damping stay.
    law = replace(
        to_scale,
        leg="measured",
        materials=replace(measured.materials, relaxation=PronySeries()),
        hub_model=measured.hub_model,
        physics=replace(to_scale.physics, pressure_map=measured.physics.pressure_map),
        full_order=measured.full_order,
    )
    damping = replace(
        law,
        materials=measured.materials,
        physics=replace(law.physics, **_of(measured.physics, *DAMPING)),
    )
    air = replace(damping, physics=replace(damping.physics, **_of(measured.physics, "air")))
    friction = replace(air, physics=replace(air.physics, **_of(measured.physics, *FRICTION)))
    mesh = replace(friction, edge_mm=FINER_MM)
    return {
        "published": Step("as published", published),
        "to_scale": Step("stiffness, masses, pressures", to_scale),
        "law": Step("law, sheet and their step", law),
        "damping": Step("damping", damping),
        "air": Step("air", air),
        "friction": Step("friction by surface", friction),
        "mesh": Step(f"mesh of {FINER_MM:g} mm", mesh, ("expert",)),
    }


def _of(physics: Physics, *names: str) -> dict[str, Any]:
    return {name: getattr(physics, name) for name in names}


STEPS = steps()


def walk(robot: str, step: str, out: Path) -> SimulatedWalk:
    """One robot in one physics."""
    settings, made_of = ROBOTS[robot], STEPS[step].made_of
    spec = made_of.robot()
    place = study_folder(walk_folder(robot, step, out), "simulate")
    asked = {
        "walk": settings,
        "step": step,
        "physics": spec.physics,
        "leg": materials_text(spec.module.full),
        "full": replace(spec.full_order, thread_count=1),  # they change nothing
        **({} if made_of.edge_mm is None else {"edge_mm": made_of.edge_mm}),
    }
    return study_once(place, SimulatedWalk, asked, lambda: simulate(settings, spec, place))


def walk_folder(robot: str, step: str, out: Path) -> Path:
    """Where a walk is kept."""
    return out / robot.replace(" ", "_") / step


def known(out: Path, before: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """What is known of every robot in every physics so far.

    Args:
        out: Folder of the walks.
        before: What was known; another machine's walks stay.
    """
    found: dict[str, dict[str, Any]] = {robot: dict(before.get(robot, {})) for robot in ROBOTS}
    for step, each in STEPS.items():
        for robot in each.robots:
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
    changes = [fill(step.change, 13) for step in STEPS.values()]
    axes.set_xticks(range(len(names)), changes, fontsize="x-small")
    axes.set_xlim(-0.5, len(names) - 0.5)
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
        for robot in STEPS[step].robots:
            found = walk(robot, step, out)
            distance = "no" if found.distance_cm is None else f"{found.distance_cm:.1f}"
            print(f"{step}, {robot}: {distance} cm, {found.status}", flush=True)
            before = read_json(HERE / "steps.json", "JSON")
            told = known(out, before)
            write_json(HERE / "steps.json", told)
            save_figure(steps_figure(told), HERE / "steps.png", ("png",))


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
