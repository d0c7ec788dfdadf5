// Sums of outer products of rows with themselves, K += or -= sum_r x_r x_r^T, upper blocks of eight alone: the sum over
// points in K of equation (15) of docs/physics.md.
//
// A pass keeps two tiles of eight rows of K in registers while all rows stream by: 16 vectors of 64 bytes
// with AVX-512, where a tile is 16 numbers wide, and 8 vectors of 32 bytes elsewhere, one tile at a time.
#pragma once
#include "lanes.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Numbers from one row of `M` modes to the next: whole lines of the cache.
template <int M>
constexpr int kRowStride = (M + 15) / 16 * 16;

// Calls `use(width, stride, gradient, column)` for columns of modes no wider than a register. Gradients stand in columns
// of 64 bytes of modes while they last, `Rows` rows each, then in one of the modes left (model.hpp).
template <int M, int Rows, class Real, class Use>
inline void for_columns(const Real* gradient, const Use& use) {
  constexpr int kStride = 64 / int(sizeof(Real)), kWidth = RegisterLanes<Real>::count, kLeft = M % kStride;
  int column = 0;
  for (; column + kStride <= M; gradient += Rows * kStride)
    for (int part = 0; part < kStride; part += kWidth, column += kWidth)
      use(std::integral_constant<int, kWidth>{}, std::integral_constant<int, kStride>{}, gradient + part, column);
  constexpr int kLeftWidth = kLeft < kWidth ? kLeft : kWidth;
  if constexpr (kLeft != 0)
    for (int part = 0; part < kLeft; part += kLeftWidth, column += kLeftWidth)
      use(std::integral_constant<int, kLeftWidth>{}, std::integral_constant<int, kLeft>{}, gradient + part, column);
}

// Rows 8 Row0.. by columns 8 Column0.. (Width0 of them), and a second tile alike where Width1 > 0.
template <bool Add, int M, int Row0, int Column0, int Width0, int Row1, int Column1, int Width1, class Real>
inline void outer_pass(const Real (*rows)[kRowStride<M>], int count, Real k[M][M]) {
  using L0 = Lanes<Real, Width0 * sizeof(Real)>;
  using L1 = Lanes<Real, (Width1 ? Width1 : Width0) * sizeof(Real)>;
  typename L0::type sum0[8];
  typename L1::type sum1[8];
#pragma GCC unroll 8
  for (int a = 0; a < 8; ++a) {
    sum0[a] = L0::load(&k[8 * Row0 + a][8 * Column0]);
    if constexpr (Width1) sum1[a] = L1::load(&k[8 * Row1 + a][8 * Column1]);
  }
  for (int r = 0; r < count; ++r) {
    const Real* row = rows[r];
    const auto right0 = L0::load(row + 8 * Column0);
#pragma GCC unroll 8
    for (int a = 0; a < 8; ++a) {
      if constexpr (Add) sum0[a] += row[8 * Row0 + a] * right0;
      else sum0[a] -= row[8 * Row0 + a] * right0;
    }
    if constexpr (Width1) {
      const auto right1 = L1::load(row + 8 * Column1);
#pragma GCC unroll 8
      for (int a = 0; a < 8; ++a) {
        if constexpr (Add) sum1[a] += row[8 * Row1 + a] * right1;
        else sum1[a] -= row[8 * Row1 + a] * right1;
      }
    }
  }
#pragma GCC unroll 8
  for (int a = 0; a < 8; ++a) {
    L0::store(&k[8 * Row0 + a][8 * Column0], sum0[a]);
    if constexpr (Width1) L1::store(&k[8 * Row1 + a][8 * Column1], sum1[a]);
  }
}

template <bool Add, int M, class Real>
inline void add_outer_products(const Real (*rows)[kRowStride<M>], int count, Real k[M][M]) {
#if defined(__AVX512F__)
  if constexpr (sizeof(Real) == 4) {
    if constexpr (M == 8) outer_pass<Add, M, 0, 0, 8, 0, 0, 0>(rows, count, k);
    if constexpr (M == 16) outer_pass<Add, M, 0, 0, 16, 1, 1, 8>(rows, count, k);
    if constexpr (M == 24) {
      outer_pass<Add, M, 0, 0, 16, 1, 1, 16>(rows, count, k);
      outer_pass<Add, M, 0, 2, 8, 2, 2, 8>(rows, count, k);
    }
    if constexpr (M == 32) {
      outer_pass<Add, M, 0, 0, 16, 0, 2, 16>(rows, count, k);
      outer_pass<Add, M, 1, 1, 16, 2, 2, 16>(rows, count, k);
      outer_pass<Add, M, 1, 3, 8, 3, 3, 8>(rows, count, k);
    }
    return;
  }
#endif
  outer_pass<Add, M, 0, 0, 8, 0, 0, 0>(rows, count, k);
  if constexpr (M >= 16) {
    outer_pass<Add, M, 0, 1, 8, 0, 0, 0>(rows, count, k);
    outer_pass<Add, M, 1, 1, 8, 0, 0, 0>(rows, count, k);
  }
  if constexpr (M >= 24) {
    outer_pass<Add, M, 0, 2, 8, 0, 0, 0>(rows, count, k);
    outer_pass<Add, M, 1, 2, 8, 0, 0, 0>(rows, count, k);
    outer_pass<Add, M, 2, 2, 8, 0, 0, 0>(rows, count, k);
  }
  if constexpr (M >= 32) {
    outer_pass<Add, M, 0, 3, 8, 0, 0, 0>(rows, count, k);
    outer_pass<Add, M, 1, 3, 8, 0, 0, 0>(rows, count, k);
    outer_pass<Add, M, 2, 3, 8, 0, 0, 0>(rows, count, k);
    outer_pass<Add, M, 3, 3, 8, 0, 0, 0>(rows, count, k);
  }
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
