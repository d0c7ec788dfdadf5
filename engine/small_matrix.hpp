// Vectors of three and dense matrices of a few rows; the rigid block of equation (19) of docs/physics.md and the rotation
// of (24).
#pragma once
#include <cmath>

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

inline void cross(const double a[3], const double b[3], double out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}
inline void multiply(const double m[9], const double v[3], double out[3]) {
  for (int i = 0; i < 3; ++i) out[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
}
inline void multiply_transposed(const double m[9], const double v[3], double out[3]) {
  for (int i = 0; i < 3; ++i) out[i] = m[i] * v[0] + m[3 + i] * v[1] + m[6 + i] * v[2];
}
inline void multiply_matrices(const double a[9], const double b[9], double out[9]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

// exp of a rotation vector times `rotation`, then one step of re-orthonormalisation (rows).
inline void rotate_by(const double vector[3], double rotation[9]) {
  const double angle_squared = vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2];
  const double angle = std::sqrt(angle_squared);
  const double a = angle > 1e-6 ? std::sin(angle) / angle : 1.0 - angle_squared / 6.0;
  const double b = angle > 1e-6 ? (1.0 - std::cos(angle)) / angle_squared : 0.5 - angle_squared / 24.0;
  const double x = vector[0], y = vector[1], z = vector[2];
  const double turn[9] = {1 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y,
                          b * x * y + a * z, 1 - b * (x * x + z * z), b * y * z - a * x,
                          b * x * z - a * y, b * y * z + a * x, 1 - b * (x * x + y * y)};
  double next[9];
  multiply_matrices(turn, rotation, next);
  double n0 = 0, n1 = 0, d = 0;
  for (int j = 0; j < 3; ++j) n0 += next[j] * next[j];
  n0 = 1.0 / std::sqrt(n0);
  for (int j = 0; j < 3; ++j) next[j] *= n0, d += next[j] * next[3 + j];
  for (int j = 0; j < 3; ++j) next[3 + j] -= d * next[j], n1 += next[3 + j] * next[3 + j];
  n1 = 1.0 / std::sqrt(n1);
  for (int j = 0; j < 3; ++j) next[3 + j] *= n1;
  cross(next, next + 3, next + 6);
  for (int i = 0; i < 9; ++i) rotation[i] = next[i];
}

// Mass matrix of a rigid body against velocity of the origin and turning rate, 6 x 6, from its mass,
// sum m r and sum m r r^T about the origin.
inline void rigid_mass(double mass, const double first[3], const double second[9], double matrix[36]) {
  for (int i = 0; i < 36; ++i) matrix[i] = 0;
  for (int i = 0; i < 3; ++i) matrix[7 * i] = mass;
  // V^T M W = V . (W x first)
  const double skew[9] = {0, first[2], -first[1], -first[2], 0, first[0], first[1], -first[0], 0};
  const double trace = second[0] + second[4] + second[8];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      matrix[6 * i + 3 + j] = matrix[6 * (3 + j) + i] = skew[3 * i + j];
      matrix[6 * (3 + i) + 3 + j] = (i == j ? trace : 0.0) - 0.5 * (second[3 * i + j] + second[3 * j + i]);
    }
}

// Inverse of the lower Cholesky factor of a symmetric positive 6 x 6 matrix; false if not positive.
inline bool inverse_cholesky_6(const double a[36], double inverse[36]) {
  double l[36] = {0};
  for (int j = 0; j < 6; ++j) {
    double diagonal = a[7 * j];
    for (int k = 0; k < j; ++k) diagonal -= l[6 * j + k] * l[6 * j + k];
    if (!(diagonal > 0)) return false;
    l[7 * j] = std::sqrt(diagonal);
    for (int i = j + 1; i < 6; ++i) {
      double sum = a[6 * i + j];
      for (int k = 0; k < j; ++k) sum -= l[6 * i + k] * l[6 * j + k];
      l[6 * i + j] = sum / l[7 * j];
    }
  }
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i < 6; ++i) {
      double sum = i == j ? 1.0 : 0.0;
      for (int k = j; k < i; ++k) sum -= l[6 * i + k] * inverse[6 * k + j];
      inverse[6 * i + j] = i < j ? 0.0 : sum / l[7 * i];
    }
  return true;
}

// Solves six equations in place of the right side, by Gauss elimination with row exchanges; false if singular.
inline bool solve_6(double a[36], double b[6]) {
  for (int k = 0; k < 6; ++k) {
    int pivot = k;
    for (int i = k + 1; i < 6; ++i)
      if (std::fabs(a[6 * i + k]) > std::fabs(a[6 * pivot + k])) pivot = i;
    if (!(std::fabs(a[6 * pivot + k]) > 1e-300)) return false;
    for (int j = k; j < 6 && pivot != k; ++j) {
      const double held = a[6 * k + j];
      a[6 * k + j] = a[6 * pivot + j], a[6 * pivot + j] = held;
    }
    const double held = b[k];
    b[k] = b[pivot], b[pivot] = held;
    for (int i = k + 1; i < 6; ++i) {
      const double factor = a[6 * i + k] / a[6 * k + k];
      for (int j = k; j < 6; ++j) a[6 * i + j] -= factor * a[6 * k + j];
      b[i] -= factor * b[k];
    }
  }
  for (int k = 5; k >= 0; --k) {
    for (int j = k + 1; j < 6; ++j) b[k] -= a[6 * k + j] * b[j];
    b[k] /= a[6 * k + k];
  }
  return true;
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
