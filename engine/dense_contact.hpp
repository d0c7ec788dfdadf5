// Friction over a dense Delassus operator, for the full-order model: sweeps by (29) of docs/physics.md, point by point, and
// Newton's method of friction_newton.hpp.
#pragma once
#define PNEUMORPH_INSTRUCTION_SET portable
#include <vector>

#include "friction_newton.hpp"
#include "padded_part.hpp"

namespace pneumorph {

// Points coupled by W, (3c, 3c) row-major; rows of a point are normal, tangent, tangent.
class DenseFriction {
 public:
  DenseFriction(const double* w, const double* free_velocity, const double* friction, int points)
      : memory_(problem_.place(nullptr, points)) {
    problem_.place(memory_.as<char>(), points);
    const int rows = 3 * points, stride = (rows + 7) / 8 * 8;
    problem_.count = points;
    problem_.caution = portable::kDenseCaution;
    problem_.group_count = 1;
    problem_.groups[0] = {0, points, stride, problem_.blocks, 0, nullptr, 0};  // one group, and no hub: P = 0
    for (int i = 0; i < rows; ++i) {
      problem_.free[i] = free_velocity[i];
      for (int j = 0; j < rows; ++j) problem_.blocks[long(i) * stride + j] = w[long(i) * rows + j];
    }
    for (int c = 0; c < points; ++c) {
      double block[9];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) block[3 * i + j] = w[long(3 * c + i) * rows + 3 * c + j];
      problem_.points[c] = portable::point_operator(block);
      problem_.scale[c][0] = 1.0 / problem_.points[c].normal_inverse;
      problem_.scale[c][1] = 1.0 / problem_.points[c].tangent_inverse;
      problem_.friction[c] = friction[c];
    }
  }

  // Impulses after sweeps from a start until one removes no larger violation than `tolerance` [mm/s], `most` of them.
  std::vector<double> sweep(const double* start, double tolerance, int most) const {
    const int rows = 3 * problem_.count;
    const long stride = problem_.groups[0].stride;
    std::vector<double> impulse(start, start + rows), velocity(problem_.free, problem_.free + rows);
    const auto add_column = [&](int column, double amount) {
      if (amount == 0.0) return;
      const double* row = problem_.blocks + column * stride;  // W is symmetric: a row is a column
      for (int i = 0; i < rows; ++i) velocity[i] += row[i] * amount;
    };
    for (int i = 0; i < rows; ++i) add_column(i, impulse[i]);
    for (int sweep = 0; sweep < most; ++sweep) {
      double change = 0;
      for (int c = 0; c < problem_.count; ++c) {
        double delta[3];
        change = std::fmax(change, portable::project_point(problem_.points[c], &velocity[3 * c], problem_.friction[c],
                                                           &impulse[3 * c], delta));
        for (int i = 0; i < 3; ++i) add_column(3 * c + i, delta[i]);
      }
      if (change <= tolerance) break;
    }
    return impulse;
  }

  // The best that Newton's method finds from a start until no law is violated by more than `tolerance` [mm/s]; without
  // any tolerance the start itself, put into the cones.
  const portable::FrictionIterate& newton(const double* start, double tolerance) {
    for (int i = 0; i < 3 * problem_.count; ++i) problem_.now.impulse[i] = start[i];
    problem_.newton(tolerance);
    return problem_.best;
  }

 private:
  portable::FrictionProblem problem_{};
  AlignedArray memory_;
};

}  // namespace pneumorph
