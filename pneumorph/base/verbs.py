"""The verbs of the command line, by which runs are told apart."""

from __future__ import annotations

VERBS = {
    "mesh": "shape of a part, or a mesh file  ->  mesh with named regions",
    "reduce": "mesh and material  ->  reduced part with its measured error",
    "catalogue": "parametric legs by name  ->  each reduced once, for robots to take",
    "compare": "reduced beside full  ->  node errors, bend, time ratio",
    "simulate": "design and gait  ->  trajectory, film",
    "baseline": "the expert's gait  ->  distance at each phase",
    "coopt": "design space and task  ->  design and gait learned together",
    "campaign": "many coopt runs: seeds and settings  ->  how they compare",
    "search": "designs and gaits, without a policy  ->  how good the learned ones are",
    "evaluate": "learned pairs, simulated again  ->  distances, reduced or full",
    "certify": "learned pairs, unseen worlds  ->  bands of distances, what to measure next",
    "analyse": "learned pairs  ->  rewards of each step, tilt, load and friction of each leg",
    "calibrate": "measured bends, trials  ->  calibration file",
    "deploy": "gait or policy  ->  timed commands to a rig, logs of its trials",
    "transfer": "logs and tracks beside the simulation  ->  distances, transfer ratio, figures",
    "fabricate": "design  ->  moulds, hub, parts list, drawing",
    "exchange": "gaits and reductions  <->  files of sorotraj and SOFA",
    "watch": "training, finished or not  ->  live page in the browser",
    "replay": "trajectories and trials  ->  3D replay as one page, film",
    "report": "any run folder  ->  one self-contained page",
    "explore": "design space, scores  ->  one page over all designs",
    "bench": "how fast robots are simulated on this machine",
    "demo": "baseline, coopt and report in one go",
}
"""What each takes and makes."""
