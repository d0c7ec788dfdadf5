"""What it changes that the teeth of a leg cannot pass through each other.

    python reproduce/teeth/run.py

In the measured physics, reduced robots: the blocked force of a leg with and without contact between
its teeth, and the kept pairs of reproduce/long_trainings in worlds that their training never saw.
Writes leg.npz, the leg with contact, which every verb takes as --part, into --work and teeth.json
into --out.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.result import finite
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.leg_kinds import load_default_leg, measured_leg_mesh
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.tooth_gap import tooth_gaps
from pneumorph.geometry.wall_gap import WallGap
from pneumorph.reduction.blocked_force import blocked_forces
from pneumorph.reduction.facing_walls import STIFFNESS_KPA_PER_MM, with_facing_walls
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.study.certified_candidates import unseen_worlds
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.recorded_walk import recorded_walk
from pneumorph.study.robustness import walks_in_worlds

HERE = Path(__file__).parent
RUNS = tuple(HERE.parent / "long_trainings" / f"seed_{seed}" for seed in (0, 1, 2))
PRESSURES_KPA = tuple(range(10, 101, 10))
FRAMES = 5
"""Of the frames of a walk every so many are looked at."""


def main(
    runs: tuple[Path, ...] = RUNS,
    pair_count: int = 3,
    world_count: int = 48,
    work: Path = Path("runs/teeth"),
    out: Path = HERE,
    stiffness_kPa_per_mm: float = STIFFNESS_KPA_PER_MM,
) -> None:
    """Walk the pairs with both legs, and write what was found.

    Args:
        runs: Trainings of the measured physics.
        pair_count: So many pairs of each.
        world_count: Worlds that the trainings never saw.
        work: Folder of the leg with contact.
        out: Folder of teeth.json.
        stiffness_kPa_per_mm: Pressure between teeth that overlap by a millimetre.
    """
    shape, mesh = PneuNetShape(), measured_leg_mesh()
    leg = load_default_leg("measured")
    touching = with_facing_walls(leg, mesh, tooth_gaps(shape, mesh), stiffness_kPa_per_mm)
    legs = {"through": leg, "touching": touching}
    file = touching.save(work / "leg.npz")
    usual = RobotOptions.of("measured").spec()
    specs = {"through": usual, "touching": usual.reduced_again(file)}
    found: dict[str, Any] = {
        "stiffness_kPa_per_mm": stiffness_kPa_per_mm,
        "blocked": {name: _blocked(each) for name, each in legs.items()},
        "world_count": world_count,
        "pairs": [],
    }
    for run in map(FinishedRun.read, runs):
        found["pairs"] += _pairs(run, pair_count, world_count, specs, work)
    write_json(out / "teeth.json", finite(found))
    print(f"wrote {file} and {out / 'teeth.json'}")


def _blocked(leg: ReducedPart) -> dict[str, Any]:
    """Blocked force and least gap at rising pressures, while an equilibrium is found."""
    mesh = measured_leg_mesh()
    gaps, forces = tooth_gaps(PneuNetShape(), mesh), list(blocked_forces(leg, mesh, PRESSURES_KPA))
    return {
        "pressure_kPa": [each.pressure_kPa for each in forces],
        "force_mN": [each.force_mN for each in forces],
        "gap_mm": [_least_mm(gaps, each.positions) for each in forces],
    }


def _pairs(
    run: FinishedRun, pair_count: int, world_count: int, specs: dict[str, RobotSpec], work: Path
) -> list[dict[str, Any]]:
    """Distances over the worlds and gaps in the nominal one, of each pair with each leg."""
    assert run.worlds is not None, "a training of the measured physics has worlds"
    pairs, worlds = run.pairs(pair_count), unseen_worlds(run.worlds, world_count, 0)
    rows: list[dict[str, Any]] = [
        {"run": run.folder.name, "pair": f"L{rank}", "design": str(pair.design)}
        for rank, pair in enumerate(pairs, start=1)
    ]
    for name, spec in specs.items():
        print(f"{run.folder.name}, teeth {name} ...", flush=True)
        far, *_ = walks_in_worlds(
            spec,
            [pair.design for pair in pairs],
            [pair.gait for pair in pairs],
            worlds,
            run.task.settling_step_count,
            RunFolder(work, "teeth"),
        )
        for row, pair, own in zip(rows, pairs, far.T, strict=True):
            gaps = _gaps_mm(recorded_walk(spec, pair.design, pair.gait).node_positions_mm)
            row[name] = {
                "median_cm": float(np.nanmedian(own)),
                "low_cm": float(np.nanquantile(own, 0.1)),
                "high_cm": float(np.nanquantile(own, 0.9)),
                "failed_count": int(np.isnan(own).sum()),
                "least_gap_mm": float(gaps.min()),
                "share_crossing": float(np.mean(gaps < 0.0)),
            }
    return rows


def _gaps_mm(positions: np.ndarray | None) -> np.ndarray:
    """Least gap of every leg in some frames [mm], (frame, leg)."""
    assert positions is not None, "the walk was recorded with its nodes"
    gaps = tooth_gaps(PneuNetShape(), measured_leg_mesh())
    return np.array([[_least_mm(gaps, leg) for leg in frame] for frame in positions[::FRAMES]])


def _least_mm(gaps: Sequence[WallGap], positions: np.ndarray) -> float:
    return min(gap.least_mm(positions) for gap in gaps)


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
