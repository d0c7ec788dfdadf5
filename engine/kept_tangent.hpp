// Steps with the stiffness of an earlier step: a third of the element work of a fresh one, and no factor of the modes.
// Equations (25) and (26) of docs/physics.md.
//
// A step solves [(1 + a h) M + s K] u' = M u + h f with s = h (h + b). With K0 of an earlier state in the place of K, what
// K0 lacks, d = (K - K0) u, is predicted for the end of the step from the lacks that this step and the last one began with,
//   [(1 + a h) M + s K0] u' = M u + h f - s (2 d - d_last),
// so f is exact and a robot at rest stays so. K u is the work of one more stress on the modes, no matrix. With D the modes'
// block of the left side, the stiffness is found afresh where
//   - the prediction moves the part by more than a tolerance from the plain one: |s D^-1 (d - d_last)|, root mean square
//     over the part's mass, the size of what the prediction may be wrong by;
//   - the stiffness has changed by more than three tenths along the motion: |s D^-1 d| > 0.3 |u|. In the direction of a
//     change k the velocities follow z^2 + (2 k - p) z - k = 0, 0 <= p <= 1, which grow from k = (1 + p) / 3 on.
// What the last prediction was wrong by is known one step later, d - (2 d_last - d_before), and reported.
#pragma once
#include "leg_system.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Work of one family's stress on every mode and turn, lanes over elements, and of the stress rate of a motion: modal
// `rates` and a turning rate `turning` of the hub (used with `Turning`), both along the part's axes.
template <int M, int D, bool Turning, class Real>
void family_work(const ElementFamily<Real>& family, const Real* alpha, const Real* rates, const Real turning[3],
                 bool edge_rotations, typename RegisterLanes<Real>::type work[2][M], typename RegisterLanes<Real>::type moment[2][3]) {
  using L = RegisterLanes<Real>;
  using V = typename L::type;
  constexpr int kRows = 3 * D, kStresses = ElementBlock<D, Real>::kStresses;
  constexpr int kPieces = kLane / L::count;
  for (int number = 0; number < family.block_count; ++number)
    for (int piece = 0; piece < kPieces; ++piece) {
      const int lane = piece * L::count, element = number * kLane + lane;
      const Real* gradient = family.gradient_lanes + long(number) * kRows * M * kLane + lane;
      V f[kRows], change[kRows] = {}, r[kRows];
#pragma GCC unroll 9
      for (int row = 0; row < kRows; ++row) f[row] = L::load(family.rest + (long(number) * kRows + row) * kLane + lane);
      for (int a = 0; a < M; ++a) {
        const Real coordinate = alpha[a], rate = rates[a];
#pragma GCC unroll 9
        for (int row = 0; row < kRows; ++row) {
          const V g = L::load(gradient + (a * kRows + row) * kLane);
          f[row] += coordinate * g;
          change[row] += rate * g;
        }
      }
      if constexpr (Turning)  // the gradient of a turn is W x F, column by column
#pragma GCC unroll 3
        for (int j = 0; j < D; ++j) {
          change[j] += turning[1] * f[2 * D + j] - turning[2] * f[D + j];
          change[D + j] += turning[2] * f[j] - turning[0] * f[2 * D + j];
          change[2 * D + j] += turning[0] * f[D + j] - turning[1] * f[j];
        }
      if (edge_rotations)
        edge_rotation<D, Real, V>(f, r);
      else
        polar_rotation<D, Real, V>(f, r);
      const V lambda = L::load(family.lambda + element), mu = L::load(family.mu + element);
      V stretch[D][D], rate[D][D], stress[2][kStresses];
      in_rotated_frame<D>(r, f, stretch);
      in_rotated_frame<D>(r, change, rate);
      symmetric_stress<D, Real, V>(stretch, lambda, mu, Real(1), stress[0]);
      symmetric_stress<D, Real, V>(rate, lambda, mu, Real(0), stress[1]);
      if constexpr (Turning)
#pragma GCC unroll 3
        for (int axis = 0; axis < 3; ++axis) {
          V turn[D][D];
          turn_in_rotated_frame<D>(r, f, axis, turn);
          moment[0][axis] += stress_work<D, V>(stress[0], turn);
          moment[1][axis] += stress_work<D, V>(stress[1], turn);
        }
      // First Piola-Kirchhoff stresses R s.
      V piola[2][kRows];
      constexpr int kEntry[3][3] = {{0, D, 4}, {D, 1, 5}, {4, 5, 2}};
#pragma GCC unroll 2
      for (int which = 0; which < 2; ++which)
#pragma GCC unroll 3
        for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
          for (int j = 0; j < D; ++j) {
            piola[which][D * i + j] = r[D * i] * stress[which][kEntry[0][j]];
#pragma GCC unroll 2
            for (int k = 1; k < D; ++k) piola[which][D * i + j] += r[D * i + k] * stress[which][kEntry[k][j]];
          }
      for (int a = 0; a < M; ++a) {
        V first = work[0][a], second = work[1][a];
#pragma GCC unroll 9
        for (int row = 0; row < kRows; ++row) {
          const V g = L::load(gradient + (a * kRows + row) * kLane);
          first += piola[0][row] * g;
          second += piola[1][row] * g;
        }
        work[0][a] = first;
        work[1][a] = second;
      }
    }
}

// Whether the laws of a part's elements allow its stiffness to be kept: K u of the other laws is not written.
template <class Real>
inline bool can_keep(const Part<Real>& part) {
  return part.tetrahedra.law == kCorotational && part.membranes.law == kCorotational;
}

// Renews force and moment of a system whose stiffness is kept, and what that stiffness lacks.
template <int M, bool Turning, class Real>
void renew_forces(const Part<Real>& part, const double* alpha, const double* rates, const double turning[3],
                  bool edge_rotations, ElementSystem<M, Real>& system) {
  using V = typename RegisterLanes<Real>::type;
  alignas(64) Real coordinates[M], speeds[M];
  for (int a = 0; a < M; ++a) coordinates[a] = Real(alpha[a]), speeds[a] = Real(rates[a]);
  const Real turn[3] = {Real(turning[0]), Real(turning[1]), Real(turning[2])};
  V work[2][M] = {}, moment[2][3] = {};
  family_work<M, 3, Turning, Real>(part.tetrahedra, coordinates, speeds, turn, edge_rotations, work, moment);
  family_work<M, 2, Turning, Real>(part.membranes, coordinates, speeds, turn, edge_rotations, work, moment);
  // K0 u from the blocks on and above the diagonal.
  Real kept[M] = {};
  for (int a = 0; a < M; ++a) {
    Real sum = 0;
    const int block = a / 8 * 8;
    for (int b = block; b < M; ++b) sum += system.stiffness[a][b] * speeds[b];
    for (int b = block + 8; b < M; ++b) kept[b] += system.stiffness[a][b] * speeds[a];
    kept[a] += sum;
  }
  for (int a = 0; a < M; ++a) {
    system.force[a] = -sum_lanes(work[0][a]);
    Real lack = sum_lanes(work[1][a]) - kept[a];
    if constexpr (Turning)
      for (int axis = 0; axis < 3; ++axis) lack -= turn[axis] * system.turn_stiffness[axis][a];
    system.earlier_lack[a] = system.last_lack[a];
    system.last_lack[a] = system.lack[a];
    system.lack[a] = lack;
  }
  if constexpr (Turning)
    for (int axis = 0; axis < 3; ++axis) {
      system.moment[axis] = -sum_lanes(moment[0][axis]);
      Real lack = sum_lanes(moment[1][axis]);
      for (int a = 0; a < M; ++a) lack -= speeds[a] * system.turn_stiffness[axis][a];
      for (int other = 0; other < 3; ++other) lack -= turn[other] * system.turn_turn_stiffness[3 * axis + other];
      system.last_turn_lack[axis] = system.turn_lack[axis];
      system.turn_lack[axis] = lack;
    }
}

// Velocity that a change `lack` of the modes' right side (over s) gives: root mean square over the part's mass, with the hub
// at rest [mm/s].
template <int M>
double velocity_of(const double lack[M], double mass, double scale, const LegSystem<M>& leg) {
  alignas(64) double reduced[M];
  times_inverse<M>(lack, leg.inverse_upper, reduced);
  double square = 0;
  for (int a = 0; a < M; ++a) {
    const double rate = inverse_times<M>(leg.inverse_upper, a, reduced);
    square += rate * rate;
  }
  return scale * std::sqrt(square / mass);
}

// The same for a moment on the hub, with this part alone on it and its origin at rest.
template <int M>
double velocity_of_turn(const double moment[3], double mass, double scale, const LegSystem<M>& leg) {
  // moment^T B^-1 moment with the hub's turning block B, by its cofactors.
  double cofactor[3], work = 0, determinant = 0;
  const double* rows[3] = {&leg.hub[21], &leg.hub[27], &leg.hub[33]};
  for (int i = 0; i < 3; ++i) {
    cross(rows[(i + 1) % 3], rows[(i + 2) % 3], cofactor);
    work += moment[i] * (moment[0] * cofactor[0] + moment[1] * cofactor[1] + moment[2] * cofactor[2]);
    if (i == 0) determinant = rows[0][0] * cofactor[0] + rows[0][1] * cofactor[1] + rows[0][2] * cofactor[2];
  }
  return scale * std::sqrt(work / determinant / mass);
}

// What a robot keeps of a mounted part from step to step.
template <int M, class Real>
struct MountMemory {
  ElementSystem<M, Real> elements;
  LegSystem<M> leg;
  int fresh_steps;  // steps in a row that found the stiffness afresh
  int wait;         // steps to go until keeping it is tried again
  alignas(64) double last_rates[M];  // that the last step began with
};

constexpr double kLargestShare = 0.3;  // of a motion that what the stiffness lacks along it may be worth
constexpr int kLongestWait = 7;

// Whether keeping the stiffness is tried in this step. A part that moves too fast for that does so for a while: after a try
// that fails at once, 1, 3 and then 7 steps go by without one.
template <int M, class Real>
bool tries_to_keep(const Settings& settings, MountMemory<M, Real>& memory) {
  if (!(settings.tangent_tolerance > 0)) return false;
  if (memory.wait == 0) return true;
  --memory.wait;
  ++memory.fresh_steps;
  return false;
}

// Whether the stiffness may be kept, beside which the forces at `rates` were renewed.
template <int M, class Real>
bool may_keep(const Part<Real>& part, const double* rates, const Settings& settings, MountMemory<M, Real>& memory,
              RobotState& state) {
  const ElementSystem<M, Real>& elements = memory.elements;
  // The factor and the hub's block of the last step serve as measures.
  const double scale = element_scale(settings);
  alignas(64) double lack[M], change[M], error[M];
  double speed = 0;
  for (int a = 0; a < M; ++a) {
    lack[a] = double(elements.lack[a]);
    change[a] = lack[a] - double(elements.last_lack[a]);
    error[a] = change[a] - (double(elements.last_lack[a]) - double(elements.earlier_lack[a]));
    speed += rates[a] * rates[a];
  }
  double changed = velocity_of<M>(change, part.mass, scale, memory.leg);
  if (settings.published_damping) {
    double turn_change[3];
    for (int i = 0; i < 3; ++i) turn_change[i] = double(elements.turn_lack[i]) - double(elements.last_turn_lack[i]);
    changed = std::fmax(changed, velocity_of_turn<M>(turn_change, part.mass, scale, memory.leg));
  }
  if (memory.fresh_steps == 0) {  // the last step had a prediction
    const double wrong = velocity_of<M>(error, part.mass, scale, memory.leg);
    state.worst_tangent_error = std::fmax(state.worst_tangent_error, wrong);
    state.tangent_error_total += wrong > settings.tangent_tolerance;
  }
  const double share = velocity_of<M>(lack, part.mass, scale, memory.leg);
  // Not where a number is not one.
  if (changed <= settings.tangent_tolerance && share <= kLargestShare * std::sqrt(speed / part.mass)) {
    memory.fresh_steps = 0;
    return true;
  }
  memory.wait = memory.fresh_steps < kLongestWait ? memory.fresh_steps : kLongestWait;
  ++memory.fresh_steps;
  return false;
}

// Renews the forces of corotational elements beside the last step's stiffness, or tells that it must be found afresh.
template <int M, class Real>
bool keep_stiffness(const Part<Real>& part, const double* alpha, const double* rates, const double turning[3],
                    const Settings& settings, MountMemory<M, Real>& memory, RobotState& state) {
  if (!can_keep(part) || !tries_to_keep(settings, memory)) return false;
  const auto renew = settings.published_damping ? renew_forces<M, true, Real> : renew_forces<M, false, Real>;
  renew(part, alpha, rates, turning, settings.edge_rotations != 0, memory.elements);
  return may_keep(part, rates, settings, memory, state);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
