"""Running CalculiX, and reading the displacements that it prints."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True, eq=False)
class CalculixResult:
    """What a run of a deck gave."""

    displacements: list[np.ndarray]
    """After each step that was reached [mm], (node, 3)."""
    iterations: int
    """Linear solves in all."""
    wall_s: float
    """Time of the run, reading the deck included [s]."""
    message: str
    """The first error that it reported; empty after a run without."""


def calculix_command() -> str | None:
    """Path of CalculiX's solver, None where it is not installed."""
    return shutil.which("ccx")


def run_calculix(deck: str, node_count: int, time_limit_s: float = 3600.0) -> CalculixResult:
    """Run a deck on one core, in a folder of its own that is removed afterwards.

    Args:
        deck: Its text; each step prints U of all nodes.
        node_count: Number of nodes of the deck.
        time_limit_s: When to end a run that has not ended; its finished steps count [s].

    Raises:
        FileNotFoundError: CalculiX is not installed.
        ValueError: A step's displacements are not those of all nodes.
    """
    command = calculix_command()
    if command is None:
        raise FileNotFoundError("no ccx in the PATH; on Debian: apt install calculix-ccx")
    one_core = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "part.inp").write_text(deck)
        log = Path(folder, "part.log")
        start, stopped = time.perf_counter(), ""
        with log.open("w") as stream:
            try:
                subprocess.run(
                    [command, "-i", "part"],
                    cwd=folder,
                    env=os.environ | one_core,
                    stdout=stream,
                    stderr=subprocess.STDOUT,
                    timeout=time_limit_s,
                    check=False,
                )
            except subprocess.TimeoutExpired:
                stopped = f"no end after {time_limit_s:g} s"
        wall = time.perf_counter() - start
        said = log.read_text(errors="replace")
        printed = Path(folder, "part.dat")
        blocks = read_displacements(printed.read_text() if printed.exists() else "", node_count)
    error = re.search(r"\*ERROR.*", said)
    return CalculixResult(
        displacements=blocks,
        iterations=len(re.findall(r"^ iteration ", said, re.MULTILINE)),
        wall_s=wall,
        message=stopped or (error.group().strip() if error else ""),
    )


def read_displacements(printed: str, node_count: int) -> list[np.ndarray]:
    """Displacements of every step in the text of a .dat file [mm], each (node, 3).

    Args:
        printed: Blocks with a heading that says ``displacements``, then lines of node and vector.
            A last block that was cut short, by the end of a run that took too long, is left out.
        node_count: Number of nodes.

    Raises:
        ValueError: A whole block does not hold all nodes in order.
    """
    blocks = re.split(r"^ displacements.*$", printed, flags=re.MULTILINE)[1:]
    result = []
    for step, block in enumerate(blocks, start=1):
        lines = [line.split() for line in block.splitlines() if line.strip()]
        if step == len(blocks) and (len(lines) < node_count or len(lines[-1]) < 4):
            break
        rows = np.array(lines, dtype=float)
        if not np.array_equal(rows[:, 0], np.arange(1, node_count + 1)):
            raise ValueError(
                f"step {step} must print nodes 1 .. {node_count}, got {len(rows)} lines that begin "
                f"with node {rows[0, 0]:g}; is the file another deck's?"
            )
        result.append(rows[:, 1:])
    return result
