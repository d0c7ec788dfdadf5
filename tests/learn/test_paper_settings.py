"""Every number of the published experiment is a field, and the preset ``paper`` has it.

Left: where the number is published. Table I and II are those of the paper's appendix A; "leaves
out" is what the authors' experiment has and the paper's text does not tell.
"""

import math

import pytest

from pneumorph.catalogue.paper_robot import DISK_MASS_KG, DISK_MATERIAL
from pneumorph.fem.material import LegMaterials
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.learn.settings import paper_settings
from pneumorph.physics.physics import Physics

PAPER = paper_settings()
PHYSICS = Physics()


@pytest.mark.parametrize(
    ("where", "found", "published"),
    [
        ("table I: environments", PAPER.environment_count, 96),
        ("table I: maximum timesteps", PAPER.total_timesteps, 1_000_000),
        ("table I: buffer size", PAPER.buffer_size, 100_000),
        ("table I: batch size", PAPER.sac.batch_size, 512),
        ("table I: discount", PAPER.sac.discount, 0.95),
        ("table I: policy learning rate", PAPER.sac.policy_learning_rate, 0.0006),
        ("table I: Q-function learning rate", PAPER.sac.critic_learning_rate, 0.0020),
        ("table I: Adam beta 1", PAPER.sac.adam_beta_1, 0.9),
        ("table I: Adam beta 2", PAPER.sac.adam_beta_2, 0.999),
        ("table I: target smoothing", PAPER.sac.target_smoothing, 0.01),
        ("table I: learning start", PAPER.learning_start_timestep, 10_000),
        ("table I: timesteps per SAC update", PAPER.updates, 1),
        ("table I: timesteps per sampled design", PAPER.task.action_count, 20),
        ("table I: entropy decay start", PAPER.schedule.decay_start_timestep, 200_000),
        ("table I: entropy decay end", PAPER.schedule.decay_end_timestep, 950_000),
        ("table I: entropy target start", PAPER.schedule.target(0, 6972), math.log(6972)),
        ("table I: entropy target end", PAPER.schedule.final_entropy, 0.0),
        ("appendix A: hidden layers", PAPER.sac.hidden_sizes, (400, 200, 100)),
        ("section III-B: designs", len(PAPER.space), 6972),
        ("section III-B: locations", PAPER.space.location_count, 8),
        ("section III-B: regulators", PAPER.task.regulator_count, 3),
        ("section III-B: remembered actions", PAPER.task.remembered_action_count, 4),
        ("section IV: highest pressure", PAPER.task.maximum_pressure_kPa, 90.0),
        ("leaves out: one update for each vector step", PAPER.updates_per_vector_step, 1),
        ("leaves out: initial alpha", PAPER.sac.initial_temperature, 0.2),
        ("leaves out: alpha's rate is the policy's", PAPER.sac.temperature_learning_rate, None),
        ("leaves out: target entropy -3", PAPER.sac.target_entropy, None),
        ("leaves out: log-std", PAPER.sac.log_standard_deviation_range, (-20.0, 2.0)),
        ("leaves out: time limit is terminal", PAPER.task.time_limit_is_terminal, True),
        ("leaves out: steps of an action", PAPER.task.action_step_count, 100),
        ("leaves out: settling steps", PAPER.task.settling_step_count, 15),
        ("leaves out: first score", PAPER.schedule.initial_score_cm, 0.0),
        ("leaves out: highest beta", PAPER.schedule.maximum_inverse_temperature, 20.0),
        ("leaves out: entropy tolerance", PAPER.schedule.entropy_tolerance, 0.01),
        ("no mirror images", PAPER.mirror_transitions, False),
        ("table II: silicone", LegMaterials().silicone.young_modulus_kPa, 1160.0),
        ("table II: silicone", LegMaterials().silicone.poisson_ratio, 0.2),
        ("table II: sheet", LegMaterials().sheet.young_modulus_kPa, 2320.0),
        ("table II: sheet", LegMaterials().sheet.poisson_ratio, 0.49),
        ("table II: disk", DISK_MATERIAL.young_modulus_kPa, 5000.0),
        ("table II: disk", DISK_MATERIAL.poisson_ratio, 0.3),
        ("table II: leg's mass", LegMaterials().mass_kg, 0.105),
        ("table II: disk's mass", DISK_MASS_KG, 0.075),
        ("table II: friction", PHYSICS.friction, 1.2),
        ("table II: gravity", PHYSICS.gravity_mm_per_s2, 9800.0),
        ("leaves out: time step", PHYSICS.time_step_s, 0.01),
        ("leaves out: Rayleigh mass", PHYSICS.mass_damping_per_s, 0.1),
        ("leaves out: Rayleigh stiffness", PHYSICS.stiffness_damping_s, 0.1),
        ("leaves out: regulators' rate", PHYSICS.pressure_rate_kPa_per_s, 150.0),
        ("leaves out: slope of the pressure map", PHYSICS.pressure_map.slope, 4.0785),
        ("leaves out: its intercept", PHYSICS.pressure_map.intercept_kPa, -20.361),
        ("section IV: amplitude", ExpertGait().amplitude_kPa, 45.0),
        ("section IV: period", ExpertGait().period_s, 4.0),
        ("leaves out: command interval", ExpertGait().command_interval_s, 0.33),
        ("section IV: phases", PhaseSweepSettings().phases_deg, tuple(range(0, 181, 10))),
    ],
)  # fmt: skip
def test_number_is_the_published_one(where: str, found: object, published: object) -> None:
    assert found == published, where
