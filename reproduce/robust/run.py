"""A robot for worlds that nobody has measured: how far it will walk, and how sure that is.

    python reproduce/robust/run.py RUN --seeds RUN1 RUN2 --other-leg runs/other_leg/leg.npz

RUN is a run of `pneumorph coopt`, the others of further seeds; `other_leg.py` makes
the leg of the hidden worlds. After `pneumorph certify RUN --full` has reduced the leg again, all is
of that leg: --certified certificate.json --part round_1/leg.npz. Every step keeps what it made in
--work, so the same call goes on where it was stopped. summary.json and the figures are of all steps
that have been made, now or earlier: what --work does not have is taken from the summary.json of the
same training and leg that is there, and what was never made is null. Finite elements know of no
reduction: their walks stay when a leg is reduced otherwise, and stand beside its distances.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import tyro
from bench_tests import narrowed
from figures import bands_figure, narrowing_figure
from hidden_worlds import FIRST_SEED, covered, hidden_rig, of_other_leg

from pneumorph.base.artefact import read_json, write_json
from pneumorph.base.result import finite, result_from_dict, result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import laid_over
from pneumorph.catalogue.robot_identity import reduction_digest
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.report.style import save_figure
from pneumorph.simulation.randomisation import World
from pneumorph.study.analysis import walkers
from pneumorph.study.certificate import worst_worlds
from pneumorph.study.certified_candidates import CertificateSettings, unseen_worlds
from pneumorph.study.certified_pairs import Band, Certificate
from pneumorph.study.certified_rounds import certify
from pneumorph.study.certified_walks import (
    REPEATED,
    REPEATED_SHARE,
    FullOrderWalk,
    KeptWalk,
    full_order_walks,
)
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.near_worlds import near_worlds
from pneumorph.study.recorded_walk import recorded_walk
from pneumorph.study.reduce_settings import from_walks
from pneumorph.study.rivals import METHODS, WORLDS, Contender, Found, learned, searched, worlds_of
from pneumorph.study.robustness import walks_in_worlds
from pneumorph.study.study_once import study_folder, study_once

WALKS_FILE = "walks.json"
_NEAR = 4
"""Worlds near each of the unseen ones."""
HERE = Path(__file__).parent
Step = Literal[
    "certificate",
    "seeds",
    "damping",
    "repeats",
    "hidden",
    "hidden_own",
    "bench",
    "rivals",
    "walks",
    "full",
    "hidden_full",
]
STEPS: tuple[Step, ...] = (
    "certificate", "seeds", "damping", "repeats", "hidden", "hidden_own", "bench", "rivals"
)  # fmt: skip


def main(
    run: tyro.conf.Positional[Path],
    seeds: tuple[Path, ...] = (),
    other_leg: Path = Path("runs/other_leg/leg.npz"),
    out: Path = HERE,
    work: Path = Path("runs/robust"),
    steps: tuple[Step, ...] = STEPS,
    hidden_count: int = 200,
    hidden_full_count: int = 10,
    rivals_of: tuple[Path, ...] = (),
    certified: Path | None = None,
    part: Path | None = None,
) -> None:
    """Make the steps, and write what is known.

    Args:
        run: Folder of the training.
        seeds: Folders of trainings of other seeds.
        other_leg: The leg of the hidden worlds.
        out: Folder of summary.json and the figures.
        work: Where the steps are made.
        steps: Which of them; walks and full walk finite elements, hours, and so does hidden_full.
            walks are one after another, and no leg is reduced again.
        hidden_count: Hidden worlds.
        hidden_full_count: How many of them with robots of finite elements, an hour each: kept in
            hidden_walks/ beside summary.json, so that another machine need not take it again.
        rivals_of: Trainings whose time the searches get; none for all seeds.
        certified: A certificate with finite elements, as `pneumorph certify --full` writes it: it
            is taken with its walks, and none is made.
        part: The leg of its last round; by default the training's.
    """
    source = FinishedRun.read(run)
    digest = source.digest()
    work = work / digest
    if part is not None:
        settings = laid_over(dict(source.settings), {"robot": {"part": str(part)}})
        source = replace(source, settings=settings)
    spec = source.robot.spec()
    work = work / reduction_digest(spec)[:12]
    worlds = worlds_of(source)
    if certified is None:
        certificate = _certificate(source, work, "full" in steps)
    else:
        certificate = result_from_dict(Certificate, read_json(certified, "certificate"))
        _refuse_other_pairs(source, certificate, certified)
    best = certificate.pairs[int(certificate.best.removeprefix("L")) - 1]
    earlier = _earlier(out / "summary.json", digest, best.design)
    of_leg = earlier if earlier.get("leg_digest") == reduction_digest(spec) else {}
    gait = run / best.gait
    reality = of_other_leg(source.robot, other_leg)
    made: dict[str, Any] = {}
    keep = partial(_kept, made, work, steps, of_leg)
    runs = [source, *(FinishedRun.read(each) for each in seeds)]
    # The expert's come first.
    expert_cm = np.array(certificate.achieved, dtype=float)[:, 0]
    keep("seeds", lambda: _seeds(runs, work, expert_cm))
    keep("damping", lambda: _damping(source, certificate, work))
    keep("repeats", lambda: _repeats(source, certificate, work))
    if certified is not None:
        walks = [
            {"pair": pair.label, **result_to_dict(walk), "states": None}
            for pair in certificate.pairs
            for walk in pair.full_order
        ]
    else:
        known = _read(work / WALKS_FILE, earlier.get("walks", []))
        walks = _walked(source, certificate, work, known, made="walks" in steps)
    of_rig = partial(covered, gait, reality, worlds, best.band, work=work / "hidden")
    keep("hidden", lambda: result_to_dict(of_rig(hidden_count)))
    # The leg that it learned on there, which tells what of a difference is the other leg's.
    of_own = partial(covered, gait, source.robot, worlds, best.band, work=work / "hidden_own")
    keep("hidden_own", lambda: result_to_dict(of_own(hidden_count)))
    walked = partial(of_rig, model="full", kept=out / "hidden_walks" / digest)
    keep("hidden_full", lambda: result_to_dict(walked(hidden_full_count)))
    if made["hidden"] is not None:
        first = made["hidden"]["distances_cm"][0] or 0.0  # failed, it goes nowhere
        rig = hidden_rig(worlds, FIRST_SEED)
        keep(
            "bench",
            lambda: result_to_dict(
                narrowed(source, certificate, reality, rig, first, work / "bench")
            ),
        )
    rivals = [FinishedRun.read(each) for each in rivals_of] or runs
    keep("rivals", lambda: _rivals(rivals, work, expert_cm))
    of_best = [walk for walk in walks if walk["pair"] == certificate.best]
    summary = {
        "digest": digest,
        "run": source.summary.get("made_by"),
        "leg_digest": reduction_digest(spec),
        "leg_mode_count": spec.module.reduced.mode_count,
        "best_design": best.design,
        "median_cm": best.band.median,
        "tenth_percentile_cm": best.band.low,
        "ninetieth_percentile_cm": best.band.high,
        "expert_median_cm": certificate.expert_median,
        "share_beyond_expert": best.share_beyond_expert,
        "optimism_cm": best.optimism,
        "world_count": certificate.world_count,
        "full_order_cm": [walk["full_cm"] for walk in of_best],
        "reduced_cm": [walk["reduced_cm"] for walk in of_best],
        "walks": walks,
        "wall_s": source.of_summary("wall_s", float),
        "band_coverage": None if made["hidden"] is None else made["hidden"]["share_within"],
        **made,
    }
    write_json(out / "summary.json", finite(summary))
    write_json(out / "certificate.json", finite(result_to_dict(certificate)))
    if made["rivals"]:
        save_figure(bands_figure(made["rivals"]), out / "rivals.png", ("png",))
    if made.get("bench"):
        save_figure(narrowing_figure(made["bench"]), out / "bench.png", ("png",))
    print(f"wrote {out / 'summary.json'}")


def _certificate(run: FinishedRun, work: Path, full: bool) -> Certificate:
    """Of 200 unseen worlds; with finite elements where they are asked for or there."""
    there = (work / "certificate_full" / "summary.json").exists()
    settings = CertificateSettings(full=full or there, randomisation=worlds_of(run))
    folder = study_folder(
        work / ("certificate_full" if settings.full else "certificate"), "certify"
    )
    robot = run.robot
    return study_once(
        folder,
        Certificate,
        {"run": run.digest(), "certificate": settings, "robot": robot},
        lambda: certify(run, settings, robot.spec(), folder, from_walks(robot.leg_name)),
    )


def _refuse_other_pairs(run: FinishedRun, certificate: Certificate, file: Path) -> None:
    """Refuse a certificate whose finalists were fine-tuned again: seeds, damping and the bench are
    of the training's own.

    Raises:
        ValueError: A pair of it is none of the training's.
    """
    for pair in certificate.pairs:
        rank = int(pair.label.removeprefix("L"))
        own = run.pairs()[rank - 1] if rank <= len(run.pairs()) else None
        if own is None or str(own.design) != pair.design or Path(pair.gait).is_absolute():
            raise ValueError(
                f"{pair.label} of {file} is no pair of {run.folder}, expected the training's own: "
                "finalists that were fine-tuned on another leg are in the folder of the round"
            )


def _earlier(summary: Path, digest: str, best_design: str) -> dict[str, Any]:
    """What an earlier call found of the same training and its same best pair."""
    found = _read(summary, {})
    same = found.get("digest") == digest and found.get("best_design") == best_design
    return found if same else {}


def _read(file: Path, otherwise: Any) -> Any:
    return json.loads(file.read_text()) if file.exists() else otherwise


def _kept(
    made: dict[str, Any],
    work: Path,
    steps: tuple[Step, ...],
    earlier: dict[str, Any],
    name: Step,
    make: Any,
) -> None:
    """Make a step where it is asked for, otherwise take what is there."""
    file = work / f"{name}.json"
    if name in steps:
        write_json(file, finite({"found": make()}))
    made[name] = json.loads(file.read_text())["found"] if file.exists() else earlier.get(name)


def _seeds(runs: list[FinishedRun], work: Path, expert_cm: np.ndarray) -> list[dict[str, Any]]:
    return [_found(each, learned(each), work, expert_cm) for each in runs]


def _found(
    run: FinishedRun, contender: Contender, work: Path, expert_cm: np.ndarray
) -> dict[str, Any]:
    """A contender in the unseen worlds, where the expert's robot goes so far [cm], (world,)."""
    far_cm = contender.walked(run, RunFolder(work, "robust"))
    return result_to_dict(Found.of(contender, far_cm, expert_cm))


def _walked(
    run: FinishedRun,
    certificate: Certificate,
    work: Path,
    earlier: list[dict[str, Any]],
    made: bool,
) -> list[dict[str, Any]]:
    """Pairs as finite elements beside their reduced robots of this leg, where they walked earlier;
    where walks are made, the best pair in the nominal world and in its two worst, and the others in
    the nominal one, each kept once it is made."""
    best = int(certificate.best.removeprefix("L"))
    # The expert's come first.
    reduced_cm = np.array(certificate.achieved, dtype=float)
    worst = worst_worlds(reduced_cm[:, best], CertificateSettings().worst_world_count)
    others = [place for place in range(1, len(certificate.pairs) + 1) if place != best]
    asked = [*((best, world) for world in (None, *worst)), *((other, None) for other in others)]
    worlds = unseen_worlds(worlds_of(run), WORLDS, 0)
    folder, walks, spec = RunFolder(work / "certificate_full", "certify"), [], run.robot.spec()
    there = {
        (int(walk.get("pair", certificate.best).removeprefix("L")), walk["world"]): KeptWalk(
            walk["full_cm"], walk["status"], walk["wall_s"], walk["states"]
        )
        for walk in earlier
    }
    for place, number in asked if made else there:
        kept, walker = there.get((place, number)), walkers(run, place)[-1]
        if kept is None:
            world = None if number is None else worlds[number]
            (kept,) = full_order_walks(spec, [(walker, world)], folder)
        pair = certificate.pairs[place - 1]
        reduced = pair.nominal if number is None else float(reduced_cm[number, place])
        here = World.nominal(spec.physics) if number is None else worlds[number]
        near_cm, *_ = walks_in_worlds(
            spec,
            [walker.design],
            [walker.gait],
            near_worlds(here, spec.physics),
            walker.settling_steps,
            folder,
            keep=True,
        )
        walk = FullOrderWalk.of(number, kept, reduced, near=near_cm[:, 0])
        walks.append({"pair": pair.label, **result_to_dict(walk)})
        if made:
            write_json(work / WALKS_FILE, finite(walks))
    return walks


def _repeats(run: FinishedRun, certificate: Certificate, work: Path) -> dict[str, Any]:
    """How far the best pair's walks change at most in four worlds that differ by a thousandth."""
    best, spec = int(certificate.best.removeprefix("L")), run.robot.spec()
    pair = run.pairs()[best - 1]
    again, *_ = walks_in_worlds(
        spec,
        [pair.design],
        [pair.gait],
        [
            near
            for number, each in enumerate(unseen_worlds(worlds_of(run), WORLDS, 0))
            for near in near_worlds(each, spec.physics, _NEAR, seed=number)
        ],
        run.task.settling_step_count,
        RunFolder(work, "robust"),
    )
    # The expert's come first.
    first_cm = np.nan_to_num(np.array(certificate.achieved, dtype=float)[:, best])
    near_cm = again[:, 0].reshape(-1, _NEAR)
    changes_cm = np.abs(np.nan_to_num(near_cm) - first_cm[:, None]).max(axis=1)
    allowed_cm = np.maximum(REPEATED["cm"], REPEATED_SHARE * np.abs(first_cm))
    return {
        "median_change_cm": float(np.median(changes_cm)),
        "ninetieth_percentile_change_cm": float(np.quantile(changes_cm, 0.9)),
        "largest_change_cm": float(changes_cm.max()),
        "chaotic_share": float(np.mean(changes_cm > allowed_cm)),
        "bands": [result_to_dict(Band.of(each)) for each in near_cm.T],
    }


def _damping(run: FinishedRun, certificate: Certificate, work: Path) -> dict[str, Any]:
    """The best pair with other loss factors in the same worlds, and in the published physics."""
    pair = run.pairs()[int(certificate.best.removeprefix("L")) - 1]
    worlds = unseen_worlds(worlds_of(run), WORLDS, 0)
    found: dict[str, Any] = {}
    for factor in (0.5, 1.0, 2.0):
        own = [replace(each, damping_factor=factor * each.damping_factor) for each in worlds]
        far, *_ = walks_in_worlds(
            run.robot.spec(),
            [pair.design],
            [pair.gait],
            own,
            run.task.settling_step_count,
            RunFolder(work, "robust"),
        )
        found[f"loss_factor_times_{factor:g}"] = result_to_dict(Band.of(far[:, 0]))
    usual = found["loss_factor_times_1"]["median_cm"]
    for factor in (0.5, 2.0):
        name = f"loss_factor_times_{factor:g}"
        found[f"kept_with_{name}"] = found[name]["median_cm"] / usual
    published = RobotOptions.of("published").spec()
    walked = recorded_walk(published, pair.design, pair.gait)
    found["published_physics_cm"] = walked.distance_cm
    return found


def _rivals(runs: list[FinishedRun], work: Path, expert_cm: np.ndarray) -> list[dict[str, Any]]:
    found = []
    for run in runs:
        rows = (learned(run), *(searched(run, method, work / "rivals") for method in METHODS))
        found += [_found(run, each, work, expert_cm) for each in rows if each is not None]
    return found


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
