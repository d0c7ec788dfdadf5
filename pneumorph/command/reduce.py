"""Reduce a leg: collect snapshots of the full model, choose modes and elements, measure the error.

Snapshots are free bending, equilibria under random contact forces, and the legs of walking robots.
They are kept in RUN/snapshots: the same command with the same --out resumes, and other tolerances
reuse them. Modes are in the frame of the hub (POD); elements are sampled by ECSW.

Presets: measured (the silicone's tension test, with relaxation, as in --physics measured; made the
leg that ships); quick (the same from fewer equilibria and one short walk, in minutes); paper (the
published leg); paper_quick (that from equilibria alone); hyperelastic (the silicone's own stiffness
without relaxation); learned (the published leg from equilibria and the robots of --walked.gaits,
with more modes and elements: for testing learned gaits again); corners (the paper's protocol and
tolerances: all 255 robots through every corner of their pressures, which takes days on one
processor; --snapshots.executor distributes the robots over processes or, with Ray, machines).

Writes leg.npz, which every verb that simulates robots takes as --part.

Example: pneumorph reduce --preset quick --mesh runs/tall-leg/mesh.npz --out runs/tall-leg-reduced
"""

from __future__ import annotations

from pneumorph.command.verb import Verb
from pneumorph.study.reduction_options import PRESETS, ReduceOptions, reduce_as_asked

VERB = Verb(ReduceOptions, reduce_as_asked, PRESETS)
