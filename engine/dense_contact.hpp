// Projected Gauss-Seidel over a dense Delassus operator, for the full-order model: (29) of docs/physics.md, point by point.
#pragma once
#define PNEUMORPH_INSTRUCTION_SET portable
#include <vector>

#include "friction.hpp"

namespace pneumorph {

struct ContactSolution {
  std::vector<double> impulse;  // (contact, 3)
  double residual;              // mm/s, largest violation over all contacts at the returned impulse
  int sweeps;
};

// W: (3c, 3c) row-major; rows of a contact are normal, tangent, tangent. Ends at `tolerance` or `sweeps`.
inline ContactSolution solve_dense_contacts(const double* w, const double* free_velocity, int contacts,
                                            double friction, const double* warm_start,
                                            double tolerance, int maximum_sweeps) {
  const int n = 3 * contacts;
  ContactSolution solution{std::vector<double>(warm_start, warm_start + n), 0.0, 0};
  std::vector<double> velocity(free_velocity, free_velocity + n);
  std::vector<portable::PointOperator> points(contacts);
  auto add_column = [&](int column, double amount) {
    if (amount == 0.0) return;
    const double* row = w + static_cast<long>(column) * n;  // W is symmetric: a row is a column
    for (int i = 0; i < n; ++i) velocity[i] += row[i] * amount;
  };
  for (int c = 0; c < contacts; ++c) {
    double block[9];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) block[3 * i + j] = w[static_cast<long>(3 * c + i) * n + 3 * c + j];
    points[c] = portable::point_operator(block);
  }
  for (int i = 0; i < n; ++i) add_column(i, solution.impulse[i]);
  for (; solution.sweeps < maximum_sweeps;) {
    double change = 0;
    ++solution.sweeps;
    for (int c = 0; c < contacts; ++c) {
      double delta[3];
      change = std::fmax(change, portable::project_point(points[c], &velocity[3 * c], friction,
                                                         &solution.impulse[3 * c], delta));
      for (int i = 0; i < 3; ++i) add_column(3 * c + i, delta[i]);
    }
    if (change <= tolerance) break;
  }
  for (int c = 0; c < contacts; ++c) {
    double copy[3] = {solution.impulse[3 * c], solution.impulse[3 * c + 1], solution.impulse[3 * c + 2]};
    double delta[3];
    solution.residual = std::fmax(
        solution.residual, portable::project_point(points[c], &velocity[3 * c], friction, copy, delta));
  }
  return solution;
}

}  // namespace pneumorph
