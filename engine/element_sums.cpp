// Forces and tangents of elements, eight side by side. Compiled once per instruction set.
#include "element_sums.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lanes.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

using V = DoubleLanes;

inline V splat(double value) {
  alignas(64) double lanes[kPack];
  for (double& lane : lanes) lane = value;
  return load(lanes);
}

inline void cross(const V a[3], const V b[3], V out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

// J^(-2/3); NaN where J is not positive.
inline V shrink_of(V volume_ratio) {
  alignas(64) double lanes[kPack];
  store(lanes, volume_ratio);
  for (double& lane : lanes) {
    const double root = std::cbrt(lane);
    lane = lane > 0.0 ? 1.0 / (root * root) : std::numeric_limits<double>::quiet_NaN();
  }
  return load(lanes);
}

// P = identity F + along C, C = cof F, and
// dP/dF = identity I + ff F (x) F + fc (F (x) C + C (x) F) + cc C (x) C + along d2J.
struct Response {
  V identity, ff, fc, cc, along;
};

inline Response yeoh(const double c[4], V squares_raw, V volume_ratio) {
  const V shrink = shrink_of(volume_ratio);
  const V squares = squares_raw + 0.0 * shrink;  // NaN where turned inside out
  const V y = shrink * squares - 3.0;
  const V slope = 2.0 * shrink * (c[0] + y * (2.0 * c[1] + 3.0 * c[2] * y));
  const V over = 1.0 / volume_ratio;
  const V third = squares * over * (1.0 / 3.0);
  // dy = change_f F + change_c C
  const V change_f = 2.0 * shrink, change_c = -1.0 * change_f * third;
  const V curve = 2.0 * c[1] + 6.0 * c[2] * y;
  Response r;
  r.identity = slope;
  r.along = c[3] * (volume_ratio - 1.0) - slope * third;
  r.ff = curve * change_f * change_f;
  r.fc = curve * change_f * change_c - (2.0 / 3.0) * slope * over;
  r.cc = curve * change_c * change_c + (5.0 / 3.0) * slope * third * over + c[3];
  return r;
}

inline Response stable_neo_hookean(const double c[4], V volume_ratio) {
  const V zero = splat(0.0);
  return {splat(c[0]), zero, zero, splat(c[0] + c[1]), (c[0] + c[1]) * (volume_ratio - 1.0) - c[0]};
}

constexpr int kPermutations[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {2, 1, 0}, {0, 2, 1}};

// F (3, D), P (3, D) and, where wanted, T = dP/dF (3, D, 3, D) of a law of solids.
inline void solid_law(const ElementPacks& packs, const V F[3][3], V P[3][3], V T[3][3][3][3], bool with_tangent) {
  V C[3][3], columns[3][3], out[3];
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 3; ++a) columns[a][i] = F[i][a];
  for (int a = 0; a < 3; ++a) {
    cross(columns[(a + 1) % 3], columns[(a + 2) % 3], out);
    for (int i = 0; i < 3; ++i) C[i][a] = out[i];
  }
  const V volume_ratio = F[0][0] * C[0][0] + F[1][0] * C[1][0] + F[2][0] * C[2][0];
  V squares = splat(0.0);
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 3; ++a) squares += F[i][a] * F[i][a];
  const Response r = packs.law == FullLaw::kYeoh ? yeoh(packs.constants, squares, volume_ratio)
                                                 : stable_neo_hookean(packs.constants, volume_ratio);
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 3; ++a) P[i][a] = r.identity * F[i][a] + r.along * C[i][a];
  if (!with_tangent) return;
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 3; ++a) {
      const V of_f = r.ff * F[i][a] + r.fc * C[i][a], of_c = r.fc * F[i][a] + r.cc * C[i][a];
      for (int j = 0; j < 3; ++j)
        for (int c = 0; c < 3; ++c) T[i][a][j][c] = of_f * F[j][c] + of_c * C[j][c];
      T[i][a][i][a] += r.identity;
    }
  for (int p = 0; p < 6; ++p)
    for (int q = 0; q < 6; ++q) {
      const int *i = kPermutations[p], *a = kPermutations[q];
      const double sign = (p < 3) == (q < 3) ? 1.0 : -1.0;
      T[i[0]][a[0]][i[1]][a[1]] += sign * r.along * F[i[2]][a[2]];
    }
}

// Adds P = F S and its derivative, S = base + lambda tr(E) I + 2 mu E with Green's strain E; base may be null. The derivative
// has the stress that a step dF foresaw, that of E - dF^T dF / 2 (pneumorph/fem/foreseen_stress.py), unless `turned` is null.
template <int D>
inline void add_green_law(double lambda, double mu, const V base[6], const V F[3][3], const V (*turned)[3],
                          V P[3][3], V T[3][3][3][3], bool with_tangent) {
  constexpr int component[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
  V E[3][3], S[3][3], trace = splat(0.0);
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) {
      E[a][b] = 0.5 * (F[0][a] * F[0][b] + F[1][a] * F[1][b] + F[2][a] * F[2][b]);
      if (a == b) E[a][b] += -0.5, trace += E[a][b];
    }
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) {
      S[a][b] = 2.0 * mu * E[a][b];
      if (a == b) S[a][b] += lambda * trace;
      if (base) S[a][b] += base[component[a][b]];
    }
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) P[i][a] += F[i][b] * S[b][a];
  if (!with_tangent) return;
  if (turned) {
    V stretch[3][3];
    trace = splat(0.0);
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) {
        stretch[a][b] = 0.5 * (turned[0][a] * turned[0][b] + turned[1][a] * turned[1][b] + turned[2][a] * turned[2][b]);
        if (a == b) trace += stretch[a][b];
      }
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) {
        S[a][b] -= 2.0 * mu * stretch[a][b];
        if (a == b) S[a][b] -= lambda * trace;
      }
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      V left = splat(0.0);
      for (int a = 0; a < D; ++a) left += F[i][a] * F[j][a];
      for (int a = 0; a < D; ++a)
        for (int c = 0; c < D; ++c) {
          V value = mu * F[i][c] * F[j][a] + lambda * F[i][a] * F[j][c];
          if (i == j) value += S[a][c];
          if (a == c) value += mu * left;
          T[i][a][j][c] += value;
        }
    }
}

// Blocks of the upper triangle of an element's tangent: corners a <= b, then row, column.
template <int K>
constexpr int block_of(int a, int b) {
  return a * K - a * (a - 1) / 2 + b - a;
}

template <int K>
struct Sums {
  V forces[K][3];
  V blocks[K * (K + 1) / 2][3][3];
};

template <int K, int D>
inline void deformation_gradient(const V x[K][3], const V g[K][D], V F[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < D; ++a) {
      F[i][a] = x[0][i] * g[0][a];
      for (int n = 1; n < K; ++n) F[i][a] += x[n][i] * g[n][a];
    }
}

template <int K, int D>
inline void add_point(const ElementPacks& packs, const double* gradients, V measure, const V x[K][3], const V (*step)[3],
                      const V* base, double gain, bool with_tangent, Sums<K>& sums) {
  V g[K][D], F[3][3], turned[3][3], P[3][3], T[3][3][3][3];
  for (int n = 0; n < K; ++n)
    for (int a = 0; a < D; ++a) g[n][a] = load(gradients + (n * D + a) * kPack);
  deformation_gradient<K, D>(x, g, F);
  if (packs.law == FullLaw::kStVenantKirchhoff) {
    const V zero = splat(0.0);
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < D; ++a) {
        P[i][a] = zero;
        for (int j = 0; j < 3; ++j)
          for (int c = 0; c < D; ++c) T[i][a][j][c] = zero;
      }
    const bool foreseen = D == 2 && step;
    if (foreseen) deformation_gradient<K, D>(step, g, turned);
    add_green_law<D>(packs.constants[1], packs.constants[0], nullptr, F, foreseen ? turned : nullptr, P, T, with_tangent);
  } else if constexpr (D == 3) {
    solid_law(packs, F, P, T, with_tangent);
  }
  if (base) add_green_law<D>(0.0, gain, base, F, nullptr, P, T, with_tangent);
  for (int i = 0; i < 3; ++i)
    for (int n = 0; n < K; ++n) {
      V total = P[i][0] * g[n][0];
      for (int a = 1; a < D; ++a) total += P[i][a] * g[n][a];
      sums.forces[n][i] -= measure * total;
    }
  if (!with_tangent) return;
  for (int b = 0; b < K; ++b) {
    V half[3][D][3], weighted[D];
    for (int c = 0; c < D; ++c) weighted[c] = measure * g[b][c];
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < D; ++a)
        for (int j = 0; j < 3; ++j) {
          V total = T[i][a][j][0] * weighted[0];
          for (int c = 1; c < D; ++c) total += T[i][a][j][c] * weighted[c];
          half[i][a][j] = total;
        }
    for (int n = 0; n <= b; ++n) {
      auto& block = sums.blocks[block_of<K>(n, b)];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          for (int a = 0; a < D; ++a) block[i][j] += g[n][a] * half[i][a][j];
    }
  }
}

// u of each pair of nodes and dv/dx of an element's volume v.
template <int K>
inline void volume_gradient(const ElementPacks& packs, const V x[K][3], V mixed[K * (K - 1) / 2][3], V gradient[K][3]) {
  const int pair_count = int(packs.pairs.size()) / 2;
  V out[3];
  for (int n = 0; n < K; ++n)
    for (int i = 0; i < 3; ++i) gradient[n][i] = splat(0.0);
  for (int p = 0; p < pair_count; ++p) {
    const int n = packs.pairs[2 * p], m = packs.pairs[2 * p + 1];
    const double* t = packs.tensor.data() + p * K;
    for (int i = 0; i < 3; ++i) mixed[p][i] = splat(0.0);
    for (int k = 0; k < K; ++k)
      if (t[k] != 0.0)
        for (int i = 0; i < 3; ++i) mixed[p][i] += t[k] * x[k][i];
    cross(x[m], mixed[p], out);
    for (int i = 0; i < 3; ++i) gradient[n][i] += 0.5 * out[i];
    cross(x[n], mixed[p], out);
    for (int i = 0; i < 3; ++i) gradient[m][i] -= 0.5 * out[i];
  }
}

// Mean dilatation: lambda / 2 V (v / V - 1)^2. The derivative has the volume that a step foresaw, unless `step` is null.
template <int K>
inline void add_volume(const ElementPacks& packs, const double* volumes, const V x[K][3], const V (*step)[3],
                       bool with_tangent, Sums<K>& sums) {
  const int pair_count = int(packs.pairs.size()) / 2;
  V mixed[K * (K - 1) / 2][3], gradient[K][3];
  volume_gradient<K>(packs, x, mixed, gradient);
  V volume = splat(0.0);
  for (int n = 0; n < K; ++n)
    for (int i = 0; i < 3; ++i) volume += x[n][i] * gradient[n][i];
  const V rest = load(volumes);
  V pressure = packs.lame_lambda * (volume / (3.0 * rest) - 1.0);
  const V stiffness = packs.lame_lambda / rest;
  for (int n = 0; n < K; ++n)
    for (int i = 0; i < 3; ++i) sums.forces[n][i] -= pressure * gradient[n][i];
  if (!with_tangent) return;
  if (step) {
    V before[K][3], slope[K][3], mixed_before[K * (K - 1) / 2][3], foreseen = splat(0.0);
    for (int n = 0; n < K; ++n)
      for (int i = 0; i < 3; ++i) before[n][i] = x[n][i] - step[n][i];
    volume_gradient<K>(packs, before, mixed_before, slope);
    for (int n = 0; n < K; ++n)
      for (int i = 0; i < 3; ++i) foreseen += (before[n][i] + 3.0 * step[n][i]) * slope[n][i];
    pressure = packs.lame_lambda * (foreseen / (3.0 * rest) - 1.0);
  }
  for (int n = 0; n < K; ++n)
    for (int i = 0; i < 3; ++i) {
      const V stiff = stiffness * gradient[n][i];
      for (int m = n; m < K; ++m)
        for (int j = 0; j < 3; ++j) sums.blocks[block_of<K>(n, m)][i][j] += stiff * gradient[m][j];
    }
  for (int p = 0; p < pair_count; ++p) {
    auto& block = sums.blocks[block_of<K>(packs.pairs[2 * p], packs.pairs[2 * p + 1])];
    for (int k = 0; k < 3; ++k) {
      const V value = pressure * mixed[p][k];
      block[(k + 1) % 3][(k + 2) % 3] += value;
      block[(k + 2) % 3][(k + 1) % 3] -= value;
    }
  }
}

// Vectors at the nodes of a pack's elements, from the first node on, so that nothing is lost where a body is far from the
// origin.
template <int K>
inline void gather(const double* vectors, const int* nodes, V x[K][3]) {
  alignas(64) double lanes[kPack];
  for (int i = 0; i < 3; ++i)
    for (int n = 0; n < K; ++n) {
      for (int e = 0; e < kPack; ++e) lanes[e] = vectors[3 * nodes[n * kPack + e] + i] - vectors[3 * nodes[e] + i];
      x[n][i] = load(lanes);
    }
}

template <int K, int D>
void add_packs(const ElementPacks& packs, const double* positions, const double* change,
               const double* relaxing_base, double relaxing_gain, double factor, double* forces, double* data) {
  const bool with_tangent = data != nullptr;
  const int points = packs.point_count;
  const long all_points = long(packs.element_count) * points;
  Sums<K> sums;
  alignas(64) double lanes[kPack];
  for (int pack = 0; pack < packs.pack_count(); ++pack) {
    const int* nodes = packs.nodes.data() + long(pack) * K * kPack;
    V x[K][3], change_here[K][3];
    gather<K>(positions, nodes, x);
    if (change) gather<K>(change, nodes, change_here);
    const V(*step)[3] = change ? change_here : nullptr;
    const V zero = splat(0.0);
    for (int n = 0; n < K; ++n)
      for (int i = 0; i < 3; ++i) sums.forces[n][i] = zero;
    if (with_tangent)
      for (auto& block : sums.blocks)
        for (auto& row : block)
          for (V& value : row) value = zero;
    const int first = pack * kPack, count = std::min(kPack, packs.element_count - first);
    for (int p = 0; p < points; ++p) {
      const long point = long(pack) * points + p;
      V base[6];
      if (relaxing_base)
        for (int c = 0; c < 6; ++c) {
          for (int e = 0; e < kPack; ++e)
            lanes[e] = e < count ? relaxing_base[c * all_points + long(first + e) * points + p] : 0.0;
          base[c] = load(lanes);
        }
      add_point<K, D>(packs, packs.gradients.data() + point * K * D * kPack, load(packs.measures.data() + point * kPack), x,
                      step, relaxing_base ? base : nullptr, relaxing_gain, with_tangent, sums);
    }
    if constexpr (D == 3)
      if (!packs.volumes.empty())
        add_volume<K>(packs, packs.volumes.data() + pack * kPack, x, step, with_tangent, sums);
    for (int n = 0; n < K; ++n)
      for (int i = 0; i < 3; ++i) {
        store(lanes, sums.forces[n][i]);
        for (int e = 0; e < count; ++e) forces[3 * nodes[n * kPack + e] + i] += lanes[e];
      }
    if (!with_tangent) continue;
    for (auto& block : sums.blocks)
      for (auto& row : block)
        for (V& value : row) value = factor * value;
    for (int e = 0; e < count; ++e) {
      const int* places = packs.places.data() + long(first + e) * K * K;
      for (int a = 0; a < K; ++a)
        for (int b = a; b < K; ++b) {
          const double* block = reinterpret_cast<const double*>(sums.blocks[block_of<K>(a, b)]) + e;
          const int to_b = packs.strides[nodes[b * kPack + e]], to_a = packs.strides[nodes[a * kPack + e]];
          double* upper = data + places[a * K + b];
          double* lower = data + places[b * K + a];
          for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
              const double value = block[(3 * i + j) * kPack];
              upper[i + long(j) * to_b] += value;
              if (a != b) lower[j + long(i) * to_a] += value;
            }
        }
    }
  }
}

void add_elements(const ElementPacks& packs, const double* positions, const double* change,
                  const double* relaxing_base, double relaxing_gain, double factor, double* forces, double* data) {
  auto add = packs.dimension == 3 ? (packs.corner_count == 10 ? &add_packs<10, 3> : &add_packs<4, 3>)
                                  : (packs.corner_count == 6 ? &add_packs<6, 2> : &add_packs<3, 2>);
  add(packs, positions, change, relaxing_base, relaxing_gain, factor, forces, data);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET

void PNEUMORPH_ELEMENTS_NAME(const ElementPacks& packs, const double* positions, const double* change,
                             const double* relaxing_base, double relaxing_gain, double factor, double* forces, double* data) {
  PNEUMORPH_INSTRUCTION_SET::add_elements(packs, positions, change, relaxing_base, relaxing_gain, factor, forces, data);
}

}  // namespace pneumorph
