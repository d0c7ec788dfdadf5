// Unilateral contact with Coulomb friction at one point, the step of a projected Gauss-Seidel sweep: equations (28) to (30)
// of docs/physics.md.
//
// With relative velocity v = W lambda + v_free (normal, tangent, tangent), the law
//   0 <= v_n  perp  lambda_n >= 0,   |lambda_t| <= mu lambda_n,   v_t = 0 or lambda_t = -mu lambda_n v_t/|v_t|
// holds exactly when lambda is a fixed point of the projections below, whatever the positive steps:
// lambda_n = max(0, lambda_n - v_n / W_nn),  lambda_t = disc(lambda_t - v_t / rho, mu lambda_n).
#pragma once
#include <cmath>

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

struct PointOperator {
  double normal_inverse;      // 1 / W_nn
  double tangent_inverse;     // 1 / (largest eigenvalue of W_tt)
  double tangent_normal[2];   // W_tn
};

inline PointOperator point_operator(const double w[9]) {
  PointOperator point;
  point.normal_inverse = 1.0 / w[0];
  const double mean = 0.5 * (w[4] + w[8]), half = 0.5 * (w[4] - w[8]);
  point.tangent_inverse = 1.0 / (mean + std::sqrt(half * half + w[5] * w[5]));
  point.tangent_normal[0] = w[3];
  point.tangent_normal[1] = w[6];
  return point;
}

// Changes `impulse`, returns the change in `delta`, and the violated velocity [mm/s] it removed.
inline double project_point(const PointOperator& point, const double velocity[3], double friction,
                            double impulse[3], double delta[3]) {
  const double normal = std::fmax(0.0, impulse[0] - velocity[0] * point.normal_inverse);
  delta[0] = normal - impulse[0];
  const double tx = impulse[1] - (velocity[1] + point.tangent_normal[0] * delta[0]) * point.tangent_inverse;
  const double ty = impulse[2] - (velocity[2] + point.tangent_normal[1] * delta[0]) * point.tangent_inverse;
  const double limit = friction * normal;
  const double length_squared = tx * tx + ty * ty;
  const double scale = length_squared > limit * limit ? limit / std::sqrt(length_squared) : 1.0;
  delta[1] = scale * tx - impulse[1];
  delta[2] = scale * ty - impulse[2];
  impulse[0] = normal;
  impulse[1] += delta[1];
  impulse[2] += delta[2];
  const double normal_change = std::fabs(delta[0]) / point.normal_inverse;
  const double tangent_change = std::sqrt(delta[1] * delta[1] + delta[2] * delta[2]) / point.tangent_inverse;
  return std::fmax(normal_change, tangent_change);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
