"""The status of a study of many robots."""

from __future__ import annotations

NONE_SURVIVED = "no robot survived"


def status_of(best: object) -> str:
    """``completed``, or that no robot came to the end of its walk.

    Args:
        best: What is known of the best; None where there is none.
    """
    return NONE_SURVIVED if best is None else "completed"
