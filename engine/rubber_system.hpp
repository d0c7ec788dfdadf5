// A mounted part of measured silicone in a step: what is found of all parts of a robot before any is added to it, and then all
// of the part.
#pragma once
#include "elements.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Sums over the terms of the changes of volume and of a sheet's stretches (mixed_energies.hpp).
template <int M, class Real>
struct MixedSums {
  using V = typename Lanes<Real, 2 * kPressureLane * sizeof(Real)>::type;  // pressures, of two modes side by side

  V two_coordinates[M / 2];
  V by_pair_mode[M];           // gradients by b and c, over the two modes a
  V by_mode[kCubicModes / 2];  // by a
  alignas(64) Real gradient[kPressureLane][M];
  alignas(64) double third[kMaximumPressures][M];  // gradients of the cubic terms
  alignas(64) Real rows[kMaximumPressures + kMaximumStretches][kRowStride<M>];
};

template <int M, class Real>
struct RubberSystem {
  bool ahead;    // forces are where the mean of the last two steps' rates leads; else where the step starts
  bool renewed;  // the solid's forces are found beside a kept stiffness in this step
  alignas(64) double end[M], mean_rates[M];             // coordinates where forces are, and these rates
  alignas(64) Real coordinates[M], ends[M], speeds[M];  // where the step starts and where forces are; the rates that lead there
  Real* left;                                           // of its springs (block, branch, 6, kLane)
  MixedSums<M, Real> mixed;
  typename RegisterLanes<Real>::type solid_work[2][M];  // of the solid's stress and stress rate on every mode
  alignas(64) Real work[4][M];                          // of all stresses on every mode, and of those of three turns
  ElementSystem<M, Real> system;
};

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
