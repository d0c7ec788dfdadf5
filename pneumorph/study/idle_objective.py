"""What of an objective changes nothing, because designs walk in one world each or it is of another
kind."""

from __future__ import annotations

from pneumorph.learn.objective import Objective


def idle_of_objective(objective: Objective) -> dict[str, str]:
    """Settings of an objective that change nothing beside its others, as
    `pneumorph.base.idle_settings` has them."""
    if not objective.is_robust:
        names = ("kind", "deviations", "share", "evaluation_worlds", "nominal_until_timestep")
        why = "where designs walk in one world (--objective.worlds-per-design 1)"
        return dict.fromkeys(names, why)
    of_kinds = {"deviations": "mean_minus_deviations", "share": "worst_share"}
    return {
        name: f"without --objective.kind {kind}"
        for name, kind in of_kinds.items()
        if objective.kind != kind
    }
