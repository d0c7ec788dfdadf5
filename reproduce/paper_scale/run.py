"""The paper's experiment at its scale: what is kept of a training, and everything that follows it.

    python reproduce/paper_scale/run.py

works with what lies beside this file. After a training of one's own,

    pneumorph coopt --preset paper --physics published --seed 0 --resume --out runs/paper
    python reproduce/paper_scale/run.py --run runs/paper --out runs/kept

keeps that one's first. Each step is a study in a folder of its own under --work; those that are
finished are not made again, and full-order robots go on where they were stopped. Figures go to
--out, and at last every number to its summary.json.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import tyro

from pneumorph.base.artefact import write_json
from pneumorph.base.machine import describe_machine
from pneumorph.base.provenance import source, source_commit
from pneumorph.base.result import finite, result_to_dict
from pneumorph.base.run_folder import (
    SUMMARY,
    TRAINING_FOLDER,
    made_once,
    read_settings,
    read_summary,
)
from pneumorph.base.settings import load_settings
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.learn.metrics import HISTOGRAM_EDGES_CM, read_metrics
from pneumorph.report.analysis_figures import draw_analysis
from pneumorph.report.learning_figures import phase_figure, reward_figure
from pneumorph.report.style import (
    BASELINE_COLOUR,
    LEARNED_COLOUR,
    NEUTRAL_COLOUR,
    figure_style,
    new_figure,
    save_figure,
)
from pneumorph.robot.design import Design
from pneumorph.study.analysis import Analysis, AnalysisSettings, analyse
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.gait_walks import GaitWalkSettings
from pneumorph.study.kept_run import keep_run
from pneumorph.study.reduction import Reduction
from pneumorph.study.reduction_options import learned, reduce_as_asked
from pneumorph.study.simulated_walk import SimulatedWalk, WalkSettings, simulate
from pneumorph.study.study_once import study_folder, study_once
from pneumorph.study.training_result import LearnedPair, TrainingResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(os.path.relpath(Path(__file__).parent))
PUBLISHED = load_settings(RobotOptions, HERE.parent / "published.toml")


class PaperScale:
    """A training and what follows it.

    Args:
        run: Folder of a coopt run to keep; None works with what is kept.
        out: Where small files are kept.
        runs: Where the steps run, in a folder that is named after the training.
    """

    def __init__(self, run: Path | None, out: Path, runs: Path) -> None:
        self.run, self.out, self.runs = run, out, runs

    @property
    def work(self) -> Path:
        """Where the steps run: one training's walks are not another's."""
        return self.runs / FinishedRun.read(self.out).digest()

    @property
    def kept(self) -> TrainingResult:
        """What the training found."""
        return FinishedRun.read(self.out).result(TrainingResult)

    @property
    def gaits(self) -> list[Path]:
        """The best pairs, each a gait that names its design."""
        return [self.out / pair.gait for pair in self.kept.pairs if pair.gait is not None]

    def walk(self, folder: str, part: Path | None = None, **walk: Any) -> SimulatedWalk:
        """Simulate one robot in the training's physics; one that diverges has no distance.

        Args:
            folder: Where, under the working folder.
            part: Another reduced leg than the training's.
            **walk: Fields of `WalkSettings`.
        """
        robot = FinishedRun.read(self.out).robot
        if part is not None:
            robot = replace(robot, part=part)
        place, settings = study_folder(self.work / folder, "simulate"), WalkSettings(**walk)
        return study_once(
            place,
            SimulatedWalk,
            {"walk": settings, "robot": robot},
            lambda: simulate(settings, robot.spec(), place),
        )

    def keep(self) -> None:
        """The training's small files and its figure.

        Raises:
            SystemExit: No training was given.
        """
        if self.run is None:
            raise SystemExit("keep needs a finished training; give its folder by --run")
        keep_run(self.run, self.out)
        found = self.kept
        for earlier in ("full_order", "learned_leg"):  # of another training
            shutil.rmtree(self.out / earlier, ignore_errors=True)
        figure = reward_figure(
            read_metrics(self.out / TRAINING_FOLDER),
            HISTOGRAM_EDGES_CM,
            found.baseline_best_distance_cm,
            found.best_distance_cm,
            found.seen_pairs[: len(found.pairs)],
        )
        save_figure(figure, self.out / "training.png", ("png",))

    def analysis(self) -> None:
        """Rewards of each step, tilt, load and friction of each leg, distance over friction."""
        run = FinishedRun.read(self.out)
        settings = AnalysisSettings(lowest_friction=0.6, highest_friction=1.4)
        place, spec = study_folder(self.work / "analysis", "analyse"), run.robot.spec()
        found = study_once(
            place,
            Analysis,
            {"run": str(self.out), "analysis": settings, "robot": run.robot},
            lambda: analyse(run, settings, spec, place),
        )
        draw_analysis(found, settings, run, spec, place)
        for figure in sorted((self.work / "analysis").glob("*.png")):
            shutil.copy(figure, self.out / figure.name)
        shutil.copy(self.work / "analysis" / "analysis.json", self.out / "analysis.json")

    def baseline(self) -> None:
        """The expert's gait at every phase."""
        figure = phase_figure(self.kept.phases_deg, self.kept.distances_cm)
        save_figure(figure, self.out / "baseline.png", ("png",))

    def baseline_full(self) -> dict[str, Any]:
        """The expert's best phase as finite elements."""
        expert = ExpertGait(phase_deg=self.kept.baseline_best_phase_deg)
        return self.full_order("B", expert=expert)

    def full_order(self, name: str, **walk: Any) -> dict[str, Any]:
        """A walk of finite elements: ten minutes, so its summary is kept and not made again."""
        return made_once(
            self.out / f"full_order/{name}.json",
            lambda: told(self.walk(f"full/{name}", model="full", **walk)),
        )

    def reduced(self) -> list[SimulatedWalk]:
        """The best pairs in the reduced simulator."""
        return [self.walk(f"reduced/{gait.stem}", gait=gait) for gait in self.gaits]

    def full(self) -> list[dict[str, Any]]:
        """The best pairs as finite elements."""
        return [self.full_order(gait.stem, gait=gait) for gait in self.gaits]

    def learned_leg(self) -> list[dict[str, Any]]:
        """The best pairs with a leg that was reduced from the walks of some of them."""
        return [
            made_once(
                self.out / f"learned_leg/{gait.stem}.json", partial(self.learned_leg_walk, gait)
            )
            for gait in self.gaits
        ]

    def learned_leg_walk(self, gait: Path) -> dict[str, Any]:
        """A best pair on the leg that was reduced from walks of best pairs."""
        return told(self.walk(f"learned_leg/{gait.stem}", self.make_learned_leg(), gait=gait))

    def learned_from(self) -> list[Path]:
        """The gaits whose walks the leg is reduced from."""
        places = best_of_each_leg_count(self.kept.pairs)
        return [self.gaits[place] for place in places]

    def make_learned_leg(self) -> Path:
        """A leg reduced from full walks under the training's damping: half an hour.

        Raises:
            SystemExit: The training's robots are others than those that `reduce` walks.
        """
        robot = FinishedRun.read(self.out).robot
        if replace(robot.physics, damping=PUBLISHED.physics.damping) != PUBLISHED.physics or (
            (robot.leg, robot.masses, robot.calibration) != (PUBLISHED.leg, PUBLISHED.masses, None)
        ):
            raise SystemExit(
                "learned_leg needs a training with the paper's leg, masses and physics, but for "
                f"the damping; got leg {robot.leg}, {robot.masses}, calibration "
                f"{robot.calibration} and {robot.physics}"
            )
        walked = GaitWalkSettings(gaits=tuple(self.learned_from()), damping=robot.physics.damping)
        options, place = (
            replace(learned(), leg=robot.leg, walked=walked),
            study_folder(self.work / "leg", "reduce"),
        )
        found = study_once(place, Reduction, options, lambda: reduce_as_asked(options, place))
        return Path(found.part)

    def mirror(self) -> SimulatedWalk:
        """The mirror image of the best design, driven by the best design's gait."""
        mirrored = Design.parse(self.reduced()[0].design).mirror()
        return self.walk("mirror", gait=self.gaits[0], design=str(mirrored))

    def summary(self) -> None:
        """Lay what followed the training over its own summary."""
        summary = read_summary(self.out)
        learned_leg, learned_from = self.learned_leg(), self.learned_from()
        walks = zip(
            summary["pairs"], self.gaits, self.reduced(), learned_leg, self.full(), strict=True
        )
        pairs = [
            {
                **pair,
                "distance_cm": reduced.distance_cm,
                "distance_learned_leg_cm": again["distance_cm"],
                "leg_learned_from_it": gait in learned_from,
                "distance_full_order_cm": full["distance_cm"],
            }
            for pair, gait, reduced, again, full in walks
        ]
        best_cm, best_full_cm = (
            pairs[0][name] for name in ("distance_cm", "distance_full_order_cm")
        )
        baseline_cm = summary["baseline_best_distance_cm"]
        baseline_full_cm = self.baseline_full()["distance_cm"]
        content = {
            **summary,
            "best_distance_cm": best_cm,
            "best_distance_learned_leg_cm": pairs[0]["distance_learned_leg_cm"],
            "best_distance_full_order_cm": best_full_cm,
            "baseline_best_distance_full_order_cm": baseline_full_cm,
            "times_the_baseline": ratio(best_cm, baseline_cm),
            "times_the_baseline_full_order": ratio(best_full_cm, baseline_full_cm),
            "mirror_image_distance_cm": self.mirror().distance_cm,
            "learned_leg": learned_leg[0]["leg"],
            "pairs": pairs,
            "settings": read_settings(self.out),
            "machine_of_these_walks": describe_machine(),
            "commit_of_these_walks": source_commit(),
        }
        write_json(self.out / SUMMARY, finite(content))
        distances = distances_figure(pairs, (baseline_cm, baseline_full_cm))
        save_figure(distances, self.out / "distances.png", ("png",))


@figure_style()
def distances_figure(pairs: list[dict[str, Any]], baselines: tuple[float, float | None]) -> Figure:
    """Distances of the baseline and the best pairs in both models."""
    figure = new_figure(5.8, 3.0)
    axes = figure.add_subplot()
    labels = ["B", *(f"L{rank}" for rank in range(1, len(pairs) + 1))]
    place = np.arange(len(labels))
    for shift, name, baseline, colour, label in (
        (-0.29, "distance_cm", baselines[0], LEARNED_COLOUR, "reduced"),
        (0.0, "distance_learned_leg_cm", None, NEUTRAL_COLOUR, "reduced from learned walks"),
        (0.29, "distance_full_order_cm", baselines[1], BASELINE_COLOUR, "full order"),
    ):
        values = [baseline, *(pair[name] for pair in pairs)]
        heights = np.array([np.nan if value is None else value for value in values])
        bars = axes.bar(place + shift, heights, 0.28, color=colour, label=label)
        axes.bar_label(bars, fmt="%.1f", fontsize=6)
    axes.set(xticks=place, xticklabels=labels, ylabel="distance in 20 s (cm)")
    figure.legend(loc="outside upper center", ncols=3)
    return figure


def told(walk: SimulatedWalk) -> dict[str, Any]:
    """A walk as it is kept, with what made it."""
    return {"verb": "simulate", "made_by": source(), **result_to_dict(walk)}


def best_of_each_leg_count(pairs: Sequence[LearnedPair]) -> list[int]:
    """Places of the pairs that are the best with their number of legs, ascending."""
    best: dict[int, int] = {}
    for place, pair in enumerate(pairs):
        best.setdefault(Design.parse(pair.design).leg_count, place)
    return sorted(best.values())


def ratio(distance: float | None, baseline: float | None) -> float | None:
    """How many times as far; None where the baseline does not come forward at all."""
    return None if distance is None or not baseline or baseline <= 0.0 else distance / baseline


Step = Literal["keep", "analysis", "baseline", "reduced", "learned_leg", "mirror", "baseline_full",
               "full", "summary"]  # fmt: skip


def main(
    run: Path | None = None,
    out: Path = HERE,
    work: Path = Path("runs/paper_scale"),
    steps: tuple[Step, ...] = (),
) -> None:
    """Make the steps that are asked for.

    Args:
        run: Folder of a finished training to keep.
        out: Where small files and figures are kept.
        work: Where the steps run.
        steps: Some of them alone.
    """
    todo = PaperScale(run, out, work)
    for step in steps or get_args(Step)[run is None :]:
        print(f"{step} ...", flush=True)
        make: Callable[[], object] = getattr(todo, step)
        make()


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
