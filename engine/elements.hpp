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
template <int D, class Real>
inline void edge_rotation(const Real f[3 * D][kLane], Real r[3 * D][kLane]) {
#pragma omp simd
  for (int l = 0; l < kLane; ++l) {
    const Real ax = f[0][l], ay = f[D][l], az = f[2 * D][l];
    const Real bx = f[1][l], by = f[D + 1][l], bz = f[2 * D + 1][l];
    const Real ia = Real(1) / std::sqrt(ax * ax + ay * ay + az * az);
    const Real x0 = ax * ia, x1 = ay * ia, x2 = az * ia;
    Real z0 = ay * bz - az * by, z1 = az * bx - ax * bz, z2 = ax * by - ay * bx;
    const Real iz = Real(1) / std::sqrt(z0 * z0 + z1 * z1 + z2 * z2);
    z0 *= iz, z1 *= iz, z2 *= iz;
    r[0][l] = x0, r[D][l] = x1, r[2 * D][l] = x2;
    r[1][l] = z1 * x2 - z2 * x1, r[D + 1][l] = z2 * x0 - z0 * x2, r[2 * D + 1][l] = z0 * x1 - z1 * x0;
    if (D == 3) r[2][l] = z0, r[D + 2][l] = z1, r[2 * D + 2][l] = z2;
  }
}

// Polar factor: Newton's iteration R <- (R + R^-T)/2 (Higham 1986) in space; closed form in the plane.
template <int D, class Real>
inline void polar_rotation(const Real f[3 * D][kLane], Real r[3 * D][kLane]) {
  if (D == 2) {
    Real frame[6][kLane];
    edge_rotation<2, Real>(reinterpret_cast<const Real(*)[kLane]>(f), frame);
#pragma omp simd
    for (int l = 0; l < kLane; ++l) {
      Real g[4] = {0, 0, 0, 0};
      for (int i = 0; i < 3; ++i) {
        g[0] += frame[2 * i][l] * f[D * i][l], g[1] += frame[2 * i][l] * f[D * i + 1][l];
        g[2] += frame[2 * i + 1][l] * f[D * i][l], g[3] += frame[2 * i + 1][l] * f[D * i + 1][l];
      }
      const Real c = g[0] + g[3], s = g[2] - g[1], inverse = Real(1) / std::sqrt(c * c + s * s);
      for (int i = 0; i < 3; ++i) {
        r[D * i][l] = (frame[2 * i][l] * c + frame[2 * i + 1][l] * s) * inverse;
        r[D * i + 1][l] = (frame[2 * i + 1][l] * c - frame[2 * i][l] * s) * inverse;
      }
    }
    return;
  }
  const int iterations = sizeof(Real) == 8 ? 9 : 7;
#pragma omp simd
  for (int l = 0; l < kLane; ++l) {
    Real q[9];
    for (int i = 0; i < 9; ++i) q[i] = f[i < 3 * D ? i : 0][l];
    for (int k = 0; k < iterations; ++k) {
      Real c[9];
      c[0] = q[4] * q[8] - q[5] * q[7], c[1] = q[5] * q[6] - q[3] * q[8], c[2] = q[3] * q[7] - q[4] * q[6];
      c[3] = q[2] * q[7] - q[1] * q[8], c[4] = q[0] * q[8] - q[2] * q[6], c[5] = q[1] * q[6] - q[0] * q[7];
      c[6] = q[1] * q[5] - q[2] * q[4], c[7] = q[2] * q[3] - q[0] * q[5], c[8] = q[0] * q[4] - q[1] * q[3];
      const Real inverse = Real(1) / (q[0] * c[0] + q[1] * c[1] + q[2] * c[2]);
      for (int i = 0; i < 9; ++i) q[i] = Real(0.5) * (q[i] + c[i] * inverse);
    }
    for (int i = 0; i < 3 * D; ++i) r[i][l] = q[i];
  }
}

// Adds one family's contribution.
template <int M, int D, class Real>
void add_family(const ElementFamily<Real>& family, const Real* alpha, bool edge_rotations, bool turning,
                ElementSystem<M, Real>& system) {
  using L = Lanes<Real>;
  using V = typename L::type;
  constexpr int kVectors = M * int(sizeof(Real)) / 64;  // vectors in a row of modes
  constexpr int kStrains = D == 3 ? 6 : 3;
  constexpr int kRows = 3 * D;
  static_assert(kVectors * 64 == M * int(sizeof(Real)), "rows must be whole vectors");

  V force[kVectors] = {};
  alignas(64) Real moment[3][kLane] = {}, turn_turn[6][kLane] = {};

  for (int block = 0; block < family.block_count; ++block) {
    alignas(64) Real f[kRows][kLane], r[kRows][kLane], p[kRows][kLane];
    alignas(64) Real turn[3][kStrains][kLane];
    // Deformation gradient, lanes over elements.
    {
      const Real* rest = family.rest + long(block) * kRows * kLane;
      const Real* gradient = family.gradient_lanes + long(block) * kRows * M * kLane;
      for (int row = 0; row < kRows; ++row) {
        constexpr int kPieces = kLane * int(sizeof(Real)) / 64;
        V sum[kPieces];
        for (int s = 0; s < kPieces; ++s) sum[s] = load(rest + row * kLane + s * L::count);
        for (int a = 0; a < M; ++a) {
          const V coordinate = broadcast(alpha[a]);
          for (int s = 0; s < kPieces; ++s)
            sum[s] += coordinate * load(gradient + (row * M + a) * kLane + s * L::count);
        }
        for (int s = 0; s < kPieces; ++s) store(&f[row][s * L::count], sum[s]);
      }
    }
    if (edge_rotations)
      edge_rotation<D, Real>(f, r);
    else
      polar_rotation<D, Real>(f, r);
    // Stress and moment.
    const Real* lambda = family.lambda + block * kLane;
    const Real* mu = family.mu + block * kLane;
#pragma omp simd
    for (int l = 0; l < kLane; ++l) {
      Real t[D][D], stress[D][D], trace = 0;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          t[i][j] = 0;
          for (int k = 0; k < 3; ++k) t[i][j] += r[k * D + i][l] * f[k * D + j][l];
        }
      for (int i = 0; i < D; ++i) trace += t[i][i] - Real(1);
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          stress[i][j] = mu[l] * (t[i][j] + t[j][i]);
          if (i == j) stress[i][j] += lambda[l] * trace - Real(2) * mu[l];
        }
      for (int k = 0; k < 3; ++k)
        for (int j = 0; j < D; ++j) {
          Real sum = 0;
          for (int i = 0; i < D; ++i) sum += r[k * D + i][l] * stress[i][j];
          p[k * D + j][l] = sum;
        }
    }
    if (turning) {
#pragma omp simd
      for (int l = 0; l < kLane; ++l) {
        for (int axis = 0; axis < 3; ++axis) {
          const int i1 = (axis + 1) % 3, i2 = (axis + 2) % 3;
          Real sum = 0;
          for (int j = 0; j < D; ++j) sum += p[i2 * D + j][l] * f[i1 * D + j][l] - p[i1 * D + j][l] * f[i2 * D + j][l];
          moment[axis][l] -= sum;
          // Gradient of a turn about `axis`: rows i1 and i2 are -F_i2 and F_i1.
          Real t[D][D];
          for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j)
              t[i][j] = r[i2 * D + i][l] * f[i1 * D + j][l] - r[i1 * D + i][l] * f[i2 * D + j][l];
          if (D == 3) {
            turn[axis][0][l] = t[0][0], turn[axis][1][l] = t[1][1], turn[axis][2 % kStrains][l] = t[2 % D][2 % D];
            turn[axis][3 % kStrains][l] = t[0][1] + t[1][0];
            turn[axis][4 % kStrains][l] = t[0][2 % D] + t[2 % D][0];
            turn[axis][5 % kStrains][l] = t[1][2 % D] + t[2 % D][1];
          } else {
            turn[axis][0][l] = t[0][0], turn[axis][1][l] = t[1][1], turn[axis][2][l] = t[0][1] + t[1][0];
          }
        }
        // Scale strains so that stiffness is a plain sum of squares.
        const Real shear = std::sqrt(mu[l]);
        const Real root = shear * Real(1.4142135623730951);
        const Real bulk = (std::sqrt(Real(D) * lambda[l] + Real(2) * mu[l]) - root) / Real(D);
        for (int axis = 0; axis < 3; ++axis) {
          Real trace = 0;
          for (int i = 0; i < D; ++i) trace += turn[axis][i][l];
          for (int i = 0; i < D; ++i) turn[axis][i][l] = root * turn[axis][i][l] + bulk * trace;
          for (int i = D; i < kStrains; ++i) turn[axis][i][l] *= shear;
        }
        int entry = 0;
        for (int a = 0; a < 3; ++a)
          for (int b = a; b < 3; ++b, ++entry)
            for (int i = 0; i < kStrains; ++i) turn_turn[entry][l] += turn[a][i][l] * turn[b][i][l];
      }
    }
    // Scaled strain of every mode, lanes over modes.
    alignas(64) Real strain[kLane][kStrains][M];
    for (int l = 0; l < kLane; ++l) {
      const Real* g = family.gradient_modes + (long(block) * kLane + l) * kRows * M;
      const Real shear_scale = family.shear_root[block * kLane + l];
      const Real trace_scale = family.trace_root[block * kLane + l];
      const Real half_root = shear_scale * Real(0.7071067811865476);  // sqrt(mu)
      for (int v = 0; v < kVectors; ++v) {
        V column[kRows];
        for (int i = 0; i < kRows; ++i) {
          column[i] = load(g + i * M + v * L::count);
          force[v] -= p[i][l] * column[i];
        }
        V t[D][D];
        for (int i = 0; i < D; ++i)
          for (int j = 0; j < D; ++j)
            t[i][j] = r[i][l] * column[j] + r[D + i][l] * column[D + j] + r[2 * D + i][l] * column[2 * D + j];
        V trace = t[0][0] + t[1][1];
        if (D == 3) trace += t[D - 1][D - 1];
        trace *= trace_scale;
        for (int i = 0; i < D; ++i) store(&strain[l][i][v * L::count], shear_scale * t[i][i] + trace);
        int row = D;
        for (int i = 0; i < D; ++i)
          for (int j = i + 1; j < D; ++j, ++row)
            store(&strain[l][row][v * L::count], half_root * (t[i][j] + t[j][i]));
      }
    }
    // Stiffness: sum of squares of scaled strains, tiles of eight rows kept in registers.
    constexpr int kTile = 8;
    for (int tile = 0; tile < M; tile += kTile) {
      V sum[kTile][kVectors];
      for (int a = 0; a < kTile; ++a)
        for (int v = 0; v < kVectors; ++v) sum[a][v] = load(&system.stiffness[tile + a][v * L::count]);
      for (int l = 0; l < kLane; ++l)
        for (int i = 0; i < kStrains; ++i) {
          const Real* row = strain[l][i];
          V right[kVectors];
          for (int v = 0; v < kVectors; ++v) right[v] = load(row + v * L::count);
#pragma GCC unroll 8
          for (int a = 0; a < kTile; ++a) {
            const V left = broadcast(row[tile + a]);
            for (int v = 0; v < kVectors; ++v) sum[a][v] += left * right[v];
          }
        }
      for (int a = 0; a < kTile; ++a)
        for (int v = 0; v < kVectors; ++v) store(&system.stiffness[tile + a][v * L::count], sum[a][v]);
    }
    if (turning) {
      V sum[3][kVectors];
      for (int a = 0; a < 3; ++a)
        for (int v = 0; v < kVectors; ++v) sum[a][v] = load(&system.turn_stiffness[a][v * L::count]);
      for (int l = 0; l < kLane; ++l)
        for (int i = 0; i < kStrains; ++i)
          for (int a = 0; a < 3; ++a)
            for (int v = 0; v < kVectors; ++v) sum[a][v] += turn[a][i][l] * load(&strain[l][i][v * L::count]);
      for (int a = 0; a < 3; ++a)
        for (int v = 0; v < kVectors; ++v) store(&system.turn_stiffness[a][v * L::count], sum[a][v]);
    }
  }

  for (int v = 0; v < kVectors; ++v)
    store(&system.force[v * L::count], load(&system.force[v * L::count]) + force[v]);
  if (turning) {
    static const int kEntry[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
    Real total[6] = {0, 0, 0, 0, 0, 0};
    for (int l = 0; l < kLane; ++l) {
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
