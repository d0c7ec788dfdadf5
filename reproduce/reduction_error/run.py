"""What parts reduced robots from their finite elements: sampling, contact, or the linearised step.

    python reproduce/reduction_error/run.py

Every variant of the measured leg walks the finite-element walks that ship and those of learned
robots whose distances as finite elements are known, and learned robots walk in worlds that their
trainings never saw. Writes walks.json. Half an hour, most of it for the leg whose integration
points are all kept.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.result import finite
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_from_dict
from pneumorph.catalogue.measured_worlds import measured_worlds
from pneumorph.catalogue.module import Module
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.held_gait import HeldGait
from pneumorph.physics.open_loop_gait import OpenLoopGait, commands_of
from pneumorph.physics.physics import Physics
from pneumorph.reduction.assemble import Cubature, sample_elements
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.simulation.randomisation import World
from pneumorph.simulation.regulator_lag import LAG_STEPS
from pneumorph.study.animations import Animation, animations
from pneumorph.study.certified_candidates import unseen_worlds
from pneumorph.study.full_order_store import FullOrderStore, shipped_folders
from pneumorph.study.gait_source import find_gait
from pneumorph.study.heldout import heldout_animations, periodic_animations
from pneumorph.study.model_pair import ModelPair
from pneumorph.study.robot_error import RobotError, robot_error
from pneumorph.study.robustness import walks_in_worlds
from pneumorph.trajectory import Trajectory

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"
EVERY = 10
"""Time steps between the frames of the walks that ship."""


@dataclass(frozen=True)
class Variant:
    """A way to reduce the measured leg and to walk on it."""

    every_point: bool = False
    """All integration points with weight one, in place of the sampled ones."""
    gives_way: bool = True
    """Contact points give way beyond the modes."""
    linearised: Literal["start", "ahead"] = "ahead"
    """Where a step finds its forces."""


VARIANTS = {
    "as it ships": Variant(),
    "linearised at the start": Variant(linearised="start"),
    "points that follow the modes": Variant(gives_way=False),
    "neither": Variant(gives_way=False, linearised="start"),
    "neither, every integration point": Variant(True, gives_way=False, linearised="start"),
}


def reduced(module: Module, variant: Variant) -> ReducedPart:
    """The leg of a variant."""
    part, made = module.full, module.reduced
    if not variant.gives_way:
        made = replace(made, contact_flexibility=np.zeros((0, 0)))
    if variant.every_point:
        solid = part.element_groups[0]
        points = Cubature.every(solid.element_count)
        sampled = sample_elements(solid, made.modes, points)
        made = replace(
            made,
            tetrahedron_index=points.index.astype(np.int32),
            tetrahedron_weight=points.weight,
            tetrahedron_rest=sampled.rest,
            tetrahedron_mode_gradient=sampled.mode_gradient,
            tetrahedron_measure=sampled.measure,
        )
    return made


def varied(spec: RobotSpec, variant: Variant, folder: Path) -> RobotSpec:
    """The robot on legs of a variant, whose files stay in a folder."""
    again = {}
    for module in spec.modules:
        leg = reduced(module, variant)
        again[module] = module.reduced_again(leg.save(folder / f"{leg.digest()}.npz"))
    return replace(
        spec,
        sites=tuple(site.with_modules(lambda each: again[each]) for site in spec.sites),
        stepper=replace(spec.stepper, linearised=variant.linearised),
    )


def walks() -> dict[str, list[Animation]]:
    """Of each kind those that may ship; the Gray walk's robot tumbles."""
    return {
        "animations": animations(("baseline", "two_leg", "six_leg"), 10.0),
        "heldout": heldout_animations(12, 10.0),
        "periodic": periodic_animations(8, 20.0),
    }


def shipped(spec: RobotSpec) -> dict[str, list[tuple[Animation, Trajectory]]]:
    """Of each kind the walks that ship, with those of their finite elements."""
    store = FullOrderStore(shipped_folders())
    found: dict[str, list[tuple[Animation, Trajectory]]] = {}
    for kind, chosen in walks().items():
        found[kind] = []
        for animation in chosen:
            full = ModelPair(animation, spec).kept(store, animation.name, EVERY)
            if full is not None:
                found[kind].append((animation, full))
    return found


@dataclass(frozen=True)
class LearnedWalk:
    """A learned robot whose finite elements have walked."""

    gait: str
    full: float
    """What they achieved in 20 s [the goal's unit]."""
    world: int | None = None
    """Number of the unseen world, as certificates count them; None for the nominal one."""
    lag: Literal["mean", "end"] = "mean"
    """What lagging commands were held at for five steps: their mean over these, as they are now, or
    what they are at the end of these."""
    robot: str | None = None
    """File of examples that describes it; None for the paper's robot."""
    settings: str | None = None
    """File of examples that has the ground."""
    chamber_growth: tuple[float, ...] = ()
    """How the chambers of a described robot grew for its finite elements, see
    `pneumorph.physics.air.Air`; empty for as its modules say."""
    goal: Goal = FORWARD

    @property
    def name(self) -> str:
        """What it is called in walks.json."""
        return self.gait if self.world is None else f"{self.gait}, world {self.world}"

    def spec(self) -> RobotSpec:
        """The robot, in the nominal world."""
        if self.robot is not None:
            described = RobotDescription.read(EXAMPLES / self.robot)
            physics = described.acting
            if self.chamber_growth:
                air = replace(physics.air, chamber_growth=self.chamber_growth)
                physics = replace(physics, air=air)
            return described.spec(physics)
        spec = RobotOptions().spec()
        if self.settings is not None:
            said = tomllib.loads((EXAMPLES / self.settings).read_text())["physics"]
            spec = replace(spec, physics=settings_from_dict(Physics, said, spec.physics))
        return spec

    def achieved(self, spec: RobotSpec, folder: RunFolder) -> float:
        """What its reduced robot achieves [the goal's unit]; NaN where its simulation fails."""
        source = find_gait(HERE.parent / self.gait, None, ExpertGait())
        gait, world = source.gait, World.nominal(spec.physics)
        if self.world is not None:
            drawn = unseen_worlds(measured_worlds(), self.world + 1, 0)[self.world]
            world = drawn
            if self.lag == "end":
                gait = _held_at_the_end(gait, drawn.regulator_lag_s, spec.physics.time_step_s)
                world = replace(drawn, regulator_lag_s=0.0)
        far, *_ = walks_in_worlds(
            spec, [source.design], [gait], [world], source.settling_steps, folder, self.goal
        )
        return float(far[0, 0])


def _held_at_the_end(gait: OpenLoopGait, lag_s: float, time_step_s: float) -> HeldGait:
    """A gait as earlier finite elements walked it: lagging commands were held for five steps at
    what they are at the end of these, and no longer are (`LaggingSimulator`)."""
    now, held = np.zeros(gait.regulator_count), []
    kept = np.exp(-LAG_STEPS * time_step_s / lag_s)
    for command in commands_of(gait, time_step_s, gait.regulator_count)[::LAG_STEPS]:
        now = command + (now - command) * kept
        held.append(now)
    return HeldGait.evenly(np.array(held), LAG_STEPS * time_step_s)


def learned_walks() -> list[LearnedWalk]:
    """All that are known."""
    told = tomllib.loads((HERE / "learned.toml").read_text())["walk"]
    return [settings_from_dict(LearnedWalk, each) for each in told]


def learned_beside_full(variant: Variant, folder: RunFolder) -> dict[str, dict[str, float]]:
    """What learned robots achieve on legs of a variant, beside their finite elements."""
    robots: dict[tuple[str | None, str | None, tuple[float, ...]], RobotSpec] = {}
    found = {}
    for each in learned_walks():
        files = each.robot, each.settings, each.chamber_growth
        if files not in robots:
            robots[files] = varied(each.spec(), variant, folder.path)
        found[each.name] = {"full": each.full, "reduced": each.achieved(robots[files], folder)}
    return found


def learned_in_worlds(
    spec: RobotSpec, world_count: int, folder: RunFolder
) -> dict[str, dict[str, float]]:
    """How far learned robots go in worlds that their trainings never saw [cm]."""
    gaits = sorted(
        path
        for name in ("learning_modes/demo", "restarts")
        for path in HERE.parent.glob(f"{name}/*.csv")
    )
    sources = [find_gait(path, None, ExpertGait()) for path in gaits]
    far, *_ = walks_in_worlds(
        spec,
        [source.design for source in sources],
        [source.gait for source in sources],
        unseen_worlds(measured_worlds(), world_count, 0),
        sources[0].settling_steps,
        folder,
    )
    return {
        f"{path.parent.name}/{path.name}": {
            "median_cm": float(np.nanmedian(own)),
            "low_cm": float(np.nanquantile(own, 0.1)),
            "high_cm": float(np.nanquantile(own, 0.9)),
            "failed_count": int(np.isnan(own).sum()),
        }
        for path, own in zip(gaits, far.T, strict=True)
    }


def row(error: RobotError) -> dict[str, float]:
    """What is told of a walk."""
    return {
        "node_error_mm": error.mean_node_error_mm,
        "full_cm": error.forward_full_cm,
        "reduced_cm": error.forward_reduced_cm,
    }


def said(kind: str, errors: Sequence[RobotError]) -> str:
    """Means of a kind of walks."""
    nodes = np.mean([error.mean_node_error_mm for error in errors])
    apart = [error.distance_error_cm for error in errors]
    return (
        f"  {kind}: nodes {nodes:.2f} mm, distance {np.mean(apart):.3f} cm, at most "
        f"{max(apart):.2f}; {len(errors)} walks"
    )


def main(
    variants: tuple[str, ...] = tuple(VARIANTS), world_count: int = 48, out: Path = HERE
) -> None:
    """Walk the variants, and write what parts them from their finite elements.

    Args:
        variants: Names of those to walk; what walks.json has of others stays.
        world_count: In so many worlds learned robots walk. They walk with those variants alone
            whose points are sampled: others take hours.
        out: Folder of walks.json.
    """
    spec, file = RobotOptions().spec(), out / "walks.json"
    ships = shipped(spec)
    told: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
    with TemporaryDirectory() as work:
        folder = RunFolder(Path(work), "reduction_error")
        for name in variants:
            variant = VARIANTS[name]
            own = varied(spec, variant, Path(work))
            print(name, flush=True)
            told[name] = {}
            for kind, pairs in ships.items():
                found = {
                    each.name: robot_error(full, ModelPair(each, own).reduced(EVERY, like=full))
                    for each, full in pairs
                }
                told[name][kind] = {each: row(error) for each, error in found.items()}
                if found:
                    print(said(kind, list(found.values())), flush=True)
            if not variant.every_point:
                told[name]["learned"] = learned_beside_full(variant, folder)
                if world_count:
                    told[name]["worlds"] = learned_in_worlds(own, world_count, folder)
            write_json(file, finite({each: told[each] for each in VARIANTS if each in told}))
    print(f"wrote {file}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
