// Principal stretches of deformation gradients, 3 x D with D = 3 or 2, lane by lane: F = U S V^T, what equation (16) of
// docs/physics.md is written in.
//
// U (3 x D) has orthonormal columns, V is a rotation, and for D = 3 so is U: the last stretch is
// negative where an element is inverted. Eigenvectors come from Jacobi's cyclic rotations, which need no
// branch: every lane makes the same number of sweeps.
#pragma once
#include "lanes.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Turns coordinates p and q of a symmetric matrix so that its entry (p, q) vanishes.
template <int D, class Real, class V>
inline void jacobi_rotation(V matrix[D][D], V vectors[D][D], int p, int q) {
  const V off = matrix[p][q], apart = matrix[q][q] - matrix[p][p];
  const V size = root_lanes<Real>(apart * apart + Real(4) * off * off);
  const V positive = Real(2) * off / ((apart < 0 ? -apart : apart) + size + Real(1e-30));
  const V tangent = apart < 0 ? -positive : positive;
  const V cosine = Real(1) / root_lanes<Real>(Real(1) + tangent * tangent), sine = tangent * cosine;
  matrix[p][p] -= tangent * off;
  matrix[q][q] += tangent * off;
  matrix[p][q] = matrix[q][p] = V{};
  for (int r = 0; r < D; ++r) {
    const V first = vectors[r][p], second = vectors[r][q];
    vectors[r][p] = cosine * first - sine * second;
    vectors[r][q] = sine * first + cosine * second;
    if (r == p || r == q) continue;
    const V a = matrix[r][p], b = matrix[r][q];
    matrix[r][p] = matrix[p][r] = cosine * a - sine * b;
    matrix[r][q] = matrix[q][r] = sine * a + cosine * b;
  }
}

// Eigenvalues (left on the diagonal) and eigenvectors (columns) of a symmetric matrix.
template <int D, class Real, class V>
inline void eigenvectors(V matrix[D][D], V vectors[D][D]) {
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) vectors[i][j] = V{} + Real(i == j);
  if constexpr (D == 2) {
    jacobi_rotation<2, Real>(matrix, vectors, 0, 1);
  } else {
    const int sweeps = sizeof(Real) == 8 ? 6 : 4;  // convergence is quadratic
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      jacobi_rotation<3, Real>(matrix, vectors, 0, 1);
      jacobi_rotation<3, Real>(matrix, vectors, 0, 2);
      jacobi_rotation<3, Real>(matrix, vectors, 1, 2);
    }
  }
}

template <class V>
inline void cross_lanes(const V a[3], const V b[3], V out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

template <int D, class V>
struct PrincipalStretches {
  V left[D][3];   // columns of U
  V right[D][D];  // columns of V
  V stretch[D];
};

template <int D, class Real, class V>
inline PrincipalStretches<D, V> principal_stretches(const V f[3 * D]) {
  PrincipalStretches<D, V> result;
  V squared[D][D], vectors[D][D];
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) squared[a][b] = f[a] * f[b] + f[D + a] * f[D + b] + f[2 * D + a] * f[2 * D + b];
  eigenvectors<D, Real>(squared, vectors);
  // The largest first: the left vectors of the first two are then found without cancellation.
  for (int pass = 0; pass < D; ++pass)
    for (int a = 0; a + 1 < D; ++a) {
      const auto swap = squared[a][a] < squared[a + 1][a + 1];
      const V value = squared[a][a];
      squared[a][a] = swap ? squared[a + 1][a + 1] : value;
      squared[a + 1][a + 1] = swap ? value : squared[a + 1][a + 1];
      for (int r = 0; r < D; ++r) {
        const V entry = vectors[r][a];
        vectors[r][a] = swap ? vectors[r][a + 1] : entry;
        vectors[r][a + 1] = swap ? entry : vectors[r][a + 1];
      }
    }
  for (int a = 0; a < D; ++a)
    for (int r = 0; r < D; ++r) result.right[a][r] = vectors[r][a];
  if constexpr (D == 3)
    cross_lanes(result.right[0], result.right[1], result.right[2]);
  else
    result.right[1][0] = -result.right[0][1], result.right[1][1] = result.right[0][0];
  V image[D][3];  // F V
  for (int a = 0; a < D; ++a)
    for (int k = 0; k < 3; ++k) {
      image[a][k] = V{};
      for (int r = 0; r < D; ++r) image[a][k] += f[k * D + r] * result.right[a][r];
    }
  auto dot = [](const V* a, const V* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  result.stretch[0] = root_lanes<Real>(dot(image[0], image[0]));
  for (int k = 0; k < 3; ++k) result.left[0][k] = image[0][k] / (result.stretch[0] + Real(1e-30));
  const V along = dot(result.left[0], image[1]);
  for (int k = 0; k < 3; ++k) image[1][k] -= along * result.left[0][k];
  result.stretch[1] = root_lanes<Real>(dot(image[1], image[1]));
  for (int k = 0; k < 3; ++k) result.left[1][k] = image[1][k] / (result.stretch[1] + Real(1e-30));
  if constexpr (D == 3) {
    cross_lanes(result.left[0], result.left[1], result.left[2]);
    result.stretch[2] = dot(result.left[2], image[2]);
  }
  return result;
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
