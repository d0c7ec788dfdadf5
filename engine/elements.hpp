// Internal force and rotated stiffness of the sampled elements of one reduced part.
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

#include "lanes.hpp"
#include "model.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

template <int M, class Real>
struct ElementSystem {
  alignas(64) Real force[M];
  alignas(64) Real stiffness[M][M];
  alignas(64) Real turn_stiffness[3][M];  // rotation of the hub against modes
  Real turn_turn_stiffness[9];
  Real moment[3];                          // of the internal forces about the part's origin
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

// Polar factor: Newton's iteration R <- (R + R^-T)/2 (Higham 1986) in space; closed form in the plane.
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
    const int iterations = sizeof(Real) == 8 ? 9 : 7;
    for (int k = 0; k < iterations; ++k) {
      V c[9];
      c[0] = q[4] * q[8] - q[5] * q[7], c[1] = q[5] * q[6] - q[3] * q[8], c[2] = q[3] * q[7] - q[4] * q[6];
      c[3] = q[2] * q[7] - q[1] * q[8], c[4] = q[0] * q[8] - q[2] * q[6], c[5] = q[1] * q[6] - q[0] * q[7];
      c[6] = q[1] * q[5] - q[2] * q[4], c[7] = q[2] * q[3] - q[0] * q[5], c[8] = q[0] * q[4] - q[1] * q[3];
      const V inverse = Real(1) / (q[0] * c[0] + q[1] * c[1] + q[2] * c[2]);
      for (int i = 0; i < 9; ++i) q[i] = Real(0.5) * (q[i] + c[i] * inverse);
    }
    for (int i = 0; i < 9; ++i) r[i] = q[i];
  }
}

// What a piece of a block, elements side by side, hands to the stages that run over modes.
template <int D, class Real>
struct ElementBlock {
  static constexpr int kRows = 3 * D;
  static constexpr int kStrains = D == 3 ? 6 : 3;
  alignas(64) Real rotation[kRows][kLane];
  alignas(64) Real stress[kRows][kLane];           // R s, with weight and measure
  alignas(64) Real turn[3][kStrains][kLane];       // scaled strains of turning about the part's axes
};

// Moment of the internal forces and the scaled strains of turning about each axis: the gradient of a
// turn about axis l has rows l+1 and l+2 equal to -F_(l+2) and F_(l+1).
template <int D, class Real, class V>
inline void turn_about_axes(const V f[3 * D], const V r[3 * D], const V p[3 * D], V shear_scale, V trace_scale,
                            V moment[3], V turn_turn[6], V turn[3][D == 3 ? 6 : 3]) {
  constexpr int kStrains = D == 3 ? 6 : 3;
  const V half_root = shear_scale * Real(0.7071067811865476);
#pragma GCC unroll 3
  for (int axis = 0; axis < 3; ++axis) {
    const int i1 = (axis + 1) % 3, i2 = (axis + 2) % 3;
    V t[D][D];
#pragma GCC unroll 3
    for (int j = 0; j < D; ++j) {
      moment[axis] -= p[i2 * D + j] * f[i1 * D + j] - p[i1 * D + j] * f[i2 * D + j];
#pragma GCC unroll 3
      for (int i = 0; i < D; ++i) t[i][j] = r[i2 * D + i] * f[i1 * D + j] - r[i1 * D + i] * f[i2 * D + j];
    }
    V trace = t[0][0] + t[1][1];
    if constexpr (D == 3) trace += t[2][2];
    trace *= trace_scale;
    int row = D;
#pragma GCC unroll 3
    for (int i = 0; i < D; ++i) {
      turn[axis][i] = shear_scale * t[i][i] + trace;
#pragma GCC unroll 3
      for (int j = i + 1; j < D; ++j) turn[axis][row++] = half_root * (t[i][j] + t[j][i]);
    }
  }
  int entry = 0;
#pragma GCC unroll 3
  for (int a = 0; a < 3; ++a)
#pragma GCC unroll 3
    for (int b = a; b < 3; ++b, ++entry)
#pragma GCC unroll 6
      for (int i = 0; i < kStrains; ++i) turn_turn[entry] += turn[a][i] * turn[b][i];
}

// Adds one family's contribution.
template <int M, int D, class Real>
void add_family(const ElementFamily<Real>& family, const Real* alpha, bool edge_rotations, bool turning,
                ElementSystem<M, Real>& system) {
  using L = Lanes<Real>;
  using V = typename L::type;
  using ML = ModeLanes<M, Real>;
  using MV = typename ML::type;
  constexpr int kVectors = M / ML::count;  // vectors in a row of modes
  constexpr int kStrains = D == 3 ? 6 : 3;
  constexpr int kRows = 3 * D;
  static_assert(kVectors * ML::count == M, "rows must be whole vectors");

  constexpr int kPieces = kLane * int(sizeof(Real)) / 64;  // vectors in a block of elements
  MV force[kVectors] = {};
  V moment[3] = {}, turn_turn[6] = {};

  for (int number = 0; number < family.block_count; ++number) {
    ElementBlock<D, Real> block;
    for (int piece = 0; piece < kPieces; ++piece) {
      const int lane = piece * L::count, element = number * kLane + lane;
      // Deformation gradient.
      V f[kRows], r[kRows], p[kRows];
      for (int row = 0; row < kRows; ++row) {
        f[row] = load(family.rest + (long(number) * kRows + row) * kLane + lane);
        const Real* gradient = family.gradient_lanes + (long(number) * kRows + row) * M * kLane + lane;
        for (int a = 0; a < M; ++a) f[row] += alpha[a] * load(gradient + a * kLane);
      }
      if (edge_rotations)
        edge_rotation<D, Real, V>(f, r);
      else
        polar_rotation<D, Real, V>(f, r);
      // Stress.
      const V lambda = load(family.lambda + element), mu = load(family.mu + element);
      V t[D][D];
#pragma GCC unroll 3
      for (int i = 0; i < D; ++i)
#pragma GCC unroll 3
        for (int j = 0; j < D; ++j) t[i][j] = r[i] * f[j] + r[D + i] * f[D + j] + r[2 * D + i] * f[2 * D + j];
      V trace = t[0][0] + t[1][1] - Real(D);
      if constexpr (D == 3) trace += t[2][2];
      const V pressure = lambda * trace - Real(2) * mu;
#pragma GCC unroll 3
      for (int k = 0; k < 3; ++k)
#pragma GCC unroll 3
        for (int j = 0; j < D; ++j) {
          V sum = r[k * D + j] * pressure;
#pragma GCC unroll 3
          for (int i = 0; i < D; ++i) sum += r[k * D + i] * (mu * (t[i][j] + t[j][i]));
          p[k * D + j] = sum;
        }
      for (int row = 0; row < kRows; ++row) {
        store(&block.rotation[row][lane], r[row]);
        store(&block.stress[row][lane], p[row]);
      }
      if (turning) {
        V turn[3][kStrains];
        turn_about_axes<D, Real, V>(f, r, p, load(family.shear_root + element), load(family.trace_root + element),
                                    moment, turn_turn, turn);
        for (int axis = 0; axis < 3; ++axis)
          for (int i = 0; i < kStrains; ++i) store(&block.turn[axis][i][lane], turn[axis][i]);
      }
    }
    const auto& r = block.rotation;
    const auto& p = block.stress;
    const auto& turn = block.turn;
    // Scaled strain of every mode, lanes over modes.
    alignas(64) Real strain[kLane][kStrains][M];
    for (int l = 0; l < kLane; ++l) {
      const Real* g = family.gradient_modes + (long(number) * kLane + l) * kRows * M;
      const Real shear_scale = family.shear_root[number * kLane + l];
      const Real trace_scale = family.trace_root[number * kLane + l];
      const Real half_root = shear_scale * Real(0.7071067811865476);  // sqrt(mu)
      for (int v = 0; v < kVectors; ++v) {
        MV column[kRows];
        for (int i = 0; i < kRows; ++i) {
          column[i] = ML::load(g + i * M + v * ML::count);
          force[v] -= p[i][l] * column[i];
        }
        MV t[D][D];
        for (int i = 0; i < D; ++i)
          for (int j = 0; j < D; ++j)
            t[i][j] = r[i][l] * column[j] + r[D + i][l] * column[D + j] + r[2 * D + i][l] * column[2 * D + j];
        MV trace = t[0][0] + t[1][1];
        if (D == 3) trace += t[D - 1][D - 1];
        trace *= trace_scale;
        for (int i = 0; i < D; ++i) ML::store(&strain[l][i][v * ML::count], shear_scale * t[i][i] + trace);
        int row = D;
        for (int i = 0; i < D; ++i)
          for (int j = i + 1; j < D; ++j, ++row)
            ML::store(&strain[l][row][v * ML::count], half_root * (t[i][j] + t[j][i]));
      }
    }
    // Stiffness: sum of squares of scaled strains, tiles of eight rows kept in registers.
    constexpr int kTile = 8;
    for (int tile = 0; tile < M; tile += kTile) {
      MV sum[kTile][kVectors];
      for (int a = 0; a < kTile; ++a)
        for (int v = 0; v < kVectors; ++v) sum[a][v] = ML::load(&system.stiffness[tile + a][v * ML::count]);
      for (int l = 0; l < kLane; ++l)
        for (int i = 0; i < kStrains; ++i) {
          const Real* row = strain[l][i];
          MV right[kVectors];
          for (int v = 0; v < kVectors; ++v) right[v] = ML::load(row + v * ML::count);
#pragma GCC unroll 8
          for (int a = 0; a < kTile; ++a) {
            const Real left = row[tile + a];
            for (int v = 0; v < kVectors; ++v) sum[a][v] += left * right[v];
          }
        }
      for (int a = 0; a < kTile; ++a)
        for (int v = 0; v < kVectors; ++v) ML::store(&system.stiffness[tile + a][v * ML::count], sum[a][v]);
    }
    if (turning) {
      MV sum[3][kVectors];
      for (int a = 0; a < 3; ++a)
        for (int v = 0; v < kVectors; ++v) sum[a][v] = ML::load(&system.turn_stiffness[a][v * ML::count]);
      for (int l = 0; l < kLane; ++l)
        for (int i = 0; i < kStrains; ++i)
          for (int a = 0; a < 3; ++a)
            for (int v = 0; v < kVectors; ++v) sum[a][v] += turn[a][i][l] * ML::load(&strain[l][i][v * ML::count]);
      for (int a = 0; a < 3; ++a)
        for (int v = 0; v < kVectors; ++v) ML::store(&system.turn_stiffness[a][v * ML::count], sum[a][v]);
    }
  }

  for (int v = 0; v < kVectors; ++v)
    ML::store(&system.force[v * ML::count], ML::load(&system.force[v * ML::count]) + force[v]);
  if (turning) {
    static const int kEntry[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
    Real total[6] = {0, 0, 0, 0, 0, 0};
    for (int l = 0; l < L::count; ++l) {
      for (int a = 0; a < 3; ++a) system.moment[a] += moment[a][l];
      for (int e = 0; e < 6; ++e) total[e] += turn_turn[e][l];
    }
    for (int i = 0; i < 9; ++i) system.turn_turn_stiffness[i] += total[kEntry[i]];
  }
}

template <int M, class Real>
void element_system(const Part<Real>& part, const double* alpha, bool edge_rotations, bool turning,
                    ElementSystem<M, Real>& system) {
  __builtin_memset(&system, 0, sizeof(system));
  alignas(64) Real coordinates[M];
  for (int a = 0; a < M; ++a) coordinates[a] = Real(alpha[a]);
  add_family<M, 3, Real>(part.tetrahedra, coordinates, edge_rotations, turning, system);
  add_family<M, 2, Real>(part.membranes, coordinates, edge_rotations, turning, system);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
