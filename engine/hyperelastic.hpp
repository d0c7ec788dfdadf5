// Internal force and stiffness of sampled elements whose law is an energy of the principal stretches.
//
// With F affine in the modal coordinates as in elements.hpp, the force on mode a is -P(F) : G_a and the
// stiffness sum_i s_i(G_a) s_i(G_b) with rows s of a factor, S^T S = C. The factor stands for
//   published damping: dP/dF with negative eigenvalues set to zero. For an energy of the principal
//     stretches its eigenvectors are known (Smith, de Goes and Kim, Analytic Eigensystems for Isotropic
//     Distortion Energies, ACM Trans. Graph. 38 (2019); Stable Neo-Hookean Flesh Simulation, 2018):
//     dyads of U and V, of which only those of the stretches themselves take a D x D eigenproblem;
//   objective damping: the rate of Green's strain, sym(F^T dF), in Hooke's law.
// Such forces have no moment, so the hub feels them through the modes alone; under published damping the
// stiffness couples modes and turns of the hub, as in elements.hpp.
#pragma once
#include "model.hpp"
#include "principal_stretches.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

template <int M, class Real>
struct ElementSystem;

// Second derivatives of an energy by the principal stretches, over mu: `scaling` by two of them; for the
// pair of stretches other than `k` (for D = 2 the only pair, k = 0) the eigenvalues of dP/dF on the
// antisymmetric (`twist`) and the symmetric (`flip`) dyad; for D = 2 `across`, on dyads with the normal.
template <int D, class V>
struct PrincipalTangent {
  V scaling[D][D];
  V twist[D == 3 ? 3 : 1], flip[D == 3 ? 3 : 1];
  V across[D];
};

// psi / mu = |F|^2 / 2 - J + r / 2 (J - 1)^2 with r = 1 + lambda / mu; a sheet is stretched across by t,
// where its energy is least (pneumorph/fem/stable_neo_hookean.py).
template <int D, class Real>
struct StableNeoHookean {
  Real bulk;  // r

  explicit StableNeoHookean(Real lambda_over_mu)
      // A membrane's lambda is that of plane stress, 2 lambda mu / (lambda + 2 mu).
      : bulk(1 + (D == 3 ? lambda_over_mu : 2 * lambda_over_mu / (2 - lambda_over_mu))) {}

  template <class V>
  V stretch_across(V area) const { return area * (1 + bulk) / (1 + bulk * area * area); }
  template <class V>
  V area_stress(V area) const {
    const V t = stretch_across(area);
    return t * (bulk * (area * t - 1) - 1);
  }

  template <class V>
  void stress(const V f[3 * D], V p[3 * D]) const {
    V columns[D][3], cofactor[D][3];  // of F, and of dJ/dF (or of the derivative of the area)
    for (int a = 0; a < D; ++a)
      for (int k = 0; k < 3; ++k) columns[a][k] = f[k * D + a];
    V factor;
    if constexpr (D == 3) {
      for (int a = 0; a < 3; ++a) cross_lanes(columns[(a + 1) % 3], columns[(a + 2) % 3], cofactor[a]);
      const V volume =
          columns[0][0] * cofactor[0][0] + columns[0][1] * cofactor[0][1] + columns[0][2] * cofactor[0][2];
      factor = bulk * (volume - 1) - 1;
    } else {
      V normal[3];
      cross_lanes(columns[0], columns[1], normal);
      const V area = root_lanes<Real>(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
      for (int k = 0; k < 3; ++k) normal[k] /= area;
      cross_lanes(columns[1], normal, cofactor[0]);
      cross_lanes(normal, columns[0], cofactor[1]);
      factor = area_stress(area);
    }
    for (int a = 0; a < D; ++a)
      for (int k = 0; k < 3; ++k) p[k * D + a] = columns[a][k] + factor * cofactor[a][k];
  }

  template <class V>
  PrincipalTangent<D, V> tangent(const V s[D]) const {
    PrincipalTangent<D, V> result;
    if constexpr (D == 3) {
      const V factor = bulk * (s[0] * s[1] * s[2] - 1) - 1;
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        result.scaling[i][i] = 1 + bulk * s[j] * s[j] * s[k] * s[k];
        result.scaling[i][j] = result.scaling[j][i] = s[k] * (factor + bulk * s[i] * s[j] * s[k]);
        result.twist[i] = 1 + factor * s[i];
        result.flip[i] = 1 - factor * s[i];
      }
    } else {
      const V area = s[0] * s[1], across = stretch_across(area), slope = area_stress(area);
      const V soft = 1 + bulk * area * area;
      const V rate = (1 + bulk) * (1 - bulk * area * area) / (soft * soft);
      const V curvature = bulk * across * across + (2 * bulk * area * across - bulk - 1) * rate;
      for (int i = 0; i < 2; ++i) {
        result.scaling[i][i] = 1 + curvature * s[1 - i] * s[1 - i];
        result.across[i] = 1 + slope * s[1 - i] / s[i];
      }
      result.scaling[0][1] = result.scaling[1][0] = slope + curvature * area;
      result.twist[0] = 1 + slope;
      result.flip[0] = 1 - slope;
    }
    return result;
  }
};

// psi / mu = r / 2 tr(E)^2 + E : E with E = (F^T F - I) / 2 and r = lambda / mu.
template <int D, class Real>
struct StVenantKirchhoff {
  Real ratio;  // r

  explicit StVenantKirchhoff(Real lambda_over_mu) : ratio(lambda_over_mu) {}

  template <class V>
  void stress(const V f[3 * D], V p[3 * D]) const {
    V strain[D][D], trace = V{};
    for (int a = 0; a < D; ++a) {
      for (int b = 0; b < D; ++b)
        strain[a][b] = f[a] * f[b] + f[D + a] * f[D + b] + f[2 * D + a] * f[2 * D + b] - Real(a == b);
      trace += Real(0.5) * strain[a][a];
    }
    for (int a = 0; a < D; ++a) strain[a][a] += ratio * trace;  // now the second stress
    for (int k = 0; k < 3; ++k)
      for (int b = 0; b < D; ++b) {
        p[k * D + b] = V{};
        for (int a = 0; a < D; ++a) p[k * D + b] += f[k * D + a] * strain[a][b];
      }
  }

  template <class V>
  PrincipalTangent<D, V> tangent(const V s[D]) const {
    PrincipalTangent<D, V> result;
    V pressure = V{};
    for (int i = 0; i < D; ++i) pressure += Real(0.5) * ratio * (s[i] * s[i] - 1);
    for (int i = 0; i < D; ++i) {
      const V stress = pressure + s[i] * s[i] - 1;  // over the stretch
      for (int j = 0; j < D; ++j) result.scaling[i][j] = ratio * s[i] * s[j];
      result.scaling[i][i] += stress + 2 * s[i] * s[i];
      result.across[i] = stress;
    }
    for (int k = 0; k < (D == 3 ? 3 : 1); ++k) {
      const V& a = s[D == 3 ? (k + 1) % 3 : 0];
      const V& b = s[D == 3 ? (k + 2) % 3 : 1];
      result.twist[k] = pressure + a * a - a * b + b * b - 1;
      result.flip[k] = pressure + a * a + a * b + b * b - 1;
    }
    return result;
  }
};

// Root of a weighted eigenvalue, zero where it is negative.
template <class Real, class V>
inline V root_of_positive(V value) {
  return root_lanes<Real>(value > 0 ? value : V{});
}

// Rows of S with S^T S = dP/dF without its negative eigenvalues, times the weighted mu.
template <int D, class Real, class V>
inline void definite_factor(const PrincipalStretches<D, V>& f, PrincipalTangent<D, V>& tangent, V mu,
                            V factor[3 * D][3 * D]) {
  int row = 0;
  auto add_dyad = [&](int to, V size, const V left[3], const V right[D]) {
    for (int k = 0; k < 3; ++k)
      for (int r = 0; r < D; ++r) factor[to][k * D + r] += size * left[k] * right[r];
  };
  for (int i = 0; i < 3 * D; ++i)
    for (int j = 0; j < 3 * D; ++j) factor[i][j] = V{};
  V vectors[D][D];
  eigenvectors<D, Real>(tangent.scaling, vectors);
  for (int e = 0; e < D; ++e, ++row) {
    const V size = root_of_positive<Real>(mu * tangent.scaling[e][e]);
    for (int i = 0; i < D; ++i) add_dyad(row, size * vectors[i][e], f.left[i], f.right[i]);
  }
  for (int k = 0; k < (D == 3 ? 3 : 1); ++k) {
    const int a = D == 3 ? (k + 1) % 3 : 0, b = D == 3 ? (k + 2) % 3 : 1;
    const V twist = root_of_positive<Real>(Real(0.5) * mu * tangent.twist[k]);
    const V flip = root_of_positive<Real>(Real(0.5) * mu * tangent.flip[k]);
    add_dyad(row, twist, f.left[a], f.right[b]);
    add_dyad(row++, -twist, f.left[b], f.right[a]);
    add_dyad(row, flip, f.left[a], f.right[b]);
    add_dyad(row++, flip, f.left[b], f.right[a]);
  }
  if constexpr (D == 2) {
    V normal[3];
    cross_lanes(f.left[0], f.left[1], normal);
    for (int i = 0; i < 2; ++i) add_dyad(row++, root_of_positive<Real>(mu * tangent.across[i]), normal, f.right[i]);
  }
}

// Rows of S with S^T S the rate of Green's strain in Hooke's law; the roots hold weight and measure.
template <int D, class Real, class V>
inline void objective_factor(const V f[3 * D], V shear_root, V trace_root, V factor[D == 3 ? 6 : 3][3 * D]) {
  const V half_root = shear_root * Real(0.7071067811865476);
  for (int k = 0; k < 3; ++k) {
    int row = D;
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) factor[i][k * D + j] = trace_root * f[k * D + j];
      factor[i][k * D + i] += shear_root * f[k * D + i];
      for (int j = i + 1; j < D; ++j, ++row) {
        for (int r = 0; r < D; ++r) factor[row][k * D + r] = V{};
        factor[row][k * D + i] = half_root * f[k * D + j];
        factor[row][k * D + j] = half_root * f[k * D + i];
      }
    }
  }
}

// Adds one family's contribution; kStrains rows a point.
template <int M, int D, bool kObjective, class Law, class Real>
void add_hyperelastic_family(const ElementFamily<Real>& family, const Law& law, const Real* alpha,
                             ElementSystem<M, Real>& system) {
  using L = Lanes<Real>;
  using V = typename L::type;
  using ML = ModeLanes<M, Real>;
  using MV = typename ML::type;
  constexpr int kVectors = M / ML::count;
  constexpr int kRows = 3 * D;
  constexpr int kStrains = kObjective ? (D == 3 ? 6 : 3) : kRows;
  constexpr int kPieces = kLane * int(sizeof(Real)) / 64;
  MV force[kVectors] = {};
  V turn_turn[6] = {};

  for (int number = 0; number < family.block_count; ++number) {
    alignas(64) Real stress[kRows][kLane], rows[kStrains][kRows][kLane], turn[3][kStrains][kLane];
    for (int piece = 0; piece < kPieces; ++piece) {
      const int lane = piece * L::count, element = number * kLane + lane;
      V f[kRows], p[kRows], factor[kStrains][kRows];
      for (int row = 0; row < kRows; ++row) {
        f[row] = load(family.rest + (long(number) * kRows + row) * kLane + lane);
        const Real* gradient = family.gradient_lanes + (long(number) * kRows + row) * M * kLane + lane;
        for (int a = 0; a < M; ++a) f[row] += alpha[a] * load(gradient + a * kLane);
      }
      const V mu = load(family.mu + element);
      law.stress(f, p);
      for (int row = 0; row < kRows; ++row) store(&stress[row][lane], mu * p[row]);
      if constexpr (kObjective) {
        objective_factor<D, Real>(f, load(family.shear_root + element), load(family.trace_root + element), factor);
      } else {
        const PrincipalStretches<D, V> stretches = principal_stretches<D, Real>(f);
        PrincipalTangent<D, V> tangent = law.tangent(stretches.stretch);
        definite_factor<D, Real>(stretches, tangent, mu, factor);
        // A turn of the hub about an axis of the part's frame has the gradient [e]x F.
        V strain[3][kStrains];
        for (int axis = 0; axis < 3; ++axis) {
          const int i1 = (axis + 1) % 3, i2 = (axis + 2) % 3;
          for (int i = 0; i < kStrains; ++i) {
            strain[axis][i] = V{};
            for (int j = 0; j < D; ++j)
              strain[axis][i] += factor[i][i2 * D + j] * f[i1 * D + j] - factor[i][i1 * D + j] * f[i2 * D + j];
            store(&turn[axis][i][lane], strain[axis][i]);
          }
        }
        int entry = 0;
        for (int a = 0; a < 3; ++a)
          for (int b = a; b < 3; ++b, ++entry)
            for (int i = 0; i < kStrains; ++i) turn_turn[entry] += strain[a][i] * strain[b][i];
      }
      for (int i = 0; i < kStrains; ++i)
        for (int row = 0; row < kRows; ++row) store(&rows[i][row][lane], factor[i][row]);
    }
    // Scaled strain of every mode, lanes over modes.
    alignas(64) Real strain[kLane][kStrains][M];
    for (int l = 0; l < kLane; ++l) {
      const Real* g = family.gradient_modes + (long(number) * kLane + l) * kRows * M;
      for (int v = 0; v < kVectors; ++v) {
        MV column[kRows];
        for (int i = 0; i < kRows; ++i) {
          column[i] = ML::load(g + i * M + v * ML::count);
          force[v] -= stress[i][l] * column[i];
        }
        for (int i = 0; i < kStrains; ++i) {
          MV sum = rows[i][0][l] * column[0];
          for (int r = 1; r < kRows; ++r) sum += rows[i][r][l] * column[r];
          ML::store(&strain[l][i][v * ML::count], sum);
        }
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
    if constexpr (!kObjective)
      for (int axis = 0; axis < 3; ++axis)
        for (int v = 0; v < kVectors; ++v) {
          MV sum = ML::load(&system.turn_stiffness[axis][v * ML::count]);
          for (int l = 0; l < kLane; ++l)
            for (int i = 0; i < kStrains; ++i) sum += turn[axis][i][l] * ML::load(&strain[l][i][v * ML::count]);
          ML::store(&system.turn_stiffness[axis][v * ML::count], sum);
        }
  }

  for (int v = 0; v < kVectors; ++v)
    ML::store(&system.force[v * ML::count], ML::load(&system.force[v * ML::count]) + force[v]);
  if constexpr (!kObjective) {
    static const int kEntry[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
    for (int i = 0; i < 9; ++i)
      for (int l = 0; l < L::count; ++l) system.turn_turn_stiffness[i] += turn_turn[kEntry[i]][l];
  }
}

// The family's law; published damping unless `objective`.
template <int M, int D, class Real>
void add_hyperelastic(const ElementFamily<Real>& family, const Real* alpha, bool objective,
                      ElementSystem<M, Real>& system) {
  auto add = [&](const auto& law) {
    if (objective)
      add_hyperelastic_family<M, D, true>(family, law, alpha, system);
    else
      add_hyperelastic_family<M, D, false>(family, law, alpha, system);
  };
  if (family.law == kStableNeoHookean)
    add(StableNeoHookean<D, Real>(family.lambda_over_mu));
  else
    add(StVenantKirchhoff<D, Real>(family.lambda_over_mu));
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
