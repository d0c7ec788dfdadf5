// Internal force and stiffness of sampled elements whose law is an energy of the principal stretches: equations (4), (5),
// (10), (14) to (16) and (22) of docs/physics.md.
//
// With F affine in the modal coordinates as in elements.hpp, the force on mode a is -P(F) : G_a and the
// stiffness sum_i s_i(G_a) s_i(G_b) with rows s of a factor, S^T S = C. The factor stands for
//   published damping: dP/dF with negative eigenvalues set to zero. For an energy of the principal
//     stretches its eigenvectors are known (Smith, de Goes and Kim, Analytic Eigensystems for Isotropic
//     Distortion Energies, ACM Trans. Graph. 38 (2019); Stable Neo-Hookean Flesh Simulation, 2018):
//     dyads of U and V, of which only those of the stretches themselves take a D x D eigenproblem;
//   objective damping: the rate of Green's strain, sym(F^T dF), in Hooke's law.
// Such forces have no moment. Under published damping the stiffness couples modes and turns of the hub, as in
// elements.hpp: a turn about axis l has the gradient [e_l]x F and changes the stress by C [e_l]x F.
#pragma once
#include "model.hpp"
#include "outer_products.hpp"
#include "principal_stretches.hpp"

// Parts of a function that stand alone to be read, or for another function to have them too: in the compiler's eyes always
// one with it, so that it inlines and fuses as if they were written there.
#define PNEUMORPH_INLINE __attribute__((always_inline)) inline

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

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

// Rows of S with S^T S the rate of Green's strain in Hooke's law, lambda = `ratio` mu, times the weighted mu.
template <int D, class Real, class V>
inline void objective_factor(const V f[3 * D], Real ratio, V mu, V factor[D == 3 ? 6 : 3][3 * D]) {
  // Elasticity of normal strains is the square of s (I + q 1 1^T) with s^2 = 2 mu.
  const Real q = (std::sqrt(Real(1) + Real(0.5 * D) * ratio) - 1) / D;
  const V root = root_lanes<Real>(mu), normal = Real(1.4142135623730951) * root;
  for (int k = 0; k < 3; ++k) {
    int row = D;
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) factor[i][k * D + j] = (q + Real(i == j)) * normal * f[k * D + j];
      for (int j = i + 1; j < D; ++j, ++row) {
        for (int r = 0; r < D; ++r) factor[row][k * D + r] = V{};
        factor[row][k * D + i] = root * f[k * D + j];
        factor[row][k * D + j] = root * f[k * D + i];
      }
    }
  }
}

// What the stage with lanes over elements hands to the stage with lanes over modes.
template <int D, bool Published, class Real>
struct HyperelasticBlock {
  static constexpr int kRows = 3 * D;
  static constexpr int kStrains = Published ? kRows : (D == 3 ? 6 : 3);
  static constexpr int kLoads = Published ? 4 : 1;
  alignas(64) Real factor[kStrains][kRows][kLane];
  alignas(64) Real stress[kLoads][kRows][kLane];  // with weight and measure; and its change for turns about the axes
};

// Deformation gradient of the elements from `lane` of a block on; `modes` of them count.
template <int D, class Real>
PNEUMORPH_INLINE void deformation_gradient(const ElementFamily<Real>& family, int number, int lane, int modes, const Real* alpha,
                                 typename RegisterLanes<Real>::type f[3 * D]) {
  using L = RegisterLanes<Real>;
  constexpr int kRows = 3 * D;
  const Real* gradient = family.gradient_lanes + long(number) * kRows * modes * kLane + lane;
  for (int row = 0; row < kRows; ++row) f[row] = L::load(family.rest + (long(number) * kRows + row) * kLane + lane);
  for (int a = 0; a < modes; ++a)
    for (int row = 0; row < kRows; ++row) f[row] += alpha[a] * L::load(gradient + (a * kRows + row) * kLane);
}

// Factor of dP/dF of a law, and what turns change of the stress, into the lanes from `lane` on.
template <int D, class Law, class Real>
PNEUMORPH_INLINE void store_published_factor(const Law& law, const typename RegisterLanes<Real>::type f[3 * D],
                                   typename RegisterLanes<Real>::type mu, int lane,
                                   HyperelasticBlock<D, true, Real>& block,
                                   typename RegisterLanes<Real>::type turn_turn[6]) {
  using L = RegisterLanes<Real>;
  using V = typename L::type;
  constexpr int kRows = 3 * D;
  V factor[kRows][kRows];
  const PrincipalStretches<D, V> stretches = principal_stretches<D, Real>(f);
  PrincipalTangent<D, V> tangent = law.tangent(stretches.stretch);
  definite_factor<D, Real>(stretches, tangent, mu, factor);
  V strain[3][kRows];  // S [e_l]x F
  for (int axis = 0; axis < 3; ++axis) {
    const int i1 = (axis + 1) % 3, i2 = (axis + 2) % 3;
    for (int i = 0; i < kRows; ++i) {
      strain[axis][i] = V{};
      for (int j = 0; j < D; ++j)
        strain[axis][i] += factor[i][i2 * D + j] * f[i1 * D + j] - factor[i][i1 * D + j] * f[i2 * D + j];
    }
    for (int row = 0; row < kRows; ++row) {
      V change = factor[0][row] * strain[axis][0];
      for (int i = 1; i < kRows; ++i) change += factor[i][row] * strain[axis][i];
      L::store(&block.stress[1 + axis][row][lane], change);
    }
  }
  for (int a = 0, entry = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b, ++entry)
      for (int i = 0; i < kRows; ++i) turn_turn[entry] += strain[a][i] * strain[b][i];
  for (int i = 0; i < kRows; ++i)
    for (int row = 0; row < kRows; ++row) L::store(&block.factor[i][row][lane], factor[i][row]);
}

// Factor of the rate of Green's strain in Hooke's law with lambda = `ratio` mu, likewise.
template <int D, class Real>
PNEUMORPH_INLINE void store_objective_factor(const typename RegisterLanes<Real>::type f[3 * D], Real ratio,
                                   typename RegisterLanes<Real>::type mu, int lane,
                                   HyperelasticBlock<D, false, Real>& block) {
  using L = RegisterLanes<Real>;
  constexpr int kRows = 3 * D, kStrains = HyperelasticBlock<D, false, Real>::kStrains;
  typename L::type factor[kStrains][kRows];
  objective_factor<D, Real>(f, ratio, mu, factor);
  for (int i = 0; i < kStrains; ++i)
    for (int row = 0; row < kRows; ++row) L::store(&block.factor[i][row][lane], factor[i][row]);
}

// Deformation gradient, stress and factor of a block of elements, lanes over elements. One copy serves every number
// of modes.
template <int D, bool Published, class Law, class Real>
__attribute__((noinline)) void deform_hyperelastic_block(const ElementFamily<Real>& family, int number, int modes,
                                                         const Real* alpha,
                                                         HyperelasticBlock<D, Published, Real>& block,
                                                         typename RegisterLanes<Real>::type turn_turn[6]) {
  using L = RegisterLanes<Real>;
  using V = typename L::type;
  constexpr int kRows = 3 * D;
  constexpr int kPieces = kLane / L::count;
  const Law law(family.lambda_over_mu);
  for (int piece = 0; piece < kPieces; ++piece) {
    const int lane = piece * L::count;
    V f[kRows], p[kRows];
    deformation_gradient<D, Real>(family, number, lane, modes, alpha, f);
    const V mu = L::load(family.mu + number * kLane + lane);
    law.stress(f, p);
    for (int row = 0; row < kRows; ++row) L::store(&block.stress[0][row][lane], mu * p[row]);
    if constexpr (Published)
      store_published_factor<D, Law, Real>(law, f, mu, lane, block, turn_turn);
    else
      store_objective_factor<D, Real>(f, family.lambda_over_mu, mu, lane, block);
  }
}

// Rows S G of `Width` modes from `column` on, of a column of `Stride` modes, and the work of the stresses on those modes.
template <int M, int D, bool Published, int Width, int Stride, class Real>
inline void hyperelastic_rows(const Real* gradient, const HyperelasticBlock<D, Published, Real>& block, int column,
                              Real (*rows)[kRowStride<M>], Real (*work)[M]) {
  using L = Lanes<Real, Width * sizeof(Real)>;
  using V = typename L::type;
  using Block = HyperelasticBlock<D, Published, Real>;
  constexpr int kRows = 3 * D;
  V sum[Block::kLoads];
  for (int i = 0; i < Block::kLoads; ++i) sum[i] = L::load(&work[i][column]);
  for (int l = 0; l < kLane; ++l) {
    V g[kRows];
    for (int i = 0; i < kRows; ++i) g[i] = L::load(gradient + (l * kRows + i) * Stride);
    for (int i = 0; i < kRows; ++i)
      for (int load = 0; load < Block::kLoads; ++load) sum[load] += block.stress[load][i][l] * g[i];
    for (int i = 0; i < Block::kStrains; ++i) {
      V strain = block.factor[i][0][l] * g[0];
      for (int row = 1; row < kRows; ++row) strain += block.factor[i][row][l] * g[row];
      L::store(&rows[i * kLane + l][column], strain);
    }
  }
  for (int i = 0; i < Block::kLoads; ++i) L::store(&work[i][column], sum[i]);
}

// Adds the contribution of a family whose blocks `deform` sets up; `turn_turn` is row by row.
template <int M, int D, bool Published, class Real, class Deform>
PNEUMORPH_INLINE void add_blocks(const ElementFamily<Real>& family, const Deform& deform, Real (*work)[M], Real stiffness[M][M],
                       Real turn_turn[9]) {
  using V = typename RegisterLanes<Real>::type;
  using Block = HyperelasticBlock<D, Published, Real>;
  V turns[6] = {};
  alignas(64) Real rows[Block::kStrains * kLane][kRowStride<M>];
  Block block;
  for (int number = 0; number < family.block_count; ++number) {
    deform(number, block, turns);
    const Real* gradient = family.gradient_modes + long(number) * kLane * Block::kRows * M;
    for_columns<M, kLane * Block::kRows, Real>(gradient, [&](auto width, auto stride, const Real* from, int column) {
      hyperelastic_rows<M, D, Published, width(), stride()>(from, block, column, rows, work);
    });
    add_outer_products<true, M>(rows, Block::kStrains * kLane, stiffness);
  }
  if constexpr (Published) {
    static const int kEntry[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
    for (int i = 0; i < 9; ++i)
      for (int l = 0; l < RegisterLanes<Real>::count; ++l) turn_turn[i] += turns[kEntry[i]][l];
  }
}

// Adds one family's contribution, as add_family of elements.hpp does.
template <int M, int D, bool Published, class Real>
void add_hyperelastic(const ElementFamily<Real>& family, const Real* alpha, Real (*work)[M], Real stiffness[M][M],
                      Real turn_turn[9]) {
  using Block = HyperelasticBlock<D, Published, Real>;
  const auto deform = [&](int number, Block& block, auto* turns) __attribute__((always_inline)) {
    if (family.law == kStableNeoHookean)
      deform_hyperelastic_block<D, Published, StableNeoHookean<D, Real>>(family, number, M, alpha, block, turns);
    else
      deform_hyperelastic_block<D, Published, StVenantKirchhoff<D, Real>>(family, number, M, alpha, block, turns);
  };
  add_blocks<M, D, Published, Real>(family, deform, work, stiffness, turn_turn);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
