// Coriolis and centrifugal forces of a part in the hub's turning frame: equation (21) of docs/physics.md.
//
// A node at y with the rate y' in a frame that turns at W has the acceleration of the frame's linear
// terms and c = W x (W x y) + 2 W x y'. The forces -sum m c, -sum m y x c and -sum m Phi_a . c are taken
// at the start of a step. With A = W W^T - |W|^2 I, so that W x (W x y) = A y, they need moments that the
// step has anyway: first moment, second moment S = sum m y y^T and its change with each mode, momenta of the
// modes, and sum m Phi^b x Phi^a of pairs of modes.
#pragma once
#include "small_matrix.hpp"
#include "lanes.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

inline void centrifugal_matrix(const double turning[3], double a[9]) {
  const double square = turning[0] * turning[0] + turning[1] * turning[1] + turning[2] * turning[2];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a[3 * i + j] = turning[i] * turning[j] - (i == j ? square : 0.0);
}

// Adds -h times force and moment of a rigid body about its frame's origin to `right`.
inline void add_rigid_velocity_products(const double turning[3], const double first[3], const double second[9],
                                        double h, double right[6]) {
  double a[9], force[3], product[9];
  centrifugal_matrix(turning, a);
  multiply(a, first, force);
  multiply_matrices(a, second, product);  // sum m (A y) y^T
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    right[i] -= h * force[i];
    right[3 + i] -= h * (product[3 * k + j] - product[3 * j + k]);  // y x (A y)
  }
}

// Adds -h times the forces of a part to its right sides. `second_change`: change of S with each mode (xx, xy, xz,
// yy, yz, zz); `momentum`: sum m y' and sum m y x y'.
template <int M>
inline void add_velocity_products(const double* mode_levers, const double rates[M], const double turning[3],
                                  const double first[3], const double second[9],
                                  const double second_change[6][M], const double momentum[6], double h,
                                  double right_hub[6], double right_modes[M]) {
  constexpr int kVectors = M / 8;
  add_rigid_velocity_products(turning, first, second, h, right_hub);
  double a[9], rate[9];  // rate of S
  centrifugal_matrix(turning, a);
  DoubleLanes sum[kVectors] = {};
  for (int i = 0, entry = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j, ++entry) {
      const double factor = (i == j ? 0.5 : 1.0) * h * a[3 * i + j];
      DoubleLanes dot = {};
      for (int v = 0; v < kVectors; ++v) {
        const DoubleLanes change = load(&second_change[entry][8 * v]);
        sum[v] += factor * change;
        dot += change * load(rates + 8 * v);
      }
      rate[3 * i + j] = rate[3 * j + i] = sum_lanes(dot);
    }
  double force[3], stretch[3], swing[3];
  cross(turning, momentum, force);
  multiply(rate, turning, stretch);
  cross(momentum + 3, turning, swing);
  // sum m y x (W x y') = W tr(D) - D^T W, and D = sum m y y'^T = (dS/dt + [sum m y x y'] x) / 2.
  const double trace = rate[0] + rate[4] + rate[8];
  for (int i = 0; i < 3; ++i) {
    right_hub[i] -= 2.0 * h * force[i];
    right_hub[3 + i] -= h * (turning[i] * trace - stretch[i] - swing[i]);
  }
  for (int k = 0; k < 3; ++k)
    for (int b = 0; b < M; ++b) {
      const double factor = 2.0 * h * turning[k] * rates[b];
      for (int v = 0; v < kVectors; ++v) sum[v] += factor * load(mode_levers + (k * M + b) * M + 8 * v);
    }
  for (int v = 0; v < kVectors; ++v) store(right_modes + 8 * v, load(right_modes + 8 * v) - sum[v]);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
