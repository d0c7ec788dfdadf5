// A part of measured silicone in a step, whose solid may have the stiffness of an earlier one: equations (25) and (26) of
// docs/physics.md under objective damping, as kept_tangent.hpp takes them.
//
// The sheet and the changes of volume are far stiffer than the solid, along directions that turn as the leg bends: a stale
// stiffness of theirs resists the motion itself within a few steps. Theirs is found in every step, and the solid's alone,
// the most work by far, is kept. It is that of the rate of Green's strain in Hooke's law (10), stiffened by what the
// branches resist, so what it makes of velocities u is the work of the stress rate
//   P' = mu F (2 E' + lambda / mu tr(E') I),   E' = sym(F^T F'),   F' = sum_a G_a u_a.
// No turn of the hub changes it.
//
// Where a part moves smoothly, its forces may be found where its rates lead in the step, alpha + h w with w the mean of the last
// two steps' rates, in place of where the step starts: f(alpha + h w) - h K (u' - w) for f(alpha) - h K u'. What K lacks then
// acts on the small change u' - w alone, so the step is nearly the converged implicit one at the same price; `Ahead` below. In
// the mean an oscillation from step to step cancels. Equation (46).
//
// What is stiff, and then the solid beside kept stiffnesses, is found of all legs of one part before any leg is added to the
// robot: a leg's numbers are more than the second-level cache holds, and legs that take turns over each stretch of them read it
// once.
#pragma once
#include "facing_walls.hpp"
#include "mixed_energies.hpp"
#include "rubber.hpp"
#include "workspace.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Stress rate over mu of a gradient's rate, with the shear modulus `stiffer` times what it is.
template <class Real, class V>
PNEUMORPH_INLINE void objective_rate(const V f[9], const V change[9], Real ratio, Real stiffer, V rate[9]) {
  V strain[3][3], trace = V{};
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b) {
      V sum = V{};
      for (int k = 0; k < 3; ++k) sum += f[k * 3 + a] * change[k * 3 + b] + f[k * 3 + b] * change[k * 3 + a];
      strain[a][b] = strain[b][a] = stiffer * sum;  // 2 E'
      if (a == b) trace += sum;
    }
  for (int a = 0; a < 3; ++a) strain[a][a] += (Real(0.5) * ratio) * trace;
  for (int k = 0; k < 3; ++k)
    for (int b = 0; b < 3; ++b)
      rate[k * 3 + b] = f[k * 3] * strain[0][b] + f[k * 3 + 1] * strain[1][b] + f[k * 3 + 2] * strain[2][b];
}

// Work of the solid's stress on every mode, lanes over elements, and of the stress rate of modal speeds, of one block of
// elements; takes the springs to the step's end. With `Ahead` the stresses are those after a time `ahead` of these speeds.
template <int M, bool Ahead, class Law, class Real>
PNEUMORPH_INLINE void solid_block(const ElementFamily<Real>& family, const Law& law, const StepBranches<Real>& branches,
                                  int number, Real ahead, RubberSystem<M, Real>& leg) {
  using L = RegisterLanes<Real>;
  using V = typename L::type;
  // Rows of the gradient and of its rate that the registers hold beside what is read.
  constexpr int kRows = kRegisterBytes == 64 ? 9 : 5;
  for (int lane = 0; lane < kLane; lane += L::count) {
    const Real* gradient = family.gradient_lanes + long(number) * 9 * M * kLane + lane;
    const Real* rest = family.rest + long(number) * 9 * kLane + lane;
    V f[9], change[9], stress[2][9];
#pragma GCC unroll 2
    for (int begin = 0; begin < 9; begin += kRows) {
      V own[kRows], rate[kRows] = {};
#pragma GCC unroll 9
      for (int row = begin; row < begin + kRows && row < 9; ++row) own[row - begin] = L::load(rest + row * kLane);
      for (int a = 0; a < M; ++a) {
        const Real coordinate = leg.coordinates[a], speed = leg.speeds[a];
#pragma GCC unroll 9
        for (int row = begin; row < begin + kRows && row < 9; ++row) {
          const V g = L::load(gradient + (a * 9 + row) * kLane);
          own[row - begin] += coordinate * g;
          rate[row - begin] += speed * g;
        }
      }
#pragma GCC unroll 9
      for (int row = begin; row < begin + kRows && row < 9; ++row) f[row] = own[row - begin], change[row] = rate[row - begin];
    }
    V end[9];
    if constexpr (Ahead)
#pragma GCC unroll 9
      for (int row = 0; row < 9; ++row) end[row] = f[row] + ahead * change[row];
    const V* now = Ahead ? end : f;
    law.stress(now, stress[0]);
    if (branches.count > 0)
      relax<Ahead, Real>(branches, f, now, leg.left + long(number) * branches.count * 6 * kLane + lane, stress[0]);
    objective_rate<Real>(now, change, family.lambda_over_mu, Real(1 + branches.resistance), stress[1]);
    const V mu = L::load(family.mu + number * kLane + lane);
#pragma GCC unroll 9
    for (int row = 0; row < 9; ++row) stress[0][row] *= mu, stress[1][row] *= mu;
    for (int a = 0; a < M; ++a) {
      V first = leg.solid_work[0][a], second = leg.solid_work[1][a];
#pragma GCC unroll 9
      for (int row = 0; row < 9; ++row) {
        const V g = L::load(gradient + (a * 9 + row) * kLane);
        first += stress[0][row] * g;
        second += stress[1][row] * g;
      }
      leg.solid_work[0][a] = first;
      leg.solid_work[1][a] = second;
    }
  }
}

// The same of all blocks, of `count` legs of one part.
template <int M, bool Ahead, class Law, class Real>
__attribute__((noinline)) void solid_work(const ElementFamily<Real>& family, const Law& law,
                                          const StepBranches<Real>& branches, Real ahead, int count,
                                          RubberSystem<M, Real>* const legs[]) {
  for (int k = 0; k < count; ++k) __builtin_memset(legs[k]->solid_work, 0, sizeof(legs[k]->solid_work));
  for (int number = 0; number < family.block_count; ++number)
    for (int k = 0; k < count; ++k) solid_block<M, Ahead, Law, Real>(family, law, branches, number, ahead, *legs[k]);
}

// Renews the solid's force beside a kept stiffness, and what that stiffness lacks, from the work of its stresses.
template <int M, class Real>
void renew_solid(const RubberSystem<M, Real>& leg, ElementSystem<M, Real>& solid) {
  const Real* speeds = leg.speeds;
  alignas(64) Real kept[M];
  // K0 u from the blocks on and above the diagonal.
  for (int a = 0; a < M; ++a) {
    kept[a] = 0;
    for (int b = a / 8 * 8; b < M; ++b) kept[a] += solid.stiffness[a][b] * speeds[b];
    for (int b = 0; b < a / 8 * 8; ++b) kept[a] += solid.stiffness[b][a] * speeds[b];
  }
  for (int a = 0; a < M; ++a) {
    solid.force[a] = -sum_lanes(leg.solid_work[0][a]);
    solid.earlier_lack[a] = solid.last_lack[a];
    solid.last_lack[a] = solid.lack[a];
    solid.lack[a] = sum_lanes(leg.solid_work[1][a]) - kept[a];
  }
}

// The solid's force and stiffness, found afresh; where its force was renewed in this step that stays, and so do the springs.
template <int M, bool Ahead, class Real>
void fresh_solid(const Part<Real>& part, StepBranches<Real> branches, const RubberSystem<M, Real>& leg,
                 ElementSystem<M, Real>& solid) {
  Real force[M];
  for (int a = 0; a < M; ++a) force[a] = solid.force[a];
  __builtin_memset(&solid, 0, sizeof(solid));
  if (leg.renewed) branches.count = 0;  // what they resist stays
  alignas(64) Real work[1][M] = {};
  add_rubber_of_law<M, false, Ahead>(part, branches, leg.left, leg.coordinates, leg.ends, work, solid);
  for (int a = 0; a < M; ++a) solid.force[a] = leg.renewed ? force[a] : -work[0][a];
}

constexpr double kSmoothChange = 0.3;  // mm in a step, root mean square over a part's mass

// Whether the rates have changed little since the step before, and so are likely to in this one; their mean. Notes them.
template <int M, class Real>
bool moves_smoothly(const Part<Real>& part, const double* rates, const Settings& settings, bool has_memory,
                    MountMemory<M, Real>& memory, double mean[M]) {
  double square = 0;
  for (int a = 0; a < M; ++a) {
    const double change = rates[a] - memory.last_rates[a];
    square += change * change;
    mean[a] = rates[a] - 0.5 * change;
    memory.last_rates[a] = rates[a];
  }
  const double allowed = kSmoothChange / settings.time_step;
  return has_memory && square <= allowed * allowed * part.mass;
}

// Where the forces of a mounted part are in this step, and whether keeping its solid's stiffness is tried.
template <int M, class Real>
void begin_rubber(const Part<Real>& part, const double* alpha, const double* rates, const Settings& settings,
                  bool has_memory, MountMemory<M, Real>& memory, RubberSystem<M, Real>& rubber) {
  if (!has_memory) {
    memory.fresh_steps = memory.wait = 0;
    for (int a = 0; a < M; ++a) memory.last_rates[a] = 0;
  }
  rubber.ahead = settings.foreseen && !settings.published_damping && settings.stiffness_damping == 0 &&
                 moves_smoothly(part, rates, settings, has_memory, memory, rubber.mean_rates);
  rubber.renewed = has_memory && !settings.published_damping && tries_to_keep(settings, memory);
  const double* leading = rubber.ahead ? rubber.mean_rates : rates;
  for (int a = 0; a < M; ++a) {
    rubber.end[a] = alpha[a] + (rubber.ahead ? settings.time_step * rubber.mean_rates[a] : 0.0);
    rubber.coordinates[a] = Real(alpha[a]);
    rubber.ends[a] = Real(rubber.end[a]);
    rubber.speeds[a] = Real(leading[a]);
  }
  __builtin_memset(&rubber.system, 0, sizeof(rubber.system));
  __builtin_memset(rubber.work, 0, sizeof(rubber.work));
}

// Adds what is stiff in `count` legs of a part, the sheet, the changes of volume and walls that meet: `work` of its stress on
// every mode and, under published damping, of the stresses of three turns, and its stiffness.
template <int M, class Real>
void add_stiff(const Part<Real>& part, const Settings& settings, int count, RubberSystem<M, Real>* const legs[]) {
  const bool edges = settings.edge_rotations != 0;
  for (int k = 0; k < count; ++k)
    if (settings.published_damping)
      add_elements<M, 2, 4, Real>(part.membranes, legs[k]->ends, edges, legs[k]->work, legs[k]->system);
    else
      add_elements<M, 2, 1, Real>(part.membranes, legs[k]->ends, edges, legs[k]->work, legs[k]->system);
  if (part.pressure_count + part.stretch_count > 0) add_mixed_energies<M, Real>(part, count, legs);
  if (part.wall_gap_count > 0)
    for (int k = 0; k < count; ++k) add_facing_walls<M, Real>(part, legs[k]->end, legs[k]->work[0], legs[k]->system.stiffness);
}

// The work of the solid's stresses in the legs of a part whose stiffness may be kept and whose forces are ahead, or are not.
template <int M, bool Ahead, class Real>
void work_on_kept(const Part<Real>& part, const Settings& settings, int count, RubberSystem<M, Real>* const legs[]) {
  RubberSystem<M, Real>* kept[kMaximumMounts];
  int kept_count = 0;
  for (int k = 0; k < count; ++k)
    if (legs[k]->renewed && legs[k]->ahead == Ahead) kept[kept_count++] = legs[k];
  if (kept_count == 0) return;
  const StepBranches<Real> branches(part, settings);
  with_law_of(part, [&](const auto& law) {
    solid_work<M, Ahead>(part.tetrahedra, law, branches, Real(settings.time_step), kept_count, kept);
  });
}

// What is found of all mounted parts of measured silicone before any is added to the robot, the legs of one part together.
template <int M, class Real>
void begin_rubber_parts(const Part<Real>* parts, const RobotModel& robot, const Settings& settings, RobotState& state,
                        Workspace<M, Real>& work) {
  for (int k = 0; k < robot.mount_count; ++k) {
    const Mount& mount = robot.mounts[k];
    if (!parts[mount.part].is_rubber()) continue;
    begin_rubber<M, Real>(parts[mount.part], state.modes + k * M, state.mode_rates + k * M, settings, state.has_memory,
                          work.mounts[k], work.rubber[k]);
    work.rubber[k].left = static_cast<Real*>(state.springs) + mount.spring_offset;
  }
  for (int k = 0; k < robot.mount_count; ++k) {
    const int number = robot.mounts[k].part;
    RubberSystem<M, Real>* legs[kMaximumMounts];
    int count = 0;
    bool is_first = parts[number].is_rubber();
    for (int l = 0; l < k; ++l) is_first &= robot.mounts[l].part != number;
    if (!is_first) continue;
    for (int l = k; l < robot.mount_count; ++l)
      if (robot.mounts[l].part == number) legs[count++] = &work.rubber[l];
    add_stiff<M, Real>(parts[number], settings, count, legs);
    work_on_kept<M, false, Real>(parts[number], settings, count, legs);
    work_on_kept<M, true, Real>(parts[number], settings, count, legs);
  }
}

// Adds the force and stiffness of the solid, damped objectively, and what the latter lacks; see rubber_system.
template <int M, bool Ahead, class Real>
void objective_system(const Part<Real>& part, const double* rates, const Settings& settings, MountMemory<M, Real>& memory,
                      RobotState& state, RubberSystem<M, Real>& rubber) {
  ElementSystem<M, Real>& whole = rubber.system;
  const double* leading = Ahead ? rubber.mean_rates : rates;
  ElementSystem<M, Real>& solid = memory.elements;
  if (rubber.renewed) renew_solid<M, Real>(rubber, solid);
  if (!rubber.renewed || !may_keep(part, leading, settings, memory, state)) {
    fresh_solid<M, Ahead, Real>(part, StepBranches<Real>(part, settings), rubber, solid);
    ++state.tangent_total;
  }
  for (int a = 0; a < M; ++a) {
    whole.force[a] = solid.force[a] - rubber.work[0][a];
    if constexpr (!Ahead) {
      whole.lack[a] = solid.lack[a];
      whole.last_lack[a] = solid.last_lack[a];
    }
    for (int b = a / 8 * 8; b < M; ++b) whole.stiffness[a][b] += solid.stiffness[a][b];
  }
  if constexpr (Ahead) {  // h K u, from the blocks on and above the diagonal
    for (int a = 0; a < M; ++a) {
      double sum = 0;
      for (int b = a / 8 * 8; b < M; ++b) sum += double(whole.stiffness[a][b]) * leading[b];
      for (int b = 0; b < a / 8 * 8; ++b) sum += double(whole.stiffness[b][a]) * leading[b];
      whole.force[a] = Real(double(whole.force[a]) + settings.time_step * sum);
    }
  }
}

// Force and stiffness of a part that was begun, and what the latter lacks. The solid's own are kept in `memory`, whose leg is
// that of the last step.
template <int M, class Real>
void rubber_system(const Part<Real>& part, const double* rates, const Settings& settings, MountMemory<M, Real>& memory,
                   RobotState& state, RubberSystem<M, Real>& rubber) {
  if (!settings.published_damping) {
    if (rubber.ahead)
      objective_system<M, true, Real>(part, rates, settings, memory, state, rubber);
    else
      objective_system<M, false, Real>(part, rates, settings, memory, state, rubber);
    return;
  }
  ElementSystem<M, Real>& whole = rubber.system;
  const StepBranches<Real> branches(part, settings);
  add_rubber_of_law<M, true, false>(part, branches, rubber.left, rubber.coordinates, rubber.coordinates, rubber.work, whole);
  ++state.tangent_total;
  for (int a = 0; a < M; ++a) {
    whole.force[a] = -rubber.work[0][a];
    for (int axis = 0; axis < 3; ++axis) whole.turn_stiffness[axis][a] = rubber.work[1 + axis][a];
  }
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
