"""Design and gait learned together, and searches that learn nothing, to compare with.

XLA sums in an order that depends on how many threads its pool has: as many as NPROC says, or else
as there are processors that the process may use. It is told one number everywhere, before its first
use, so that a seed leads to the same robot on one processor as on many.
"""

import os

os.environ["NPROC"] = "2"
