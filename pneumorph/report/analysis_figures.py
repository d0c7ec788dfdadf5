"""The figures of an analysis, drawn from its result and the walks that it recorded."""

from __future__ import annotations

from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.gait.friction_margin import friction_margin
from pneumorph.report.pairs_figure import Pair, pairs_figure
from pneumorph.report.plan import plans_of_spec
from pneumorph.report.robustness_figures import friction_figure, margin_figure
from pneumorph.report.style import save_figure
from pneumorph.report.walk_figures import cycle_figure, step_figure
from pneumorph.study.analysis import (
    Analysis,
    AnalysisSettings,
    leg_friction,
    walk_file,
    walkers,
)
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.recorded_trajectories import remove_earlier
from pneumorph.trajectory import Trajectory


def draw_analysis(
    found: Analysis,
    settings: AnalysisSettings,
    run: FinishedRun,
    spec: RobotSpec,
    folder: RunFolder,
) -> None:
    """Draw steps, margin, friction, pairs and a cycle of each robot, in place of earlier ones.

    Robots that did not come to the end of their walks are left out; nothing is drawn where none
    did.

    Args:
        found: What `pneumorph.study.analysis.analyse` found.
        settings: What it was asked.
        run: The run that was analysed.
        spec: What the robots walked as.
        folder: Where the analysis recorded its walks; receives the figures.
    """
    robots = {
        each.label: (each, walker, Trajectory.load(folder / walk_file(each.label)))
        for each, walker in zip(found.robots, walkers(run, settings.pair_count), strict=True)
        if each.status == "completed"
    }
    drawn = ("steps", "margin", "friction", "pairs", "cycle_B", "cycle_L*")
    remove_earlier(folder.path, *(f"{name}.png" for name in drawn))
    if not robots:
        return
    goal = found.goal
    step_s = run.task.action_s(spec.physics.time_step_s)
    figures = {
        "steps": step_figure(
            {label: (walk.time_s, goal.along(walk)) for label, (_, _, walk) in robots.items()},
            step_s,
            settings.cycle_s,
            goal,
        ),
        "margin": margin_figure(
            {
                label: (
                    walker.design,
                    friction_margin(walk, leg_friction(walker.design, walk, spec)),
                )
                for label, (_, walker, walk) in robots.items()
            },
            settings.cycle_s,
        ),
        "friction": friction_figure(
            found.frictions,
            {label: each.over_friction for label, (each, _, _) in robots.items()},
            None if spec.physics.friction_by_surface else found.friction,
            goal,
        ),
        "pairs": pairs_figure(
            [
                Pair(label, walker.design, walker.gait, goal.of_pair(each), goal)
                for label, (each, walker, _) in robots.items()
            ],
            spec.regulators,
            plans_of_spec(spec),
        ),
        **{
            f"cycle_{label}": cycle_figure(walk, settings.cycle_s, goal)
            for label, (_, _, walk) in robots.items()
        },
    }
    for name, figure in figures.items():
        save_figure(figure, folder / f"{name}.png", ("png",))
