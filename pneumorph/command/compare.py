"""Compare reduced robots with the finite elements that they stand for.

Three comparisons: the four test animations of the paper's appendix B; the same without gravity or
floor, which separates errors of shape from the effect of friction; and held-out robots, random
designs under random gaits that no snapshot came from, and under periodic gaits of 20 s, where
errors accumulate (--periodic-count, 0 of another robot). A single leg is also bent.
Full-order trajectories take minutes each: they are kept in RUN/full_order, those that ship with the
package are found there, and an interrupted one is resumed.

Trajectories of the default preset ship in both physics, eight periodic ones in the measured
physics alone; others, and those of other lengths, take hours.

With --grid, further reductions of the leg walk the four animations too: their errors against the
time of a step are figure 12 of the paper.

Presets: default (10 s), paper (16 s) and quick (1 s of two animations).

Writes bend.csv and figures, and the reduced trajectories with --record.

Example: pneumorph compare --preset default --json
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import laid_over
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.command.verb import Verb, flat
from pneumorph.report.comparison_figures import draw_comparison
from pneumorph.study.comparison import Comparison, ComparisonSettings, compare, is_usual_robot

_SHIPPED_PERIODIC = 8
"""Periodic walks that ship, of the measured physics."""


@dataclass(frozen=True)
class CompareOptions:
    """What to compare, of which robot."""

    comparison: Annotated[ComparisonSettings, flat] = field(default_factory=ComparisonSettings)
    robot: Annotated[RobotOptions, flat] = field(default_factory=RobotOptions)

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """No periodic walks where another robot is asked for, whose finite elements have walked
        none, but if these are asked for with it or later."""
        if below["comparison"]["periodic_count"] != _SHIPPED_PERIODIC:
            return {}
        robot = laid_over(below["robot"], content.get("robot", {}))
        changed = is_usual_robot(below["robot"]) and not is_usual_robot(robot)
        return {"comparison": {"periodic_count": 0}} if changed else {}


def run(options: CompareOptions, folder: RunFolder) -> Comparison:
    """Compare, and draw the figures."""
    found = compare(options.comparison, options.robot.spec(), folder)
    draw_comparison(found, folder)
    return found


VERB = Verb(
    CompareOptions,
    run,
    {
        "default": lambda: CompareOptions(ComparisonSettings(periodic_count=_SHIPPED_PERIODIC)),
        "paper": lambda: CompareOptions(ComparisonSettings(duration_s=16.0)),
        "quick": lambda: CompareOptions(
            ComparisonSettings(
                animations=("baseline", "two_leg"),
                heldout_count=0,
                duration_s=1.0,
                floating_duration_s=0.5,
                timed_steps=3,
            )
        ),
    },
)
