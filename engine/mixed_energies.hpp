// Energies of polynomials of the modes: changes of volume, cubic ones, and stretches of a stiff sheet, quadratic ones. Of each
// polynomial c with modulus k the force -k c dc and the stiffness k dc (x) dc; cubic ones as in equation (17) of
// docs/physics.md. pneumorph/reduction/mixed_dilatation.py and mixed_sheet.py are the same in NumPy.
//
// A part of 40 modes has half a megabyte of them, more than some processors' second-level cache holds. So all legs of one part
// are taken together: each stretch of terms, which in single precision the first-level cache holds, serves every leg before the
// next is read.
#pragma once
#include "rubber_system.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// The coordinates at which the terms are, two modes side by side.
template <int M, class Real>
inline void begin_terms(RubberSystem<M, Real>& leg) {
  using V = typename MixedSums<M, Real>::V;
  for (int a = 0; a < M; a += 2) {
    Real lanes[2 * kPressureLane];
    for (int lane = 0; lane < 2 * kPressureLane; ++lane) lanes[lane] = leg.ends[a + lane / kPressureLane];
    leg.mixed.two_coordinates[a / 2] = Lanes<Real, sizeof(V)>::load(lanes);
  }
}

// Adds the terms of pairs b <= c, c from `first` to `last`, with the modes a of `block`; returns those behind them.
template <int M, class Real>
inline const Real* add_terms(const Real* terms, int block, int first, int last, RubberSystem<M, Real>& leg) {
  using V = typename MixedSums<M, Real>::V;
  using L = Lanes<Real, sizeof(V)>;
  MixedSums<M, Real>& sums = leg.mixed;
  const Real* coordinates = leg.ends;
  V by_mode[kCubicModes / 2];
#pragma GCC unroll 4
  for (int i = 0; i < kCubicModes / 2; ++i) by_mode[i] = sums.by_mode[i];
  for (int c = first; c < last; ++c) {
    V by_c = {};
    for (int b = 0; b <= c; ++b, terms += kCubicModes * kPressureLane) {
      const Real pair = coordinates[b] * coordinates[c];
      V sum[2] = {};
#pragma GCC unroll 4
      for (int i = 0; i < kCubicModes / 2; ++i) {
        const V term = L::load(terms + i * 2 * kPressureLane);
        by_mode[i] += pair * term;
        sum[i % 2] += sums.two_coordinates[block / 2 + i] * term;
      }
      const V both = sum[0] + sum[1];
      by_c += coordinates[b] * both;
      sums.by_pair_mode[b] += coordinates[c] * both;
    }
    sums.by_pair_mode[c] += by_c;
  }
#pragma GCC unroll 4
  for (int i = 0; i < kCubicModes / 2; ++i) sums.by_mode[i] = by_mode[i];
  return terms;
}

// Gradients by the modes of the changes of volume's cubic terms, sum over b <= c <= a of t alpha_b alpha_c alpha_a, into `third`
// of each of `count` legs; lanes over pressures. Those of a block of modes a stay in registers while a stretch of pairs b <= c
// streams by.
template <int M, class Real>
inline void cubic_gradients(const Part<Real>& part, int count, RubberSystem<M, Real>* const legs[]) {
  const Real* terms = part.dilatation_3;
  for (int k = 0; k < count; ++k) begin_terms<M, Real>(*legs[k]);
  for (int first = 0; first < part.pressure_count; first += kPressureLane) {
    for (int k = 0; k < count; ++k) __builtin_memset(legs[k]->mixed.by_pair_mode, 0, sizeof(legs[k]->mixed.by_pair_mode));
    for (int block = 0; block < M; block += kCubicModes) {
      for (int k = 0; k < count; ++k) __builtin_memset(legs[k]->mixed.by_mode, 0, sizeof(legs[k]->mixed.by_mode));
      for (int c = 0; c < block + kCubicModes; c += kCubicModes) {
        const Real* next = terms;
        for (int k = 0; k < count; ++k) next = add_terms<M, Real>(terms, block, c, c + kCubicModes, *legs[k]);
        terms = next;
      }
      for (int k = 0; k < count; ++k)
        for (int i = 0; i < kCubicModes / 2; ++i)
          for (int lane = 0; lane < 2 * kPressureLane; ++lane)
            legs[k]->mixed.gradient[lane % kPressureLane][block + 2 * i + lane / kPressureLane] =
                legs[k]->mixed.by_mode[i][lane];
    }
    for (int k = 0; k < count; ++k) {
      MixedSums<M, Real>& sums = legs[k]->mixed;
      for (int lane = 0; lane < kPressureLane; ++lane)
        for (int a = 0; a < M; ++a)
          sums.third[first + lane][a] =
              sums.gradient[lane][a] + sums.by_pair_mode[a][lane] + sums.by_pair_mode[a][kPressureLane + lane];
    }
  }
}

// A polynomial c of the modes with the energy root^2 / 2 c^2: its `row` root dc, and the work of root c on it. Quadratic terms
// are summed in the precision of the elements, as the cubic ones were.
template <int M, class Real>
inline void add_mixed(const double* alpha, const Real* coordinates, const double* first, const Real* quadratic,
                      const double* third, double root, Real row[M], Real work[M]) {
  using L = Lanes<Real, 8 * sizeof(Real)>;
  constexpr int kVectors = M / 8;
  typename L::type sum[2][kVectors] = {};  // two chains, to hide the latency of sums
  for (int b = 0; b < M; b += 2)
#pragma GCC unroll 2
    for (int chain = 0; chain < 2; ++chain)
#pragma GCC unroll 8
      for (int v = 0; v < kVectors; ++v) sum[chain][v] += coordinates[b + chain] * L::load(quadratic + (b + chain) * M + 8 * v);
  alignas(64) Real second[M];
  for (int v = 0; v < kVectors; ++v) L::store(second + 8 * v, sum[0][v] + sum[1][v]);
  DoubleLanes products = {};
  alignas(64) double derivative[M];
  for (int v = 0; v < kVectors; ++v) {
    const DoubleLanes one = load(first + 8 * v), two = load_doubles(second + 8 * v), three = load(third + 8 * v);
    products += load(alpha + 8 * v) * (one + 0.5 * two + (1.0 / 3) * three);
    store(derivative + 8 * v, root * (one + two + three));
  }
  const Real stress = Real(root * sum_lanes(products));
  for (int a = 0; a < M; ++a) {
    row[a] = Real(derivative[a]);
    work[a] += stress * row[a];
  }
}

// Adds them to the work of `count` legs' stresses on every mode and to their stiffness.
template <int M, class Real>
void add_mixed_energies(const Part<Real>& part, int count, RubberSystem<M, Real>* const legs[]) {
  alignas(64) static const double none[M] = {};
  const double of_volume = std::sqrt(part.dilatation_lambda), of_sheet = std::sqrt(part.stretch_modulus);
  const int volumes = part.pressure_count, stretches = part.stretch_count;
  cubic_gradients<M, Real>(part, count, legs);
  for (int i = 0; i < volumes; ++i)
    for (int k = 0; k < count; ++k)
      add_mixed<M, Real>(legs[k]->end, legs[k]->ends, part.dilatation_1 + i * M, part.dilatation_2 + long(i) * M * M,
                         legs[k]->mixed.third[i], of_volume, legs[k]->mixed.rows[i], legs[k]->work[0]);
  for (int i = 0; i < stretches; ++i)
    for (int k = 0; k < count; ++k)
      add_mixed<M, Real>(legs[k]->end, legs[k]->ends, part.stretch_1 + i * M, part.stretch_2 + long(i) * M * M, none,
                         of_sheet, legs[k]->mixed.rows[volumes + i], legs[k]->work[0]);
  for (int k = 0; k < count; ++k)
    add_outer_products<true, M>(legs[k]->mixed.rows, volumes + stretches, legs[k]->system.stiffness);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
