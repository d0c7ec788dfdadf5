// One implicit step of one robot: parts eliminated onto the hub, contact solved, everything moved on. Equations (8), (23),
// (24), (33), (34) and (41) of docs/physics.md; pneumorph/simulation/reference_step.py is the same step in dense NumPy.
//
// Compiled once per instruction set (PNEUMORPH_INSTRUCTION_SET names the copy). The system is a block
// arrow: modal blocks D_k of the mounted parts, and a hub block of six unknowns.
#include "add_part.hpp"
#include "contact_solve.hpp"
#include "mode_counts.hpp"
#include "regulators.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Regulators move towards the command; their real pressure becomes the simulated one.
template <int M, class Real>
void regulate(const RobotModel& robot, const Settings& settings, const double* command, RobotState& state,
              Workspace<M, Real>& work) {
  for (int i = 0; i < settings.regulator_count; ++i) {
    state.regulated[i] = regulated_after(settings, robot, i, state.regulated[i], command[i]);
    work.pressure[i] = std::fmax(0.0, settings.pressure_slope * state.regulated[i] + settings.pressure_intercept);
  }
}

// The hub's own mass and weight, along its own axes.
inline void begin_hub(const RobotModel& robot, const Settings& settings, const RobotState& state, HubSystem& hub) {
  const double h = settings.time_step;
  multiply_transposed(state.rotation, state.velocity, hub.velocity);
  multiply_transposed(state.rotation, state.angular_velocity, hub.velocity + 3);
  multiply_transposed(state.rotation, settings.gravity, hub.gravity);
  const double mass_scale = 1.0 + settings.mass_damping * h;
  const double* first = robot.hub_first_moment;
  double mass[36];
  rigid_mass(robot.hub_mass, first, robot.hub_second_moment, mass);
  double torque[3];
  cross(first, hub.gravity, torque);
  for (int i = 0; i < 6; ++i) {
    hub.right[i] = h * (i < 3 ? robot.hub_mass * hub.gravity[i] : torque[i - 3]);
    for (int j = 0; j < 6; ++j) {
      hub.right[i] += mass[6 * i + j] * hub.velocity[j];
      hub.matrix[6 * i + j] = mass_scale * mass[6 * i + j];
    }
  }
  add_rigid_velocity_products(hub.velocity + 3, first, robot.hub_second_moment, h, hub.right);
}

// Factors the hub's system and finds its motion if nothing touched.
inline bool solve_hub(HubSystem& hub) {
  if (!inverse_cholesky_6(hub.matrix, hub.factor)) return false;
  double reduced_right[8];  // padded like a row of responses
  times_hub_factor(hub.right, hub.factor, reduced_right);
  for (int i = 0; i < 6; ++i) {
    hub.free_velocity[i] = 0;
    for (int j = i; j < 6; ++j) hub.free_velocity[i] += hub.factor[6 * j + i] * reduced_right[j];
  }
  return true;
}

template <int M, class Real>
void move_on(const RobotModel& robot, const Settings& settings, RobotState& state, const Workspace<M, Real>& work) {
  const double h = settings.time_step;
  for (int k = 0; k < robot.mount_count; ++k)
    for (int v = 0; v < M; v += 8) {
      const DoubleLanes rate = load(&work.rates[k][v]);
      double* alpha = state.modes + k * M + v;
      store(state.mode_rates + k * M + v, rate);
      store(alpha, load(alpha) + h * rate);
    }
  const double* velocity = work.hub.next_velocity;
  double spatial[3], turn[3];
  multiply(state.rotation, velocity, spatial);
  multiply(state.rotation, velocity + 3, turn);
  for (int i = 0; i < 3; ++i) {
    state.velocity[i] = spatial[i];
    state.angular_velocity[i] = turn[i];
    state.position[i] += h * spatial[i];
    turn[i] *= h;
  }
  rotate_by(turn, state.rotation);
}

// Solves the friction of the points that were pressed or come near, looks which others would pass the floor, and
// solves again with them until none does. Returns the number of points solved for, or -1 if the motion is not sound.
template <int M, class Real>
int solve_contacts(const Part<Real>* parts, const RobotModel& robot, const Settings& settings, const RobotState& state,
                   int candidate_count, Workspace<M, Real>& work, FrictionReport& report, Clock& clock) {
  Candidate* candidates = work.candidates(robot);
  int row_count = 0;
  for (int c = 0; c < candidate_count; ++c) {
    Candidate& at = candidates[c];
    const int contact = at.mount < 0 ? at.point : robot.mounts[at.mount].contact_offset + at.point;
    if (!(at.lowest < kNearGap || state.impulses[3 * contact] > 0)) continue;
    at.working = true;
    make_row(at, parts, robot, settings, state, work, work.rows[row_count++]);
  }
  clock.lap(3);
  const double allowed = settings.contact_tolerance * settings.time_step;
  for (int pass = 0;; ++pass) {
    solve_friction(settings, row_count, work, report);
    sum_impulses(row_count, work);
    const bool sound = find_velocities(parts, robot, settings, work);
    clock.lap(4);
    if (!sound) return -1;
    candidate_count = take_thrown_points(parts, robot, settings, state, work, candidates, candidate_count);
    const int before = row_count;
    for (int c = 0; c < candidate_count; ++c) {
      Candidate& at = candidates[c];
      if (at.working) continue;
      const double gap = next_gap(at, parts, robot, settings, state, work) +
                         flexible_lift(at, parts, robot, settings, work.rows, before);
      if (gap >= -allowed) continue;
      if (pass == kContactPasses) {
        report.residual = std::fmax(report.residual, -gap / settings.time_step);
        continue;
      }
      at.working = true;
      make_row(at, parts, robot, settings, state, work, work.rows[row_count++]);
    }
    clock.lap(3);
    if (row_count == before) return row_count;
  }
}

// The contacts of a robot on a plane; the points solved for, or -1 if the motion is not sound.
template <int M, class Real>
int level_contacts(const Part<Real>* parts, const RobotModel& robot, const Settings& settings, const RobotState& state,
                   Workspace<M, Real>& work, FrictionReport& report, double& deepest, Clock& clock) {
  Candidate* candidates = work.candidates(robot);
  int candidate_count = find_hub_candidates(robot, settings, state, work.hub, candidates, 0, deepest);
  for (int k = 0; k < robot.mount_count; ++k) {
    view_mount<M>(robot, k, state, work.hub, work.mounts[k].leg, work.views[k]);
    note_pressed(parts[robot.mounts[k].part], robot.mounts[k], state, work.views[k]);
    candidate_count = find_part_candidates<M, Real>(parts[robot.mounts[k].part], robot, k, settings, state, work.hub,
                                                    work.views[k], candidates, candidate_count, deepest);
  }
  return solve_contacts(parts, robot, settings, state, candidate_count, work, report, clock);
}

template <int M, class Real>
Status step_robot(const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                const double* command, RobotState& state, Workspace<M, Real>& work, StageSeconds* stages) {
  Clock clock(stages);
  regulate(robot, settings, command, state, work);
  begin_hub(robot, settings, state, work.hub);
  PNEUMORPH_BEGIN_NAME(M, parts, robot, settings, state, &work);
  for (int k = 0; k < robot.mount_count; ++k)
    if (!(parts[robot.mounts[k].part].is_rubber()
              ? PNEUMORPH_RUBBER_NAME(M, parts, robot, k, settings, state, &work, &clock)
              : add_part(parts, robot, k, settings, state, work, clock)))
      return kSingular;
  state.has_memory = true;
  if (!solve_hub(work.hub)) return kSingular;
  clock.lap(2);

  double deepest = 0;
  FrictionReport report;
  int row_count;
  if (robot.ground)
    row_count = PNEUMORPH_UNEVEN_NAME(M, parts, robot, settings, state, &work, &clock, report, deepest);
  else
    row_count = level_contacts(parts, robot, settings, state, work, report, deepest, clock);
  if (row_count < 0) return kDiverged;

  move_on(robot, settings, state, work);
  for (int i = 0; i < 3 * robot.contact_count; ++i) state.impulses[i] = 0;
  for (int c = 0; c < row_count; ++c)
    for (int i = 0; i < 3; ++i) state.impulses[3 * work.rows[c].contact + i] = work.rows[c].impulse[i];
  state.active_contacts = row_count;
  state.sweeps = report.sweeps;
  state.newton_steps = report.newton_steps;
  state.contact_residual = report.residual;
  state.step_count += 1;
  state.contact_total += row_count;
  state.sweep_total += report.sweeps;
  state.newton_total += report.newton_steps;
  state.unconverged_total += report.residual > settings.contact_tolerance;
  state.worst_residual = std::fmax(state.worst_residual, report.residual);
  state.worst_penetration = std::fmax(state.worst_penetration, deepest);
  clock.lap(5);
  return kRunning;
}

template <int M, class Real>
void advance(const void* parts, const RobotModel& robot, const Settings& settings, const double* command,
             long long steps, RobotState& state, void* workspace, StageSeconds* stages) {
  auto& work = *static_cast<Workspace<M, Real>*>(workspace);
  work.mounts = static_cast<MountMemory<M, Real>*>(state.memory);
  work.place_friction(robot);
  for (long long step = 0; step < steps && state.status == kRunning; ++step)
    state.status =
        step_robot<M, Real>(static_cast<const Part<Real>*>(parts), robot, settings, command, state, work, stages);
}

template <int M, class Real>
Kernel kernel_for(int contact_capacity) {
  Kernel kernel;
  kernel.advance = &advance<M, Real>;
  kernel.mount_bytes = sizeof(MountMemory<M, Real>);
  kernel.workspace_bytes = sizeof(Workspace<M, Real>) + (sizeof(ContactRow<M>) + sizeof(UnevenCandidate)) * (unsigned long)(contact_capacity) +
                           64 + FrictionProblem().place(nullptr, kNewtonPoints);
  return kernel;
}

Kernel kernel(int modes, int single_precision, int contact_capacity) {
  return with_modes(modes, [&](auto count) {
    constexpr int M = decltype(count)::value;
    return single_precision ? kernel_for<M, float>(contact_capacity) : kernel_for<M, double>(contact_capacity);
  });
}

}  // namespace PNEUMORPH_INSTRUCTION_SET

Kernel PNEUMORPH_KERNEL_NAME(int modes, int single_precision, int contact_capacity) {
  return PNEUMORPH_INSTRUCTION_SET::kernel(modes, single_precision, contact_capacity);
}

}  // namespace pneumorph
