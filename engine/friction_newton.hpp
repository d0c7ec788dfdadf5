// Semi-smooth Newton method for contact with Coulomb friction at a few points coupled by a dense operator.
//
// With u = W lambda + q and any positive rho, the law of friction.hpp is lambda = P(lambda - u / rho), P the projection
// on lambda_n >= 0 and then on the disc of radius mu lambda_n (Alart and Curnier 1991). Each Newton step solves, for
// the points now pressed,
//   u_n = 0,   sticking: u_t = 0,   slipping: lambda_t - mu lambda_n e - s (I - e e^T) (lambda_t - u_t / rho) = 0,
// with e the direction of lambda_t - u_t / rho and s the disc's radius over its length, and sets all other impulses to
// zero: pneumorph/fem/friction_problem.py in the stepper's arithmetic.
#pragma once
#include "friction.hpp"
#include "lanes.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

constexpr int kNewtonPoints = 64;  // most points; more are left to sweeps
constexpr int kNewtonSteps = 40;   // most steps of one attempt
constexpr int kHalvings = 2;       // most halvings of a step
constexpr int kMemory = 10;        // a step must improve on the worst of so many last iterates, to pass kinks of the law
// Share of W's diagonal that pulls a step to the last iterate. Where more points are pressed than the body has freedoms,
// or nearly so, W is singular, and a step would go to huge impulses of both signs; the pull keeps impulses near the last
// ones, costs a factor of itself in convergence elsewhere, and vanishes as the iteration converges.
constexpr double kProximal = 3e-3;

struct FrictionIterate {
  alignas(64) double impulse[3 * kNewtonPoints];
  alignas(64) double velocity[3 * kNewtonPoints];  // W impulse + q
  double merit;                                    // sum of squared violations
  double residual;                                 // the largest [mm/s]
};

struct FrictionProblem {
  using Vector = Lanes<double>::type;

  int count = 0, stride = 0;  // points; numbers in a row of W, whole vectors
  double friction = 0;
  PointOperator points[kNewtonPoints];
  alignas(64) double free[3 * kNewtonPoints];                          // q, zeros behind
  alignas(64) double w[3 * kNewtonPoints * 3 * kNewtonPoints];         // (3 count, stride), symmetric
  alignas(64) double matrix[3 * kNewtonPoints * (3 * kNewtonPoints + 8)];
  FrictionIterate now, trial, best;
  double target[3 * kNewtonPoints];
  int pressed[kNewtonPoints];

  // Predicted impulse lambda - u / rho of a point.
  void predict(const FrictionIterate& at, int c, double predicted[3]) const {
    for (int i = 0; i < 3; ++i)
      predicted[i] = at.impulse[3 * c + i] -
                     at.velocity[3 * c + i] * (i == 0 ? points[c].normal_inverse : points[c].tangent_inverse);
  }

  void project(double impulse[3]) const {
    impulse[0] = std::fmax(impulse[0], 0.0);
    const double limit = friction * impulse[0], length = std::hypot(impulse[1], impulse[2]);
    const double share = length > limit ? limit / length : 1.0;
    impulse[1] *= share, impulse[2] *= share;
  }

  void evaluate(FrictionIterate& at) const {
    for (int v = 0; v < stride; v += 8) store(at.velocity + v, load(free + v));
    for (int j = 0; j < 3 * count; ++j) {
      const double amount = at.impulse[j];
      if (amount == 0.0) continue;
      for (int v = 0; v < stride; v += 8) store(at.velocity + v, load(at.velocity + v) + amount * load(w + j * stride + v));
    }
    at.merit = at.residual = 0;
    for (int c = 0; c < count; ++c) {
      double inside[3];
      predict(at, c, inside);
      project(inside);
      double change[3];
      for (int i = 0; i < 3; ++i)
        change[i] = (at.impulse[3 * c + i] - inside[i]) / (i == 0 ? points[c].normal_inverse : points[c].tangent_inverse);
      const double tangent = change[1] * change[1] + change[2] * change[2];
      at.merit += change[0] * change[0] + tangent;
      at.residual = std::fmax(at.residual, std::fmax(std::fabs(change[0]), std::sqrt(tangent)));
    }
    if (!(at.merit < 1e300)) at.merit = at.residual = 1e300;  // not a number neither
  }

  // The solution of the equations linearised at `now` into `target`; false where they are singular.
  bool linearise() {
    int m = 0;
    for (int c = 0; c < count; ++c)
      if (now.impulse[3 * c] - now.velocity[3 * c] * points[c].normal_inverse > 0) pressed[m++] = c;
    for (int i = 0; i < 3 * count; ++i) target[i] = 0;
    const int size = 3 * m, width = (size + 8) / 8 * 8;  // the right side is column `size`
    for (int p = 0; p < m; ++p) {
      const int c = pressed[p];
      double* rows[3];
      for (int i = 0; i < 3; ++i) {
        double* row = rows[i] = matrix + (3 * p + i) * width;
        const double* from = w + (3 * c + i) * stride;
        for (int q = 0; q < m; ++q)
          for (int j = 0; j < 3; ++j) row[3 * q + j] = from[3 * pressed[q] + j];
        const double pull = kProximal / (i == 0 ? points[c].normal_inverse : points[c].tangent_inverse);
        row[3 * p + i] += pull;
        row[size] = pull * now.impulse[3 * c + i] - free[3 * c + i];
        for (int j = size + 1; j < width; ++j) row[j] = 0;
      }
      double predicted[3];
      predict(now, c, predicted);
      const double limit = friction * predicted[0], length = std::hypot(predicted[1], predicted[2]);
      if (length < limit) continue;
      const double inverse = 1.0 / std::fmax(length, 1e-300);  // no friction, no motion: 0 / 0
      const double e0 = predicted[1] * inverse, e1 = predicted[2] * inverse, s = limit * inverse;
      const double a00 = s * (1 - e0 * e0), a01 = -s * e0 * e1, a11 = s * (1 - e1 * e1);
      for (int j = 0; j <= size; ++j) {
        const double x = rows[1][j], y = rows[2][j];
        rows[1][j] = a00 * x + a01 * y;
        rows[2][j] = a01 * x + a11 * y;
      }
      const double scale = 1.0 / points[c].tangent_inverse;
      rows[1][3 * p] -= scale * friction * e0;
      rows[2][3 * p] -= scale * friction * e1;
      rows[1][3 * p + 1] += scale * (1 - a00);
      rows[1][3 * p + 2] -= scale * a01;
      rows[2][3 * p + 1] -= scale * a01;
      rows[2][3 * p + 2] += scale * (1 - a11);
    }
    if (!eliminate(size, width)) return false;
    for (int p = 0; p < m; ++p)
      for (int i = 0; i < 3; ++i) target[3 * pressed[p] + i] = matrix[(3 * p + i) * width + size];
    return true;
  }

  // Gauss elimination with row exchanges; the solution replaces column `size`.
  bool eliminate(int size, int width) {
    for (int k = 0; k < size; ++k) {
      int pivot = k;
      for (int i = k + 1; i < size; ++i)
        if (std::fabs(matrix[i * width + k]) > std::fabs(matrix[pivot * width + k])) pivot = i;
      double* top = matrix + k * width;
      if (pivot != k)
        for (int v = k / 8 * 8; v < width; v += 8) {
          const Vector held = load(top + v);
          store(top + v, load(matrix + pivot * width + v));
          store(matrix + pivot * width + v, held);
        }
      if (!(std::fabs(top[k]) > 1e-300)) return false;
      const double inverse = 1.0 / top[k];
      for (int i = k + 1; i < size; ++i) {
        double* row = matrix + i * width;
        const double factor = row[k] * inverse;
        if (factor == 0.0) continue;
        for (int v = k / 8 * 8; v < width; v += 8) store(row + v, load(row + v) - factor * load(top + v));
      }
    }
    for (int k = size - 1; k >= 0; --k) {
      const double value = matrix[k * width + size] / matrix[k * width + k];
      if (!(std::fabs(value) < 1e300)) return false;
      matrix[k * width + size] = value;
      for (int i = 0; i < k; ++i) matrix[i * width + size] -= matrix[i * width + k] * value;
    }
    return true;
  }

  // From the impulses in `now`; ends in `best`, inside the cones. Returns the number of steps.
  int newton(double tolerance) {
    evaluate(now);
    best = now;
    double merits[kMemory];
    for (double& merit : merits) merit = now.merit;
    int step = 0;
    while (step < kNewtonSteps && now.residual > tolerance && linearise()) {
      ++step;
      double worst = 0;
      for (double merit : merits) worst = std::fmax(worst, merit);
      double share = 1, best_share = 0, least = 1e301;
      for (int halving = 0; halving <= kHalvings; ++halving, share *= 0.5) {
        blend(share);
        if (trial.merit < least) least = trial.merit, best_share = share;
        if (trial.merit < worst) break;
      }
      if (least < 1e301 && trial.merit != least) blend(best_share);
      now = trial;
      merits[step % kMemory] = now.merit;
      if (now.residual < best.residual) best = now;
    }
    for (int c = 0; c < count; ++c) project(best.impulse + 3 * c);
    evaluate(best);
    return step;
  }

 private:
  void blend(double share) {
    for (int i = 0; i < 3 * count; ++i) trial.impulse[i] = now.impulse[i] + share * (target[i] - now.impulse[i]);
    evaluate(trial);
  }
};

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
