"""Learn a design and its gait together, and compare them with the expert's.

First the expert's gait walks at every phase. Then one design-conditioned policy and a distribution
over designs are trained together, as in the paper. The best pairs are open-loop gaits that anyone
can replay. A stopped run goes on from its last checkpoint with --resume and the same --out.

Presets: quick (minutes on two cores: three or four legs, many updates an action, mirror images),
paper (the paper's schedule: one million timesteps, all designs, then fine-tuning of the eight
best; with --physics published its experiment) and fast (all designs in 21 % of that).

The robots are as their materials were measured, and every round is walked in worlds drawn from all
that nobody has measured of them (--randomize, --randomisation): every design walks in four
(--objective.worlds-per-design), and designs, finalists and gaits are ranked by --objective.kind
over them, with what drawn worlds leave open as score_standard_error_cm in the metrics. At the end
the best pairs are certified in worlds that training never saw (--certified-world-count; see
`pneumorph certify`). With --certify they walk as finite elements too, and where the two models part
the leg is reduced again and the pairs are fine-tuned on it: hours, within --rounds.limit and
--rounds.budget-s. --physics published trains as the paper did, in one world, whose distance is then
a pair's, without a certificate.

Writes best_trajectory.npz, baseline_trajectory.npz, phase_sweep.npz and, in training/,
metrics.jsonl, TensorBoard logs, checkpoints, policy.npz, a policy for each fine-tuned design, and
gaits/L1.csv, L2.csv ... With --certify, certificate/ as `pneumorph certify --full` does.

Example: pneumorph coopt --preset quick --seed 1 --out runs/quick-1
"""

from __future__ import annotations

from pneumorph.command.verb import Verb
from pneumorph.study.training_options import PRESETS, TrainingOptions, train_as_asked

VERB = Verb(TrainingOptions, train_as_asked, PRESETS)
