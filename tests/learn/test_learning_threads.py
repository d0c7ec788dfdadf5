"""Networks learn the same bits on any number of processors."""

import os
import subprocess
import sys

_PROGRAM = """
import os, hashlib
processors = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
if os.environ["ONE"] == "1" and processors:
    os.sched_setaffinity(0, processors[:1])
from pneumorph.learn.sac import Batch, Sac
from pneumorph.learn.settings import quick_settings
import numpy as np
settings = quick_settings().sac
sac = Sac(60, 3, settings)
draw = np.random.default_rng(0)
def random(*shape):
    return draw.standard_normal((4, settings.batch_size, *shape)).astype("float32")
batch = Batch(random(60), np.tanh(random(3)), random(), random(60), 0.0 * random())
state, _ = sac.update(sac.initial_state(0), batch)
print(hashlib.sha256(b"".join(each.tobytes() for each in state.arrays().values())).hexdigest())
"""


def learned(**environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.strip()


def test_networks_learn_the_same_bits_on_one_processor_as_on_many() -> None:
    """XLA's pool of threads is of one size, whatever processors there are or are asked for."""
    assert learned(ONE="1", NPROC="1") == learned(ONE="0", NPROC="4")
