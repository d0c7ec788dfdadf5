"""Learn a design and its gait together, and compare them with the expert's.

First the expert's gait walks at every phase. Then one design-conditioned policy and a distribution
over designs are trained together, as in the paper. The best pairs are open-loop gaits that anyone
can replay. A stopped run goes on from its last checkpoint with --resume and the same --out.

Presets: quick (minutes on two cores: three or four legs, many updates an action, mirror images),
paper (one million timesteps, all designs, then fine-tuning of the eight best) and fast (all
designs in 21 % of that). All use the published damping; see --physics.damping. With --randomize
every round is walked in worlds drawn from --randomisation. With --objective.worlds-per-design 4 as
well every design walks in four, and designs, finalists and gaits are ranked by --objective.kind
over them, with what drawn worlds leave open as score_standard_error_cm in the metrics; otherwise a
pair's distance is that of the world it was seen in. Both are on in --physics measured, in worlds of
all that nobody has measured of the robot, where a training ends with a certificate as well
(--certified-world-count; see `pneumorph certify`). With --certify its pairs walk as finite elements
too, and where the two models part the leg is reduced again and the pairs are fine-tuned on it:
hours, within --rounds.limit and --rounds.budget-s.

Writes best_trajectory.npz, baseline_trajectory.npz, phase_sweep.npz and, in training/,
metrics.jsonl, TensorBoard logs, checkpoints, policy.npz, a policy for each fine-tuned design, and
gaits/L1.csv, L2.csv ... With --certify, certificate/ as `pneumorph certify --full` does.

Example: pneumorph coopt --preset quick --seed 1 --out runs/quick-1
"""

from __future__ import annotations

from pneumorph.command.verb import Verb
from pneumorph.learn.settings import fast_settings, paper_settings, quick_settings
from pneumorph.study.training_options import TrainingOptions, train_as_asked

VERB = Verb(
    TrainingOptions,
    train_as_asked,
    {
        "quick": lambda: TrainingOptions(coopt=quick_settings()),
        "fast": lambda: TrainingOptions(coopt=fast_settings()),
        "paper": lambda: TrainingOptions(coopt=paper_settings()),
    },
)
