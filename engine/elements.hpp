// Internal force and rotated stiffness of the sampled elements of one reduced part: equations (3), (6), (14), (15) and
// (22) of docs/physics.md.
//
// An element's deformation gradient in its own material frame is affine in the modal coordinates,
//   F = F0 + sum_a G_a alpha_a            (3 x D; D = 3 tetrahedra, D = 2 membrane triangles).
// Corotational linear elasticity: with the element's rotation R (3 x D),
//   strain e = sym(R^T F) - I,  stress s = lambda tr(e) I + 2 mu e,
//   force on mode a = -sum_ij (R s)_ij G_a,ij,
//   stiffness_ab = lambda tr(B_a) tr(B_b) + 2 mu B_a : B_b,  B_a = sym(R^T G_a),
// where lambda and mu hold the element's sampling weight and measure (ECSW). A turn of the hub about
// axis l of the part's frame is three more columns with gradient [e_l]x F: they give the moment of the
// internal forces and the coupling of stiffness with the hub's rotation.
#pragma once
#include <cmath>

#include "hyperelastic.hpp"
#include "lanes.hpp"
#include "model.hpp"
#include "outer_products.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

template <int M, class Real>
struct ElementSystem {
  alignas(64) Real force[M];
  alignas(64) Real stiffness[M][M];
  alignas(64) Real turn_stiffness[3][M];  // rotation of the hub against modes
  Real turn_turn_stiffness[9];
  Real moment[3];                          // of the internal forces about the part's origin
  // Where the stiffness is that of an earlier step (kept_tangent.hpp): what it lacks, times the velocity of this step's
  // start, of the last one's and of the one's before; on modes and on turns.
  Real lack[M], turn_lack[3], last_lack[M], last_turn_lack[3], earlier_lack[M];
};

// Gram-Schmidt frame of the first two columns: the first edge, and the first face's plane.
// `f` and `r` are 3 x D, row by row, each entry a vector over elements.
template <int D, class Real, class V>
inline void edge_rotation(const V f[3 * D], V r[3 * D]) {
  const V ax = f[0], ay = f[D], az = f[2 * D], bx = f[1], by = f[D + 1], bz = f[2 * D + 1];
  const V ia = Real(1) / root_lanes<Real>(ax * ax + ay * ay + az * az);
  const V x0 = ax * ia, x1 = ay * ia, x2 = az * ia;
  V z0 = ay * bz - az * by, z1 = az * bx - ax * bz, z2 = ax * by - ay * bx;
  const V iz = Real(1) / root_lanes<Real>(z0 * z0 + z1 * z1 + z2 * z2);
  z0 *= iz, z1 *= iz, z2 *= iz;
  r[0] = x0, r[D] = x1, r[2 * D] = x2;
  r[1] = z1 * x2 - z2 * x1, r[D + 1] = z2 * x0 - z0 * x2, r[2 * D + 1] = z0 * x1 - z1 * x0;
  if constexpr (D == 3) r[2] = z0, r[5] = z1, r[8] = z2;
}

// Polar factor. In space Newton's iteration R <- (g R + R^-T / g) / 2, in its first steps with Higham's (1986) factor
// g^2 = |R^-T| / |R|: crushed elements are then orthogonal after as many steps, which the tangent's constant part relies
// on. In the plane a closed form.
template <int D, class Real, class V>
inline void polar_rotation(const V f[3 * D], V r[3 * D]) {
  if constexpr (D == 2) {
    V frame[6];
    edge_rotation<2, Real, V>(f, frame);
    V g[4] = {};
    for (int i = 0; i < 3; ++i) {
      g[0] += frame[2 * i] * f[2 * i], g[1] += frame[2 * i] * f[2 * i + 1];
      g[2] += frame[2 * i + 1] * f[2 * i], g[3] += frame[2 * i + 1] * f[2 * i + 1];
    }
    const V c = g[0] + g[3], s = g[2] - g[1];
    const V inverse = Real(1) / root_lanes<Real>(c * c + s * s);
    for (int i = 0; i < 3; ++i) {
      r[2 * i] = (frame[2 * i] * c + frame[2 * i + 1] * s) * inverse;
      r[2 * i + 1] = (frame[2 * i + 1] * c - frame[2 * i] * s) * inverse;
    }
  } else {
    V q[9];
    for (int i = 0; i < 9; ++i) q[i] = f[i];
    const int scaled = sizeof(Real) == 8 ? 5 : 4, iterations = sizeof(Real) == 8 ? 9 : 7;
    for (int k = 0; k < iterations; ++k) {
      V c[9];
      c[0] = q[4] * q[8] - q[5] * q[7], c[1] = q[5] * q[6] - q[3] * q[8], c[2] = q[3] * q[7] - q[4] * q[6];
      c[3] = q[2] * q[7] - q[1] * q[8], c[4] = q[0] * q[8] - q[2] * q[6], c[5] = q[1] * q[6] - q[0] * q[7];
      c[6] = q[1] * q[5] - q[2] * q[4], c[7] = q[2] * q[3] - q[0] * q[5], c[8] = q[0] * q[4] - q[1] * q[3];
      V inverse = Real(1) / (q[0] * c[0] + q[1] * c[1] + q[2] * c[2]), own = V{} + Real(0.5);
      if (k < scaled) {
        V length = q[0] * q[0], other = c[0] * c[0];
        for (int i = 1; i < 9; ++i) length += q[i] * q[i], other += c[i] * c[i];
        const V g = root_lanes<Real>(root_lanes<Real>(other * inverse * inverse / length));
        own *= g;
        inverse /= g;
      }
      inverse *= Real(0.5);
      for (int i = 0; i < 9; ++i) q[i] = own * q[i] + inverse * c[i];
    }
    for (int i = 0; i < 9; ++i) r[i] = q[i];
  }
}

// R^T F: a gradient in the rotated frame.
template <int D, class V>
inline void in_rotated_frame(const V r[3 * D], const V f[3 * D], V t[D][D]) {
#pragma GCC unroll 3
  for (int i = 0; i < D; ++i)
#pragma GCC unroll 3
    for (int j = 0; j < D; ++j) t[i][j] = r[i] * f[j] + r[D + i] * f[D + j] + r[2 * D + i] * f[2 * D + j];
}

// The same of the gradient [e_axis]x F of a turn, which has rows axis+1 and axis+2 equal to -F_(axis+2) and F_(axis+1).
template <int D, class V>
inline void turn_in_rotated_frame(const V r[3 * D], const V f[3 * D], int axis, V turn[D][D]) {
  const int i1 = (axis + 1) % 3, i2 = (axis + 2) % 3;
#pragma GCC unroll 3
  for (int j = 0; j < D; ++j)
#pragma GCC unroll 3
    for (int i = 0; i < D; ++i) turn[i][j] = r[i2 * D + i] * f[i1 * D + j] - r[i1 * D + i] * f[i2 * D + j];
}

// What the stage with lanes over elements hands to the stage with lanes over modes.
template <int D, class Real>
struct ElementBlock {
  static constexpr int kRows = 3 * D;
  static constexpr int kStresses = D == 3 ? 6 : 3;  // 00, 11, (22,) 01, (02, 12)
  alignas(64) Real rotation[kRows][kLane];          // times row_scale
  // In the rotated frame, with weight and measure, over row_scale; and its change for turns about the three axes.
  alignas(64) Real stress[4][kStresses][kLane];
};

// Stress lambda tr I + 2 mu sym t of a gradient t in the rotated frame; `relaxed` is subtracted from t's diagonal.
template <int D, class Real, class V>
inline void symmetric_stress(const V t[D][D], V lambda, V mu, Real relaxed, V s[D == 3 ? 6 : 3]) {
  V trace = t[0][0] + t[1][1] - Real(D) * relaxed;
  if constexpr (D == 3) trace += t[2][2];
  const V pressure = lambda * trace - (Real(2) * relaxed) * mu, twice = mu + mu;
#pragma GCC unroll 3
  for (int i = 0; i < D; ++i) s[i] = pressure + twice * t[i][i];
  s[D] = mu * (t[0][1] + t[1][0]);
  if constexpr (D == 3) s[4] = mu * (t[0][2] + t[2][0]), s[5] = mu * (t[1][2] + t[2][1]);
}

// s : t.
template <int D, class V>
inline V stress_work(const V s[D == 3 ? 6 : 3], const V t[D][D]) {
  V sum = s[0] * t[0][0] + s[1] * t[1][1] + s[D] * (t[0][1] + t[1][0]);
  if constexpr (D == 3) sum += s[2] * t[2][2] + s[4] * (t[0][2] + t[2][0]) + s[5] * (t[1][2] + t[2][1]);
  return sum;
}

// Deformation gradient, rotation and stress of a block of elements, lanes over elements.
template <int M, int D, class Real, class V>
inline void deform_block(const ElementFamily<Real>& family, int number, const Real* alpha, bool edge_rotations,
                         bool turning, ElementBlock<D, Real>& block, V moment[3], V turn_turn[6]) {
  using L = RegisterLanes<Real>;
  constexpr int kRows = 3 * D, kStresses = ElementBlock<D, Real>::kStresses;
  constexpr int kPieces = kLane / L::count;  // vectors in a block of elements
  for (int piece = 0; piece < kPieces; ++piece) {
    const int lane = piece * L::count, element = number * kLane + lane;
    V f[kRows], r[kRows], s[kStresses];
    const Real* gradient = family.gradient_lanes + long(number) * kRows * M * kLane + lane;
#pragma GCC unroll 9
    for (int row = 0; row < kRows; ++row) f[row] = L::load(family.rest + (long(number) * kRows + row) * kLane + lane);
    for (int a = 0; a < M; ++a) {
      const Real coordinate = alpha[a];
#pragma GCC unroll 9
      for (int row = 0; row < kRows; ++row) f[row] += coordinate * L::load(gradient + (a * kRows + row) * kLane);
    }
    if (edge_rotations)
      edge_rotation<D, Real, V>(f, r);
    else
      polar_rotation<D, Real, V>(f, r);
    const V scale = L::load(family.row_scale + element), inverse = L::load(family.inverse_scale + element);
    const V lambda = L::load(family.lambda + element) * inverse, mu = L::load(family.mu + element) * inverse;
    V t[D][D];
    in_rotated_frame<D>(r, f, t);
    symmetric_stress<D, Real, V>(t, lambda, mu, Real(1), s);
#pragma GCC unroll 9
    for (int row = 0; row < kRows; ++row) L::store(&block.rotation[row][lane], scale * r[row]);
#pragma GCC unroll 6
    for (int i = 0; i < kStresses; ++i) L::store(&block.stress[0][i][lane], s[i]);
    if (!turning) continue;
    V turn[3][D][D];
#pragma GCC unroll 3
    for (int axis = 0; axis < 3; ++axis) {
      turn_in_rotated_frame<D>(r, f, axis, turn[axis]);
      moment[axis] -= scale * stress_work<D, V>(s, turn[axis]);
    }
    int entry = 0;
#pragma GCC unroll 3
    for (int axis = 0; axis < 3; ++axis) {
      V q[kStresses];
      symmetric_stress<D, Real, V>(turn[axis], lambda, mu, Real(0), q);
#pragma GCC unroll 3
      for (int other = axis; other < 3; ++other, ++entry) turn_turn[entry] += scale * stress_work<D, V>(q, turn[other]);
#pragma GCC unroll 6
      for (int i = 0; i < kStresses; ++i) L::store(&block.stress[1 + axis][i][lane], q[i]);
    }
  }
}

// Rows whose squares make the stiffness, and the work of `Loads` stresses on every mode: `Width` modes from `column` on,
// of a column of `Stride` modes.
//
// Membranes: three scaled strains, added. Tetrahedra: with T = R^T G and R orthogonal,
// 2 mu sym T : sym T = 2 mu G : G - mu sum of squares of the three T_ij - T_ji, and the sum of the first over all
// elements never changes (`constant_stiffness`); so the scaled trace is added and three rows are subtracted.
template <int M, int D, int Loads, int Width, int Stride, class Real>
inline void rows_of_block(const Real* gradient, const Real* trace_scale, const ElementBlock<D, Real>& block, int lanes,
                          int column, Real (*added)[kRowStride<M>], Real (*subtracted)[kRowStride<M>], Real (*work)[M]) {
  using L = Lanes<Real, Width * sizeof(Real)>;
  using V = typename L::type;
  constexpr int kRows = 3 * D;
  V sum[Loads];
#pragma GCC unroll 4
  for (int i = 0; i < Loads; ++i) sum[i] = L::load(&work[i][column]);
  for (int l = 0; l < lanes; ++l) {
    V g[kRows], t[D][D];
#pragma GCC unroll 9
    for (int i = 0; i < kRows; ++i) g[i] = L::load(gradient + (l * kRows + i) * Stride);
#pragma GCC unroll 3
    for (int i = 0; i < D; ++i)
#pragma GCC unroll 3
      for (int j = 0; j < D; ++j)
        t[i][j] = block.rotation[i][l] * g[j] + block.rotation[D + i][l] * g[D + j] + block.rotation[2 * D + i][l] * g[2 * D + j];
    const V shear = t[0][1] + t[1][0];
#pragma GCC unroll 4
    for (int load = 0; load < Loads; ++load) {
      const auto& s = block.stress[load];
      sum[load] += s[0][l] * t[0][0];
      sum[load] += s[1][l] * t[1][1];
      sum[load] += s[D][l] * shear;
    }
    if constexpr (D == 3) {
      const V shear_02 = t[0][2] + t[2][0], shear_12 = t[1][2] + t[2][1];
#pragma GCC unroll 4
      for (int load = 0; load < Loads; ++load) {
        const auto& s = block.stress[load];
        sum[load] += s[2][l] * t[2][2];
        sum[load] += s[4][l] * shear_02;
        sum[load] += s[5][l] * shear_12;
      }
      L::store(&added[l][column], trace_scale[l] * (t[0][0] + t[1][1] + t[2][2]));
      L::store(&subtracted[l][column], t[0][1] - t[1][0]);
      L::store(&subtracted[lanes + l][column], t[0][2] - t[2][0]);
      L::store(&subtracted[2 * lanes + l][column], t[1][2] - t[2][1]);
    } else {
      const V trace = trace_scale[l] * (t[0][0] + t[1][1]);
      L::store(&added[l][column], t[0][0] + trace);
      L::store(&added[lanes + l][column], t[1][1] + trace);
      L::store(&added[2 * lanes + l][column], Real(0.7071067811865476) * shear);
    }
  }
#pragma GCC unroll 4
  for (int i = 0; i < Loads; ++i) L::store(&work[i][column], sum[i]);
}

// Adds one family's contribution; `work`: of the stress and of the stresses of three turns, on every mode.
template <int M, int D, int Loads, class Real>
void add_family(const ElementFamily<Real>& family, const Real* alpha, bool edge_rotations, Real (*work)[M],
                ElementSystem<M, Real>& system) {
  using V = typename RegisterLanes<Real>::type;
  constexpr int kRows = 3 * D;
  V moment[3] = {}, turn_turn[6] = {};
  alignas(64) Real added[D == 3 ? kLane : 3 * kLane][kRowStride<M>];
  alignas(64) Real subtracted[D == 3 ? 3 * kLane : 1][kRowStride<M>];
  ElementBlock<D, Real> block;
  for (int number = 0; number < family.block_count; ++number) {
    deform_block<M, D, Real, V>(family, number, alpha, edge_rotations, Loads > 1, block, moment, turn_turn);
    const Real* gradient = family.gradient_modes + long(number) * kLane * kRows * M;
    const Real* trace_scale = family.trace_scale + number * kLane;
    const int lanes = number + 1 < family.block_count ? kLane : family.last_count;
    for_columns<M, kLane * kRows, Real>(gradient, [&](auto width, auto stride, const Real* from, int column) {
      rows_of_block<M, D, Loads, width(), stride(), Real>(from, trace_scale, block, lanes, column, added, subtracted, work);
    });
    add_outer_products<true, M>(added, D == 3 ? lanes : 3 * lanes, system.stiffness);
    if constexpr (D == 3) add_outer_products<false, M>(subtracted, 3 * lanes, system.stiffness);
  }
  if constexpr (Loads > 1) {
    static const int kEntry[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
    Real total[6] = {0, 0, 0, 0, 0, 0};
    for (int l = 0; l < RegisterLanes<Real>::count; ++l) {
      for (int a = 0; a < 3; ++a) system.moment[a] += moment[a][l];
      for (int e = 0; e < 6; ++e) total[e] += turn_turn[e][l];
    }
    for (int i = 0; i < 9; ++i) system.turn_turn_stiffness[i] += total[kEntry[i]];
  }
}

// Adds a family of whichever law.
template <int M, int D, int Loads, class Real>
inline void add_elements(const ElementFamily<Real>& family, const Real* alpha, bool edge_rotations, Real (*work)[M],
                         ElementSystem<M, Real>& system) {
  if (family.law == kCorotational)
    add_family<M, D, Loads, Real>(family, alpha, edge_rotations, work, system);
  else
    add_hyperelastic<M, D, (Loads > 1), Real>(family, alpha, work, system.stiffness, system.turn_turn_stiffness);
}

template <int M, int Loads, class Real>
void element_system_of(const Part<Real>& part, const Real* alpha, bool edge_rotations, ElementSystem<M, Real>& system) {
  alignas(64) Real work[4][M] = {};
  add_elements<M, 3, Loads, Real>(part.tetrahedra, alpha, edge_rotations, work, system);
  add_elements<M, 2, Loads, Real>(part.membranes, alpha, edge_rotations, work, system);
  for (int a = 0; a < M; ++a) {
    system.force[a] = -work[0][a];
    for (int axis = 0; axis < 3; ++axis) system.turn_stiffness[axis][a] = work[1 + axis][a];
  }
}

// Forces and stiffness of one part at the modal coordinates `alpha`; with `turning` also the three columns of turns.
template <int M, class Real>
void element_system(const Part<Real>& part, const double* alpha, bool edge_rotations, bool turning,
                    ElementSystem<M, Real>& system) {
  __builtin_memset(&system, 0, sizeof(system));
  alignas(64) Real coordinates[M];
  for (int a = 0; a < M; ++a) coordinates[a] = Real(alpha[a]);
  for (int a = 0; a < M; ++a)
    for (int b = 0; b < M; ++b) system.stiffness[a][b] = part.constant_stiffness[a * M + b];
  if (turning)
    element_system_of<M, 4, Real>(part, coordinates, edge_rotations, system);
  else
    element_system_of<M, 1, Real>(part, coordinates, edge_rotations, system);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
