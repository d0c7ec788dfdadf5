"""The machine that this process runs on."""

from __future__ import annotations

import os
import platform
from pathlib import Path


def processor_count() -> int:
    """How many processors this process may use, where the system can say so, or has."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def describe_machine() -> str:
    """Return system, processor and how many processors this process may use, on a line."""
    parts = [f"{platform.system()} {platform.machine()}", _processor_name()]
    return ", ".join([*filter(None, parts), f"{processor_count()} processors"])


def _processor_name() -> str:
    """Return the processor's name; empty where the system does not tell."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()
