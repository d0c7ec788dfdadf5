"""Whether numbers by which an array names things are those of something."""

from __future__ import annotations

import numpy as np


def check_within(name: str, numbers: np.ndarray, count: int, what: str) -> None:
    """Refuse numbers that are none of 0 to `count` - 1.

    Args:
        name: What the message calls them.
        numbers: Any shape.
        count: How many there are of what they name.
        what: What they name.

    Raises:
        ValueError: One is beyond, or they are not whole.
    """
    if numbers.size == 0:
        return
    if numbers.dtype.kind not in "iu":
        raise ValueError(f"{name} has numbers of type {numbers.dtype}, expected whole ones")
    beyond = numbers[(numbers < 0) | (numbers >= count)]
    if len(beyond) > 0:
        raise ValueError(f"{name} has {beyond[0]}, expected 0 to {count - 1}: one of its {what}")
