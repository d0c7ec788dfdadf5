// Coriolis and centrifugal forces of a part in the hub's turning frame.
//
// A node at y with the rate y' in a frame that turns at W has the acceleration of the frame's linear
// terms and c = W x (W x y) + 2 W x y'. The forces -sum m c, -sum m y x c and -sum m Phi_a . c are taken
// at the start of a step. With A = W W^T - |W|^2 I, so that W x (W x y) = A y, they need moments that the
// step has anyway: first moment, second moment S = sum m y y^T, lever L_ij^a = sum m y_i Phi_j^a and, of
// pairs of modes, the antisymmetric sums G_k^ab = sum m (Phi^a x Phi^b)_k.
#pragma once
#include "small_matrix.hpp"
#include "lanes.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

using DoubleLanes = Lanes<double>::type;

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

// Adds -h times the forces of a part to its right sides. `lever`: L_ij^a, row 3 i + j.
template <int M>
inline void add_velocity_products(const double* gyroscopic, const double rates[M], const double turning[3],
                                  const double first[3], const double second[9], const double lever[9][M],
                                  const double momentum[3], double h, double right_hub[6], double right_modes[M]) {
  constexpr int kVectors = M / 8;
  add_rigid_velocity_products(turning, first, second, h, right_hub);
  double force[3];
  cross(turning, momentum, force);  // momentum of the modes, sum m y'
  double spread[9];                 // sum m y y'^T
  for (int ij = 0; ij < 9; ++ij) {
    DoubleLanes dot = {};
    for (int v = 0; v < kVectors; ++v) dot += load(&lever[ij][8 * v]) * load(rates + 8 * v);
    spread[ij] = sum_lanes(dot);
  }
  const double trace = spread[0] + spread[4] + spread[8];
  for (int i = 0; i < 3; ++i) {
    double along = 0;
    for (int j = 0; j < 3; ++j) along += spread[3 * j + i] * turning[j];
    right_hub[i] -= 2.0 * h * force[i];
    right_hub[3 + i] -= 2.0 * h * (turning[i] * trace - along);
  }
  double a[9];
  centrifugal_matrix(turning, a);
  DoubleLanes sum[kVectors] = {};
  for (int ij = 0; ij < 9; ++ij)
    for (int v = 0; v < kVectors; ++v) sum[v] += (h * a[ij]) * load(&lever[ij][8 * v]);
  for (int k = 0; k < 3; ++k)
    for (int b = 0; b < M; ++b) {
      const double factor = 2.0 * h * turning[k] * rates[b];
      for (int v = 0; v < kVectors; ++v) sum[v] += factor * load(gyroscopic + (k * M + b) * M + 8 * v);
    }
  for (int v = 0; v < kVectors; ++v) store(right_modes + 8 * v, load(right_modes + 8 * v) - sum[v]);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
