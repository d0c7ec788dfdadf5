// Yeoh's law in the principal stretches and as a stress, lane by lane: the law of the table in docs/physics.md, and its
// derivatives for equation (16). pneumorph/fem/yeoh.py is the same in NumPy.
#pragma once
#include <limits>

#include "hyperelastic.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// J^(-1/3) by Newton's method, y <- y (4 - J y^3) / 3, from a fraction that is exact at one. To rounding for J from 0.01
// to 20; not a number where J is not positive.
template <class Real, class V>
inline V inverse_cube_root(V j) {
  V y = (Real(2) + j) / (Real(1) + Real(2) * j);
  const int iterations = sizeof(Real) == 8 ? 10 : 8;
  for (int i = 0; i < iterations; ++i) y *= (Real(4) - j * y * y * y) * Real(1.0 / 3);
  const V none = V{} + std::numeric_limits<Real>::quiet_NaN();
  return where_negative(-j, y, none);
}

// psi / mu = (y + r2 y^2 + r3 y^3) / 2 + k / 2 (J - 1)^2 with y = J^(-2/3) |F|^2 - 3, r = C / C1 and k = lambda / mu + 2/3.
template <class Real>
struct Yeoh {
  Real second, third, bulk;  // r2, r3, k

  template <class V>
  void stress(const V f[9], V p[9]) const {
    V columns[3][3], cofactor[3][3], squares = V{};
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < 3; ++k) {
        columns[a][k] = f[k * 3 + a];
        squares += f[k * 3 + a] * f[k * 3 + a];
      }
    for (int a = 0; a < 3; ++a) cross_lanes(columns[(a + 1) % 3], columns[(a + 2) % 3], cofactor[a]);
    const V volume = columns[0][0] * cofactor[0][0] + columns[0][1] * cofactor[0][1] + columns[0][2] * cofactor[0][2];
    V slope, along, excess;
    slopes(volume, squares, slope, along, excess);
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < 3; ++k) p[k * 3 + a] = slope * columns[a][k] + along * cofactor[a][k];
  }

  template <class V>
  PrincipalTangent<3, V> tangent(const V s[3]) const {
    PrincipalTangent<3, V> result;
    const V volume = s[0] * s[1] * s[2], squares = s[0] * s[0] + s[1] * s[1] + s[2] * s[2];
    V slope, along, excess, over[3], rate[3];
    const V shrink = slopes(volume, squares, slope, along, excess);
    for (int i = 0; i < 3; ++i) {
      over[i] = Real(1) / s[i];
      rate[i] = shrink * (Real(2) * s[i] - Real(2.0 / 3) * squares * over[i]);  // dy/ds
    }
    const V bend = second + Real(3) * third * excess;  // of psi by y, once more, over mu
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      const V own = Real(5.0 / 9) * squares * over[i] * over[i] - Real(1.0 / 3);
      result.scaling[i][i] = bend * rate[i] * rate[i] + slope * own + bulk * volume * volume * over[i] * over[i];
      const V pair = over[i] * over[j];
      const V mixed = Real(2.0 / 9) * squares * pair - Real(2.0 / 3) * (s[i] * over[j] + s[j] * over[i]);
      result.scaling[i][j] = result.scaling[j][i] =
          bend * rate[i] * rate[j] + slope * mixed + bulk * (Real(2) * volume - Real(1)) * volume * pair;
      result.twist[i] = slope + along * s[i];
      result.flip[i] = slope - along * s[i];
    }
    return result;
  }

 private:
  // P = slope F + along cof F and y; returns J^(-2/3).
  template <class V>
  V slopes(V volume, V squares, V& slope, V& along, V& excess) const {
    const V root = inverse_cube_root<Real>(volume), shrink = root * root;
    excess = shrink * squares - Real(3);
    slope = shrink * (Real(1) + excess * (Real(2) * second + Real(3) * third * excess));
    along = bulk * (volume - Real(1)) - slope * squares / (Real(3) * volume);
    return shrink;
  }
};

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
