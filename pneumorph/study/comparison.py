"""Reduced robots compared with the full ones they stand for."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from pneumorph.base.artefact import write_text
from pneumorph.base.checked import Checked, Count, CountOrNone, NotNegative, Positive
from pneumorph.base.result import save_result
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import settings_to_dict
from pneumorph.catalogue.robot_mass import RobotMass
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.physics.calibration import UsedCalibration
from pneumorph.physics.physics import Physics
from pneumorph.reduction.part_summary import PartsSummary
from pneumorph.reduction.snapshot_range import range_note
from pneumorph.study.animations import Animation, animations
from pneumorph.study.bend_error import BendComparison, bend_of_report, compare_bend
from pneumorph.study.full_benchmark import FullBenchmark, bench_full
from pneumorph.study.full_order_store import FullOrderStore, shipped_folders
from pneumorph.study.heldout import heldout_animations, periodic_animations
from pneumorph.study.model_pair import ModelPair
from pneumorph.study.recorded_trajectories import remove_earlier
from pneumorph.study.reduction_grid import GridPoint, reduction_grid
from pneumorph.study.robot_error import RobotError, node_error, robot_error

Kind = Literal["animations", "heldout", "periodic", "floating"]
NODE_ERROR_FILE = "node_errors.json"


@dataclass(frozen=True)
class ComparisonSettings(Checked):
    """What to compare."""

    animations: tuple[str, ...] = ("hamiltonian", "baseline", "two_leg", "six_leg")
    """Test animations to run, on the floor and floating."""
    heldout_count: CountOrNone = 12
    """Number of random designs that walk random gaits."""
    duration_s: Positive = 10.0
    """Length of each of these walks [s]."""
    periodic_count: CountOrNone = 0
    """Number of random designs that walk periodic gaits, in which errors accumulate over cycles;
    the eight gaits take turns."""
    periodic_duration_s: Positive = 20.0
    """Length of each periodic walk [s]."""
    floating_duration_s: NotNegative = 4.0
    """Length of the animations without gravity and floor [s]; 0 leaves them out."""
    record_every: Count = 10
    """Time steps between compared frames."""
    record: bool = False
    """Also save the reduced trajectories."""
    bend_limit_kPa: Positive = 300.0
    """Highest simulated pressure of the bend that the reduction reports and that is shown [kPa]."""
    bend_pressures_kPa: tuple[NotNegative, ...] = ()
    """Simulated pressures at which both models are bent again [kPa]; none to show only the
    reduction's own bend."""
    timed_steps: CountOrNone = 21
    """Steps of the finite-element robot that are timed for the time ratio; 0 leaves the ratio
    out."""
    grid: tuple[Path, ...] = ()
    """Reductions of the same leg with other tolerances, as `pneumorph reduce` writes them."""
    full_order: Path | None = None
    """Folder of stored full-order trajectories. None: RUN/full_order and those that ship."""

    def runs(self) -> dict[Kind, list[Animation]]:
        """What is run of each kind; see `Comparison`."""
        runs: dict[Kind, list[Animation]] = {
            "animations": animations(self.animations, self.duration_s),
            "heldout": heldout_animations(self.heldout_count, self.duration_s),
            "periodic": periodic_animations(self.periodic_count, self.periodic_duration_s),
        }
        if self.floating_duration_s > 0.0:
            runs["floating"] = animations(self.animations, self.floating_duration_s)
        return runs


@dataclass(frozen=True)
class MeanErrors:
    """Means over the runs of one kind, and the worst of them; see `RobotError`."""

    mean_node_error_mm: float
    mean_node_error_in_hub_mm: float
    path_error_mm: float
    leg_force_error_percent: float
    slip_agreement_percent: float
    slipping_points_overlap_percent: float
    worst_node_error_mm: float
    distance_error_cm: float
    worst_distance_error_cm: float

    @classmethod
    def of(cls, errors: Iterable[RobotError]) -> MeanErrors:
        """Those of one error or more."""
        errors = list(errors)
        averaged = ("mean_node_error_mm", "mean_node_error_in_hub_mm", "path_error_mm",
                    "leg_force_error_percent", "slip_agreement_percent",
                    "slipping_points_overlap_percent")  # fmt: skip
        distance = [error.distance_error_cm for error in errors]
        return cls(
            **{name: _mean([getattr(error, name) for error in errors]) for name in averaged},
            worst_node_error_mm=max(error.mean_node_error_mm for error in errors),
            distance_error_cm=float(np.mean(distance)),
            worst_distance_error_cm=max(distance),
        )


@dataclass(frozen=True)
class Comparison:
    """How far reduced robots are from the full ones, and how much faster.

    A file also says the means of each kind, such as ``heldout_mean_node_error_mm``.
    """

    leg: PartsSummary
    bend_error_percent: float
    bend_pressures_kPa: tuple[float, ...]
    """Simulated pressures of the bends that follow [kPa], (pressure,)."""
    bend_full_deg: tuple[float, ...]
    bend_reduced_deg: tuple[float, ...]
    full_hub: str
    """Model of the full robot's hub."""
    damping: str
    duration_s: float
    """Length of the walks [s]."""
    wall_s: float
    """Wall time of all [s]."""
    calibration: UsedCalibration | None = None
    animations: dict[str, RobotError] = field(default_factory=dict)
    """Errors of the paper's test animations by their names."""
    heldout: dict[str, RobotError] = field(default_factory=dict)
    """The same of random designs under random gaits, which no snapshot came from."""
    periodic: dict[str, RobotError] = field(default_factory=dict)
    """The same of random designs under periodic gaits."""
    floating: dict[str, RobotError] = field(default_factory=dict)
    """The same of the animations without gravity and floor."""
    tolerance_grid: tuple[GridPoint, ...] = ()
    """Further reductions of the leg, where they were given."""
    time_ratio: float | None = None
    """How many times as fast a step of the reduced robot is, each on one thread."""
    full_s_per_step: float | None = None
    """Wall time of such a step of either robot [s]."""
    reduced_s_per_step: float | None = None
    physics: Physics | None = None
    """What the robots were simulated in; None in files of earlier versions."""
    mass: RobotMass | None = None
    """What they weigh; None in files of earlier versions."""
    notes: tuple[str, ...] = ()

    @property
    def animations_mean_node_error_mm(self) -> float | None:
        """Mean over the paper's animations; None where none was compared."""
        return self.derived().get("animations_mean_node_error_mm")

    def derived(self) -> dict[str, float]:
        """The means of each kind of runs by name."""
        return {
            f"{kind}_{name}": value
            for kind in get_args(Kind)
            if getattr(self, kind)
            for name, value in vars(MeanErrors.of(getattr(self, kind).values())).items()
        }


@dataclass(frozen=True)
class NodeErrors:
    """Mean node error of each compared frame [mm], by kind of run and the run's name."""

    frame_s: float
    """Time from frame to frame [s]."""
    mean_mm: dict[str, dict[str, tuple[float, ...]]]


def is_usual_robot(robot: Mapping[str, Any]) -> bool:
    """Whether settings are of the robot that nobody chose, wherever it is computed.

    Args:
        robot: All settings of `RobotOptions`, as nested dictionaries.
    """
    return _walking(robot) == _walking(settings_to_dict(RobotOptions()))


def _walking(robot: Mapping[str, Any]) -> dict[str, Any]:
    """What of a robot's settings its walks depend on: not where they are computed."""
    full = {name: value for name, value in robot["full"].items() if name != "thread_count"}
    kept = {name: value for name, value in robot.items() if name not in ("threads", "executor")}
    return {**kept, "full": full}


def compare(settings: ComparisonSettings, robot: RobotSpec, folder: RunFolder) -> Comparison:
    """Run both models and return the errors and the time ratio.

    Args:
        settings: What to compare.
        robot: The robot, whose module is known in both models.
        folder: Receives ``bend.csv``, ``node_errors.json`` and full-order trajectories, which are
            not computed again. Reduced trajectories of an earlier comparison there are removed.

    Raises:
        ArtefactError: The reduced leg does not stand for the full one.
        ValueError: An unknown animation, a robot of several kinds of modules or of other sites than
            the animations' eight, or one that diverges.
    """
    start = time.monotonic()
    runs = settings.runs()
    designs = [each.design for chosen in runs.values() for each in chosen]
    # Before the first walk, which takes hours.
    for design in designs:
        if design.location_count != len(robot.sites):
            raise ValueError(
                f"the robot has {len(robot.sites)} sites, expected {design.location_count}: the "
                "animations that are compared are of the paper's robot; compare one of as many "
                "sites, with one kind of leg"
            )
    _ = robot.module  # one kind, whose bend is compared
    for design in designs:
        _ = robot.assembly(design)
    robot.check_reduction()
    recorded = (*ComparisonSettings().animations, "heldout_*", "periodic_*", "floating_*")
    remove_earlier(folder.path, *(_reduced_file(name) for name in recorded))
    own = settings.full_order or folder.path / "full_order"
    store = FullOrderStore((own, *shipped_folders()))
    comparer = _Comparer(settings, robot, folder, store)
    errors: dict[str, dict[str, RobotError]] = {}
    curves: dict[str, dict[str, tuple[float, ...]]] = {}
    for kind, chosen in runs.items():
        errors[kind], curves[kind] = comparer.errors(kind, chosen)
    frame_s = settings.record_every * robot.physics.time_step_s
    save_result(folder / NODE_ERROR_FILE, NodeErrors(frame_s, curves))
    grid = comparer.grid(runs["animations"]) if settings.grid else []
    bend = _bent(robot, settings, folder)
    full_s = reduced_s = time_ratio = None
    if settings.timed_steps > 0:
        full_s, reduced_s = _step_times(robot, settings, folder)
        time_ratio = full_s / reduced_s
    return Comparison(
        animations=errors["animations"],
        heldout=errors["heldout"],
        periodic=errors["periodic"],
        floating=errors.get("floating", {}),
        tolerance_grid=tuple(grid),
        bend_error_percent=bend.error_percent,
        bend_pressures_kPa=tuple(bend.pressure_kPa.tolist()),
        bend_full_deg=tuple(bend.full_deg.tolist()),
        bend_reduced_deg=tuple(bend.reduced_deg.tolist()),
        time_ratio=time_ratio,
        full_s_per_step=full_s,
        reduced_s_per_step=reduced_s,
        full_hub=robot.hub_model,
        notes=tuple(
            note
            for kind, each in errors.items()
            for name, error in each.items()
            if (note := range_note(f"{kind} {name}", error.range_ratio)) is not None
        ),
        **robot.describe(),
        duration_s=settings.duration_s,
        wall_s=time.monotonic() - start,
    )


@dataclass(frozen=True)
class _Comparer:
    settings: ComparisonSettings
    robot: RobotSpec
    folder: RunFolder
    store: FullOrderStore

    def errors(
        self, kind: Kind, chosen: Sequence[Animation]
    ) -> tuple[dict[str, RobotError], dict[str, tuple[float, ...]]]:
        """Errors of animations by name, and the mean node error of each frame [mm]."""
        errors, curves = {}, {}
        every, progress = self.settings.record_every, self.folder.progress
        for animation in chosen:
            name = f"{kind}_{animation.name}" if kind == "floating" else animation.name
            progress.stage(name)
            pair = ModelPair(animation, self.robot, floating=kind == "floating")
            full = pair.full(self.store, name, every, progress)
            reduced = pair.reduced(every, like=full)
            if self.settings.record:
                reduced.save(self.folder / _reduced_file(name))
            error = errors[animation.name] = robot_error(full, reduced)
            frames = node_error(full, reduced).mean(axis=(1, 2))
            curves[animation.name] = tuple(frames.tolist())
            progress.say(
                f"  {error.mean_node_error_mm:.2f} mm on average, "
                f"{error.mean_node_error_in_hub_mm:.2f} mm in the hub's frame; distance "
                f"{error.forward_reduced_cm:.2f} cm reduced, {error.forward_full_cm:.2f} cm full"
            )
        return errors, curves

    def grid(self, chosen: Sequence[Animation]) -> list[GridPoint]:
        """Errors and times of the further reductions."""
        every, progress = self.settings.record_every, self.folder.progress
        progress.stage("walking further reductions")
        walks = [
            (each, ModelPair(each, self.robot).full(self.store, each.name, every, progress))
            for each in chosen
        ]
        return reduction_grid(self.settings.grid, walks, self.robot, every, progress)


def _reduced_file(name: str) -> str:
    """Name of a recorded walk of a reduced robot."""
    return f"{name}_reduced.npz"


def _mean(values: list[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else float("nan")


def _bent(robot: RobotSpec, settings: ComparisonSettings, folder: RunFolder) -> BendComparison:
    """Bend one leg by both models, and write bend.csv."""
    folder.progress.stage("bending one leg")
    module, rotation = robot.module, robot.physics.rotation
    if settings.bend_pressures_kPa:
        pressures = settings.bend_pressures_kPa
        bend = compare_bend(module.full, module.reduced, pressures, rotation, folder.progress)
    else:
        bend = bend_of_report(module.reduced, module.full.mesh, settings.bend_limit_kPa, rotation)
    rows = zip(bend.pressure_kPa, bend.full_deg, bend.reduced_deg, strict=True)
    lines = ["simulated_kPa,full_deg,reduced_deg", *(f"{p:g},{f:.4f},{r:.4f}" for p, f, r in rows)]
    write_text(folder / "bend.csv", "\n".join(lines) + "\n")
    return bend


def _step_times(
    robot: RobotSpec, settings: ComparisonSettings, folder: RunFolder
) -> tuple[float, float]:
    """Time of a step of the full and the reduced baseline in contact, each on one thread [s]."""
    folder.progress.stage("timing a step of both models")
    (baseline,) = animations(("baseline",), 10.0)
    pair = ModelPair(baseline, robot)
    full = bench_full(
        FullBenchmark(walking_steps=15, timed_steps=settings.timed_steps, repetitions=1),
        pair.spec.full(baseline.design),
        pair.commands_kPa,
        lambda done, total: folder.progress(done, total, "steps of the full robot"),
    )
    return full.seconds_per_step, pair.seconds_per_reduced_step()
