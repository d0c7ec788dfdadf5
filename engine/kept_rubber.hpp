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
// What is stiff is found of all parts of a robot before the solid of any: the numbers that both read of a part are more than
// the second-level cache holds, and legs of one kind then read either once.
#pragma once
#include "kept_tangent.hpp"
#include "rubber.hpp"

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

// Work of the solid's stress on every mode, lanes over elements, and of the stress rate of modal `rates`; takes the springs to
// the step's end. With `Ahead` the stresses are those after a time `ahead` of these rates.
template <int M, bool Ahead, class Law, class Real>
__attribute__((noinline)) void solid_work(const ElementFamily<Real>& family, const Law& law,
                                          const StepBranches<Real>& branches, Real* left, const Real* alpha,
                                          const Real* rates, Real ahead, typename RegisterLanes<Real>::type work[2][M]) {
  using L = RegisterLanes<Real>;
  using V = typename L::type;
  for (int number = 0; number < family.block_count; ++number)
    for (int lane = 0; lane < kLane; lane += L::count) {
      const Real* gradient = family.gradient_lanes + long(number) * 9 * M * kLane + lane;
      V f[9], change[9] = {}, stress[2][9];
#pragma GCC unroll 9
      for (int row = 0; row < 9; ++row) f[row] = L::load(family.rest + (long(number) * 9 + row) * kLane + lane);
      for (int a = 0; a < M; ++a) {
        const Real coordinate = alpha[a], rate = rates[a];
#pragma GCC unroll 9
        for (int row = 0; row < 9; ++row) {
          const V g = L::load(gradient + (a * 9 + row) * kLane);
          f[row] += coordinate * g;
          change[row] += rate * g;
        }
      }
      V end[9];
      if constexpr (Ahead)
#pragma GCC unroll 9
        for (int row = 0; row < 9; ++row) end[row] = f[row] + ahead * change[row];
      const V* now = Ahead ? end : f;
      law.stress(now, stress[0]);
      if (branches.count > 0)
        relax<Ahead, Real>(branches, f, now, left + long(number) * branches.count * 6 * kLane + lane, stress[0]);
      objective_rate<Real>(now, change, family.lambda_over_mu, Real(1 + branches.resistance), stress[1]);
      const V mu = L::load(family.mu + number * kLane + lane);
#pragma GCC unroll 9
      for (int row = 0; row < 9; ++row) stress[0][row] *= mu, stress[1][row] *= mu;
      for (int a = 0; a < M; ++a) {
        V first = work[0][a], second = work[1][a];
#pragma GCC unroll 9
        for (int row = 0; row < 9; ++row) {
          const V g = L::load(gradient + (a * 9 + row) * kLane);
          first += stress[0][row] * g;
          second += stress[1][row] * g;
        }
        work[0][a] = first;
        work[1][a] = second;
      }
    }
}

// Renews the solid's force beside a kept stiffness, what that stiffness lacks, and the springs.
template <int M, bool Ahead, class Real>
void renew_solid(const Part<Real>& part, const StepBranches<Real>& branches, const Real* coordinates, const double* rates,
                 double ahead, Real* left, ElementSystem<M, Real>& solid) {
  using V = typename RegisterLanes<Real>::type;
  alignas(64) Real speeds[M], kept[M];
  for (int a = 0; a < M; ++a) speeds[a] = Real(rates[a]);
  V work[2][M] = {};
  with_law_of(part, [&](const auto& law) {
    solid_work<M, Ahead>(part.tetrahedra, law, branches, left, coordinates, speeds, Real(ahead), work);
  });
  // K0 u from the blocks on and above the diagonal.
  for (int a = 0; a < M; ++a) {
    kept[a] = 0;
    for (int b = a / 8 * 8; b < M; ++b) kept[a] += solid.stiffness[a][b] * speeds[b];
    for (int b = 0; b < a / 8 * 8; ++b) kept[a] += solid.stiffness[b][a] * speeds[b];
  }
  for (int a = 0; a < M; ++a) {
    solid.force[a] = -sum_lanes(work[0][a]);
    solid.earlier_lack[a] = solid.last_lack[a];
    solid.last_lack[a] = solid.lack[a];
    solid.lack[a] = sum_lanes(work[1][a]) - kept[a];
  }
}

// The solid's force and stiffness, found afresh; where its force was `renewed` in this step that stays, and so do the springs.
template <int M, bool Ahead, class Real>
void fresh_solid(const Part<Real>& part, StepBranches<Real> branches, const Real* coordinates, const Real* end, Real* left,
                 bool renewed, ElementSystem<M, Real>& solid) {
  Real force[M];
  for (int a = 0; a < M; ++a) force[a] = solid.force[a];
  __builtin_memset(&solid, 0, sizeof(solid));
  if (renewed) branches.count = 0;  // what they resist stays
  alignas(64) Real work[1][M] = {};
  add_rubber_of_law<M, false, Ahead>(part, branches, left, coordinates, end, work, solid);
  for (int a = 0; a < M; ++a) solid.force[a] = renewed ? force[a] : -work[0][a];
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

// Where the forces of a part are in this step, and what is stiff in it there.
template <int M, class Real>
void find_stiff(const Part<Real>& part, const double* alpha, const double* rates, const Settings& settings, bool has_memory,
                MountMemory<M, Real>& memory, RubberSystem<M, Real>& rubber) {
  if (!has_memory)
    for (int a = 0; a < M; ++a) memory.last_rates[a] = 0;
  rubber.ahead = settings.foreseen && !settings.published_damping && settings.stiffness_damping == 0 &&
                 moves_smoothly(part, rates, settings, has_memory, memory, rubber.mean_rates);
  alignas(64) Real ends[M];
  for (int a = 0; a < M; ++a) {
    rubber.end[a] = alpha[a] + (rubber.ahead ? settings.time_step * rubber.mean_rates[a] : 0.0);
    ends[a] = Real(rubber.end[a]);
  }
  __builtin_memset(&rubber.system, 0, sizeof(rubber.system));
  __builtin_memset(rubber.work, 0, sizeof(rubber.work));
  add_stiff<M, Real>(part, rubber.end, ends, settings, rubber.work, rubber.system);
}

// Adds the force and stiffness of the solid, damped objectively, and what the latter lacks; see rubber_system.
template <int M, bool Ahead, class Real>
void objective_system(const Part<Real>& part, const double* alpha, const double* rates, const Settings& settings, Real* left,
                      MountMemory<M, Real>& memory, RobotState& state, RubberSystem<M, Real>& rubber) {
  ElementSystem<M, Real>& whole = rubber.system;
  alignas(64) Real coordinates[M], ends[M];
  for (int a = 0; a < M; ++a) coordinates[a] = Real(alpha[a]), ends[a] = Real(rubber.end[a]);
  const double* leading = Ahead ? rubber.mean_rates : rates;
  const StepBranches<Real> branches(part, settings);
  ElementSystem<M, Real>& solid = memory.elements;
  bool renewed = false;
  const auto renew = [&](ElementSystem<M, Real>& elements) {
    renew_solid<M, Ahead, Real>(part, branches, coordinates, leading, settings.time_step, left, elements);
    renewed = true;
  };
  if (!state.has_memory || !keep_stiffness(part, alpha, leading, nullptr, settings, memory, state, renew)) {
    fresh_solid<M, Ahead, Real>(part, branches, coordinates, ends, left, renewed, solid);
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

// Force and stiffness of a part whose stiff ones were found, and what the latter lacks; `left`: (block, branch, 6, kLane). The
// solid's own are kept in `memory`, whose leg is that of the last step.
template <int M, class Real>
void rubber_system(const Part<Real>& part, const double* alpha, const double* rates, const Settings& settings, Real* left,
                   MountMemory<M, Real>& memory, RobotState& state, RubberSystem<M, Real>& rubber) {
  if (!settings.published_damping) {
    if (rubber.ahead)
      objective_system<M, true, Real>(part, alpha, rates, settings, left, memory, state, rubber);
    else
      objective_system<M, false, Real>(part, alpha, rates, settings, left, memory, state, rubber);
    return;
  }
  ElementSystem<M, Real>& whole = rubber.system;
  alignas(64) Real coordinates[M];
  for (int a = 0; a < M; ++a) coordinates[a] = Real(alpha[a]);
  const StepBranches<Real> branches(part, settings);
  add_rubber_of_law<M, true, false>(part, branches, left, coordinates, coordinates, rubber.work, whole);
  ++state.tangent_total;
  for (int a = 0; a < M; ++a) {
    whole.force[a] = -rubber.work[0][a];
    for (int axis = 0; axis < 3; ++axis) whole.turn_stiffness[axis][a] = rubber.work[1 + axis][a];
  }
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
