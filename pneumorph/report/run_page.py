"""The report page of a run folder: what was asked, what came out, and how to repeat it."""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pneumorph import __version__
from pneumorph.coopt.metrics import HISTOGRAM_EDGES_CM, read_metrics
from pneumorph.gait.phase_sweep import PhaseSweep
from pneumorph.report import page
from pneumorph.report.bend_figure import bend_figure
from pneumorph.report.distance_figure import distance_figure
from pneumorph.report.entropy_figure import entropy_figure
from pneumorph.report.film import FilmSettings, side_by_side, write_film, write_still
from pneumorph.report.page import Section
from pneumorph.report.path_figure import path_figure
from pneumorph.report.phase_figure import phase_figure
from pneumorph.report.plan_view import plan_view_figure
from pneumorph.report.pressure_figure import pressure_figure
from pneumorph.report.reward_figure import reward_figure
from pneumorph.report.scene import Actor
from pneumorph.robot.design import Design
from pneumorph.trajectory import Trajectory

_ROBOT_LABELS = {
    "best_trajectory.npz": "learned",
    "baseline_trajectory.npz": "expert",
    "trajectory.npz": "robot",
}


@dataclass(frozen=True)
class Run:
    """A finished run as its files tell it.

    Attributes:
        folder: The run folder.
        summary: Its summary, with the name of its ``verb``.
        settings: Its resolved settings.
    """

    folder: Path
    summary: Mapping[str, Any]
    settings: Mapping[str, Any]

    def trajectories(self) -> dict[str, Trajectory]:
        """Return the trajectories of the folder by what their robot is called."""
        found = {}
        for name, label in _ROBOT_LABELS.items():
            if (self.folder / name).exists():
                found[label] = Trajectory.load(self.folder / name)
        return found


def write_run_page(
    run: Run,
    path: Path,
    film: FilmSettings | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> Path:
    """Write the page of a run.

    Args:
        run: The run.
        path: The HTML file; the film and its still are written beside it.
        film: How the film looks.
        progress: Told how far the film is.
    """
    trajectories = run.trajectories()
    sections: list[Section] = []
    if trajectories:
        sections += _robot_sections(run, trajectories, path.parent, film, progress)
    sections += _sweep_sections(run)
    sections += _training_sections(run)
    sections += _pair_sections(run)
    sections += _comparison_sections(run)
    sections += [_summary_section(run), *_leg_sections(run), _settings_section(run)]
    verb = run.summary["verb"]
    opening = page.numbers(_headline(run))
    title = "A robot learned to crawl" if verb == "coopt" else f"pneumorph {verb}"
    return page.write_page(path, title, _lead(run), opening, sections)


def _lead(run: Run) -> str:
    summary = run.summary
    if summary["verb"] == "coopt":
        return (
            f"Design and gait learned together in {summary['timesteps']:,} timesteps, beside the "
            "expert's design and gait in the same simulator."
        )
    return f"Run folder {run.folder}"


def _headline(run: Run) -> dict[str, str]:
    """Return the numbers a reader wants first, by their names."""
    shown = {
        "best_distance_cm": ("learned, distance in 20 s", "{:.1f} cm"),
        "baseline_best_distance_cm": ("expert's best phase", "{:.1f} cm"),
        "baseline_best_phase_deg": ("the expert's best phase", "{:.0f}°"),
        "distance_cm": ("distance", "{:.1f} cm"),
        "best_design": ("learned design", "{}"),
        "animations_mean_node_error_mm": ("mean node error", "{:.2f} mm"),
        "bend_error_percent": ("bend error", "{:.1f} %"),
        "time_ratio": ("times as fast as the full model", "{:.0f}"),
        "mode_count": ("modes", "{}"),
        "env_steps_per_s": ("robot steps per second", "{:,.0f}"),
        "wall_s": ("time taken", "{:.0f} s"),
    }
    return {
        name: pattern.format(run.summary[key])
        for key, (name, pattern) in shown.items()
        if run.summary.get(key) is not None
    }


def _robot_sections(
    run: Run,
    trajectories: dict[str, Trajectory],
    folder: Path,
    film: FilmSettings | None,
    progress: Callable[[int, int, str], None] | None,
) -> list[Section]:
    designs = {name: Design.parse(each.metadata["design"]) for name, each in trajectories.items()}
    actors = side_by_side(
        [Actor.of(each, f"{name}\n{designs[name]}") for name, each in trajectories.items()]
    )
    film_path = write_film(folder / "film.mp4", actors, film, progress)
    still = write_still(folder / "still.png", actors, 3.0, film)
    caption = (
        "A leg has its regulator's colour, pale while slack and full at 90 kPa. Lines on the floor "
        "are 5 cm apart; the dark one is the start. Forward is to the right."
    )
    first, trajectory = next(iter(trajectories.items()))
    used = max(designs[first].assignment)
    return [
        Section("Film", page.filmed(film_path, still, caption)),
        Section(
            "Distance and path",
            page.side_by_side(
                page.drawn(distance_figure(trajectories), "Forward distance of the disk's centre."),
                page.drawn(
                    path_figure(
                        trajectories, {name: each.assignment for name, each in designs.items()}
                    ),
                    "Paths seen from above, each robot drawn where it ended.",
                ),
            ),
        ),
        Section(
            "Gait",
            page.side_by_side(
                page.drawn(
                    pressure_figure(trajectory, used),
                    f"Pressures of the {first} gait: what is commanded, and what the regulators "
                    "reach at 150 kPa/s.",
                ),
                page.drawn(
                    plan_view_figure(designs[first].assignment, str(designs[first])),
                    "The design from above: colour and number are the regulator's, the arrow is "
                    "forward.",
                ),
            ),
        ),
    ]


def _sweep_sections(run: Run) -> list[Section]:
    if not (run.folder / "phase_sweep.npz").exists():
        return []
    sweep = PhaseSweep.load(run.folder / "phase_sweep.npz")
    figure = phase_figure(
        sweep.phase_deg.tolist(), sweep.distance_cm.tolist(), run.summary.get("best_distance_cm")
    )
    caption = (
        "The expert's design 1.0.0.2.2.0.0.1 under two sine waves of 0 to 90 kPa and 4 s, the hind "
        "legs later by the phase."
    )
    return [Section("The expert's gait at every phase", page.drawn(figure, caption))]


def _training_sections(run: Run) -> list[Section]:
    metrics = read_metrics(run.folder / "training")
    if not metrics:
        return []
    baseline_cm = run.summary.get("baseline_best_distance_cm")
    learned_cm = run.summary.get("best_distance_cm")
    return [
        Section(
            "Training",
            page.side_by_side(
                page.drawn(
                    reward_figure(metrics, HISTOGRAM_EDGES_CM, baseline_cm, learned_cm),
                    "Distance of each round of episodes. Grey shades: scores of all designs, "
                    "weighted by the design distribution; the last bin holds all beyond it.",
                ),
                page.drawn(
                    entropy_figure(metrics),
                    "The design distribution narrows as its entropy follows the target.",
                ),
            ),
        )
    ]


def _pair_sections(run: Run) -> list[Section]:
    pairs = run.summary.get("pairs") or []
    if not pairs:
        return []
    views = [
        page.drawn(
            plan_view_figure(Design.parse(pair["design"]).assignment),
            f"L{rank}: {pair['design']}, {_centimetres(pair['distance_cm'])}",
        )
        for rank, pair in enumerate(pairs, start=1)
    ]
    return [Section("The best pairs", page.tiles(views))]


def _comparison_sections(run: Run) -> list[Section]:
    summary, sections = run.summary, []
    if "animations" in summary:
        rows = [
            (
                name.replace("_", " "),
                each["mean_node_error_mm"],
                each["mean_node_error_in_hub_mm"],
                each["largest_node_error_mm"],
                each["mean_displacement_mm"],
                each["time_ratio"],
            )
            for name, each in summary["animations"].items()
        ]
        header = ["animation", "mean error (mm)", "in the hub's frame (mm)", "largest (mm)",
                  "mean displacement (mm)", "times as fast"]  # fmt: skip
        sections.append(Section("Reduced beside full robots", page.table(header, rows)))
    if "bend_pressures_kPa" in summary:
        figure = bend_figure(
            summary["bend_pressures_kPa"], summary["bend_full_deg"], summary["bend_reduced_deg"]
        )
        caption = "A single leg held at its attachment, without floor or gravity."
        sections.append(Section("Bend of one leg", page.drawn(figure, caption)))
    return sections


def _summary_section(run: Run) -> Section:
    plain = [
        (name.replace("_", " "), value)
        for name, value in run.summary.items()
        if isinstance(value, str | int | float) and not isinstance(value, bool)
    ]
    notes = "".join(page.paragraph(note, "note") for note in run.summary.get("notes", []))
    return Section("Results", page.table(["what", "value"], plain) + notes)


def _leg_sections(run: Run) -> list[Section]:
    leg = run.summary.get("leg")
    if not leg:
        return []
    sizes = [(name.replace("_", " "), leg[name]) for name in leg if name not in ("errors", "bend")]
    errors = [(name.replace("_", " "), value) for name, value in leg["errors"].items()]
    body = page.table(["the reduced leg", ""], [*sizes, *errors])
    if leg["bend"]:
        bend = leg["bend"]
        figure = bend_figure(bend["pressure_kPa"], bend["full_deg"], bend["reduced_deg"])
        caption = "Bend of the leg held at its root, by finite elements and reduced."
        body = page.side_by_side(page.drawn(figure, caption), body)
    return [Section("How well the reduced leg stands for its finite elements", body)]


def _settings_section(run: Run) -> Section:
    verb = run.summary["verb"]
    lines = [f"pneumorph {verb} --settings {run.folder}/settings.json --out runs/again"]
    if verb == "coopt":
        lines.append(f"pneumorph evaluate {run.folder} --model full --pair-count 1")
    body = (
        page.command_lines(lines)
        + page.paragraph(
            f"pneumorph {__version__}, Python {platform.python_version()}, {platform.machine()}.",
            "note",
        )
        + page.folded("All settings", dict(run.settings))
    )
    return Section("How to repeat it", body)


def _centimetres(distance: float | None) -> str:
    return "failed" if distance is None else f"{distance:.1f} cm"
