"""Reduce a leg: collect snapshots of the full model, choose modes and elements, measure the error.

Snapshots are free bending, equilibria under random contact forces, and legs that carry walking
robots. They are kept in RUN/snapshots: the same command with the same --out goes on where it
stopped, and other tolerances reuse them. Modes live in the frame of the hub (POD), elements are
sampled by ECSW.

Presets: paper (what made the leg that ships), hyperelastic (the silicone's own stiffness), measured
(the silicone's tension test, relaxing; as --physics measured has it), quick (equilibria alone),
corners: the paper's protocol and tolerances, all 255 robots through every corner of their
pressures. That is days of one processor; each robot is a task, and --snapshots.executor shares them
out over processes or, with Ray, machines. learned: equilibria and the robots of --walked.gaits,
with more modes and elements: a leg to walk what was learned once more.

Writes leg.npz, which every other verb takes as --part.

Example: pneumorph reduce --mesh runs/tall-leg/mesh.npz --out runs/tall-leg-reduced
"""

from __future__ import annotations

from pneumorph.command.verb import Verb
from pneumorph.study.reduction_options import PRESETS, ReduceOptions, reduce_as_asked

VERB = Verb(ReduceOptions, reduce_as_asked, PRESETS)
