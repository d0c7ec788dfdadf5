"""No result depends on how a processor rounds: the tests that could know it pass on others.

BLAS, NumPy, XLA and the engine each choose their instructions when they are loaded, so these tests
run again in a process of its own that is told to choose those of another processor.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

TESTS = Path(__file__).parent
SENSITIVE = (
    # decompositions, whose vectors have any sign, and choices among nearly equal elements
    "reduction/test_pod.py",
    "reduction/test_incremental_pod.py",
    "reduction/test_ecsw.py",
    "reduction/test_sparse_nnls.py",
    "reduction/test_sampled_elements.py",
    "reduction/test_reduce.py",
    "report/replay/test_leg_modes.py",
    # contact, where a little more force is a slip
    "simulation",
    "fem/test_friction_problem.py",
    # a search, whose path is any after some steps
    "learn/test_search_run.py::test_cma_finds_the_best_gait_of_each_design",
)


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names processors of another kind")
def test_results_hold_on_an_older_processor() -> None:
    dispatched = np._core._multiarray_umath.__cpu_dispatch__
    environment = {
        **os.environ,
        "PYTHONPATH": str(TESTS),
        "OPENBLAS_CORETYPE": "Prescott",
        "OPENBLAS_NUM_THREADS": "1",
        "NPY_DISABLE_CPU_FEATURES": " ".join(dispatched),
        "XLA_FLAGS": "--xla_cpu_max_isa=SSE4_2",
    }
    chosen = [str(TESTS / each) for each in SENSITIVE]
    # Robots on Ray's workers are compared with robots here: both round alike on any processor.
    alike = f"--ignore={TESTS / 'simulation/test_shared_simulator.py'}"
    program = [sys.executable, "-m", "pytest", "-q", "-p", "helpers.older_stepper", alike, *chosen]
    done = subprocess.run(program, env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]
