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

// Tiles of eight rows that cover the upper blocks of K: those of `wide` columns first, then those of eight.
struct Tile {
  int row, column, width;  // row and column in blocks of eight modes
};
template <int M>
struct Tiles {
  Tile tile[(M / 8) * (M / 8 + 1) / 2 + 1];  // and one of no width
  int count;
};
template <int M>
constexpr Tiles<M> tiles_of(int wide) {
  Tiles<M> result{};
  for (int width = wide; width >= 8; width -= 8)
    for (int row = 0; row < M / 8; ++row) {
      const int left = M / 8 - row, pairs = wide == 16 ? left / 2 : 0;  // blocks of this row that wide tiles take two by two
      if (width == 16)
        for (int pair = 0; pair < pairs; ++pair) result.tile[result.count++] = {row, row + 2 * pair, 16};
      else
        for (int block = 2 * pairs; block < left; ++block) result.tile[result.count++] = {row, row + block, 8};
    }
  return result;
}

template <bool Add, int M, int Wide, int At, class Real>
inline void outer_passes(const Real (*rows)[kRowStride<M>], int count, Real k[M][M]) {
  constexpr auto tiles = tiles_of<M>(Wide);
  if constexpr (At < tiles.count) {
    constexpr int kTiles = Wide / 8;  // in one pass
    constexpr Tile one = tiles.tile[At], two = kTiles == 2 ? tiles.tile[At + 1] : Tile{0, 0, 0};
    outer_pass<Add, M, one.row, one.column, one.width, two.row, two.column, two.width>(rows, count, k);
    outer_passes<Add, M, Wide, At + kTiles>(rows, count, k);
  }
}

template <bool Add, int M, class Real>
inline void add_outer_products(const Real (*rows)[kRowStride<M>], int count, Real k[M][M]) {
  outer_passes<Add, M, kRegisterBytes == 64 && sizeof(Real) == 4 ? 16 : 8, 0>(rows, count, k);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
