// Semi-smooth Newton method for contact with Coulomb friction: equations (29) to (31) of docs/physics.md. Of both models:
// the stepper poses it by legs and a hub (contact_solve.hpp), the full-order model as one dense operator (dense_contact.hpp).
//
// With u = W lambda + q and any positive rho, the law of friction.hpp is lambda = P(lambda - u / rho), P the projection
// on lambda_n >= 0 and then on the disc of radius mu lambda_n (Alart and Curnier 1991). Each Newton step solves, for
// the points now pressed,
//   u_n = 0,   sticking: u_t = 0,   slipping: lambda_t - mu lambda_n e - s (I - e e^T) (lambda_t - u_t / rho) = 0,
// with e the direction of lambda_t - u_t / rho and s the disc's radius over its length, and sets all other impulses to
// zero. Points are grouped by their part, and W = blocks + P P^T with six columns P of the hub, so each group is
// eliminated alone and six unknowns z = P^T lambda are left.
#pragma once
#include "friction.hpp"
#include "lanes.hpp"
#include "small_matrix.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

constexpr int kNewtonSteps = 40;   // most steps of one attempt
constexpr int kMemory = 10;        // a step must improve on the worst of so many last iterates, to pass kinks of the law

// How a step is kept from going too far.
struct StepCaution {
  int halvings;  // most of a step
  // Share of W's diagonal that pulls a step to the last iterate, at a residual of 1 mm/s and more, and the least. Where
  // more points are pressed than the body has freedoms, or nearly so, W is singular, and a step would go to huge impulses
  // of both signs; the pull keeps impulses near the last ones and vanishes as the iteration converges.
  double proximal, least_proximal;
};
constexpr StepCaution kReducedCaution{2, 3e-3, 1e-7};   // the stepper: starts from the last step, few halvings
constexpr StepCaution kDenseCaution{8, 1e-10, 1e-10};   // full robots: finds more solutions where W is badly conditioned

struct FrictionIterate {
  double* impulse;   // (row)
  double* velocity;  // W impulse + q, (row + 8)
  double merit;      // sum of squared violations
  double residual;   // the largest [mm/s]
};

struct PointGroup {
  int first, count;   // points
  int stride;         // numbers in a row of its block, whole vectors
  double* w;          // its block of W without the hub's share, (3 count, stride)
  int pressed;        // of its points, in the step being made
  double* solution;   // right sides of the pressed points, (3 pressed, rows of `width`)
  int width;
};

struct FrictionProblem {
  using L = Lanes<double, 64>;
  using Vector = L::type;

  int count, group_count;
  StepCaution caution;
  double* friction;            // mu of each point
  PointGroup* groups;
  PointOperator* points;
  double (*scale)[2];          // rho of normal and tangents
  double* free;                // q, (row + 8)
  double (*hub)[8];            // P, two zeros behind
  double* hub_columns[6];      // its transpose, each (row + 8)
  double* blocks;              // (row, row + 7) at most
  double* matrix;              // (row, row + 15) at most
  FrictionIterate now, trial, best;
  double* target;
  int* pressed;

  // Takes its arrays for `most` points from the front of `memory`, on a boundary of 64 bytes; returns how many bytes.
  // Without memory it only counts them.
  unsigned long place(char* memory, int most) {
    const unsigned long rows = 3 * (unsigned long)(most);
    unsigned long taken = 0;
    const auto take = [&](auto*& array, unsigned long length) {
      array = reinterpret_cast<std::remove_reference_t<decltype(array)>>(memory ? memory + taken : nullptr);
      taken += (length * sizeof(*array) + 63) / 64 * 64;
    };
    take(friction, most), take(groups, most), take(points, most), take(scale, most), take(pressed, most);
    take(free, rows + 8), take(hub, rows), take(target, rows);
    for (double*& column : hub_columns) take(column, rows + 8);
    FrictionIterate* const iterates[] = {&now, &trial, &best};
    for (FrictionIterate* each : iterates) take(each->impulse, rows + 8), take(each->velocity, rows + 8);
    take(blocks, rows * (rows + 7)), take(matrix, rows * (rows + 15));
    return taken;
  }

  // Predicted impulse lambda - u / rho of a point.
  void predict(const FrictionIterate& at, int c, double predicted[3]) const {
    predicted[0] = at.impulse[3 * c] - at.velocity[3 * c] * points[c].normal_inverse;
    for (int i = 1; i < 3; ++i)
      predicted[i] = at.impulse[3 * c + i] - at.velocity[3 * c + i] * points[c].tangent_inverse;
  }

  void project(int c, double impulse[3]) const {
    impulse[0] = std::fmax(impulse[0], 0.0);
    const double limit = friction[c] * impulse[0], square = impulse[1] * impulse[1] + impulse[2] * impulse[2];
    if (square <= limit * limit) return;
    const double share = limit / std::sqrt(square);
    impulse[1] *= share, impulse[2] *= share;
  }

  // Velocity of the points, merit and residual.
  void evaluate(FrictionIterate& at) const {
    Vector z = {};
    for (int j = 0; j < 3 * count; ++j) z += at.impulse[j] * load(hub[j]);
    for (int g = 0; g < group_count; ++g) {
      const PointGroup& group = groups[g];
      for (int v = 0; v < group.stride; v += 8) {
        Vector sum = {};
        for (int j = 0; j < 3 * group.count; ++j) sum += at.impulse[3 * group.first + j] * load(group.w + j * group.stride + v);
        L::store(at.velocity + 3 * group.first + v, sum);  // what runs over is the next group's to write
      }
    }
    for (int v = 0; v < 3 * count; v += 8) {
      Vector sum = load(at.velocity + v) + load(free + v);
      for (int l = 0; l < 6; ++l) sum += z[l] * load(hub_columns[l] + v);
      store(at.velocity + v, sum);
    }
    at.merit = 0;
    double largest = 0;
    for (int c = 0; c < count; ++c) {
      double inside[3], change[3];
      predict(at, c, inside);
      project(c, inside);
      for (int i = 0; i < 3; ++i) change[i] = at.impulse[3 * c + i] - inside[i];
      const double normal = change[0] * change[0] * scale[c][0] * scale[c][0];
      const double tangent = (change[1] * change[1] + change[2] * change[2]) * scale[c][1] * scale[c][1];
      at.merit += normal + tangent;
      largest = std::fmax(largest, std::fmax(normal, tangent));
    }
    at.residual = std::sqrt(largest);
    if (!(at.merit < 1e300)) at.merit = at.residual = 1e300;  // not a number neither
  }

  // The solution of the equations linearised at `now` into `target`; false where they are singular.
  bool linearise() {
    // Fading with the residual, so that the last steps converge fast where the law couples stiff and soft directions.
    const double pulling =
        std::fmax(caution.least_proximal, caution.proximal * std::fmin(1.0, std::sqrt(now.residual)));
    double* room = matrix;
    int m = 0;
    // (I + sum P^T X) z = sum P^T x with [X, x] the groups' answers to their rows of P and their right sides.
    alignas(64) double sums[6][8] = {};
    for (int i = 0; i < 3 * count; ++i) target[i] = 0;
    for (int g = 0; g < group_count; ++g) {
      PointGroup& group = groups[g];
      int* own = pressed + m;
      group.pressed = 0;
      for (int c = group.first; c < group.first + group.count; ++c)
        if (now.impulse[3 * c] - now.velocity[3 * c] * points[c].normal_inverse > 0) own[group.pressed++] = c;
      const int size = 3 * group.pressed, columns = (size + 7) / 8 * 8, width = columns + 8;
      group.width = width;
      for (int p = 0; p < group.pressed; ++p) linearise_point(group, own, p, pulling, room, columns);
      if (!eliminate(room, size, width)) return false;
      group.solution = room + columns;
      for (int i = 0; i < size; ++i) {
        const Vector answer = load(group.solution + i * width);
        const double* row = hub[3 * own[i / 3] + i % 3];
        for (int l = 0; l < 6; ++l) store(sums[l], load(sums[l]) + row[l] * answer);
      }
      room += size * width;
      m += group.pressed;
    }
    double left[36], right[6];
    for (int l = 0; l < 6; ++l) {
      right[l] = sums[l][6];
      for (int n = 0; n < 6; ++n) left[6 * l + n] = sums[l][n] + (l == n ? 1.0 : 0.0);
    }
    if (!solve_6(left, right)) return false;
    m = 0;
    for (int g = 0; g < group_count; ++g) {
      const PointGroup& group = groups[g];
      for (int i = 0; i < 3 * group.pressed; ++i) {
        const double* answer = group.solution + i * group.width;
        double value = answer[6];
        for (int l = 0; l < 6; ++l) value -= answer[l] * right[l];
        if (!(std::fabs(value) < 1e300)) return false;
        target[3 * pressed[m + i / 3] + i % 3] = value;
      }
      m += group.pressed;
    }
    return true;
  }

  // From the impulses in `now`; ends in `best`, inside the cones. Returns the number of steps.
  int newton(double tolerance) {
    evaluate(now);
    copy(now, best);
    double merits[kMemory];
    for (double& merit : merits) merit = now.merit;
    int step = 0;
    // An iterate just within the tolerance may be beyond it once it is in the cones: then the next must be half as wrong.
    for (double aim = tolerance;; aim = 0.5 * now.residual) {
      while (step < kNewtonSteps && now.residual > aim && linearise()) {
        ++step;
        double worst = 0;
        for (double merit : merits) worst = std::fmax(worst, merit);
        double share = 1, best_share = 0, least = 1e301;
        for (int halving = 0; halving <= caution.halvings; ++halving, share *= 0.5) {
          blend(share);
          if (trial.merit < least) least = trial.merit, best_share = share;
          if (trial.merit < worst) break;
        }
        if (trial.merit != least) blend(best_share);
        copy(trial, now);
        merits[step % kMemory] = now.merit;
        if (now.residual < best.residual) copy(now, best);
      }
      for (int c = 0; c < count; ++c) project(c, best.impulse + 3 * c);
      evaluate(best);
      if (best.residual <= tolerance || now.residual > aim || now.residual == 0) return step;
    }
  }

 private:
  void copy(const FrictionIterate& from, FrictionIterate& to) const {
    for (int v = 0; v < 3 * count; v += 8) {
      store(to.impulse + v, load(from.impulse + v));
      store(to.velocity + v, load(from.velocity + v));
    }
    to.merit = from.merit;
    to.residual = from.residual;
  }

  void blend(double share) {
    for (int i = 0; i < 3 * count; ++i) trial.impulse[i] = now.impulse[i] + share * (target[i] - now.impulse[i]);
    evaluate(trial);
  }

  // Three rows of pressed point `p` of a group: against its group's pressed points, then against z, then the right side.
  void linearise_point(const PointGroup& group, const int* own, int p, double pulling, double* room,
                       int columns) const {
    const int c = own[p], width = columns + 8;
    double* rows[3];
    for (int i = 0; i < 3; ++i) {
      double* row = rows[i] = room + (3 * p + i) * width;
      const double* from = group.w + (3 * (c - group.first) + i) * group.stride;
      for (int v = 3 * group.pressed / 8 * 8; v < columns; v += 8) store(row + v, Vector{});
      for (int q = 0; q < group.pressed; ++q)
        for (int j = 0; j < 3; ++j) row[3 * q + j] = from[3 * (own[q] - group.first) + j];
      const double pull = pulling * scale[c][i > 0];
      row[3 * p + i] += pull;
      store(row + columns, load(hub[3 * c + i]));
      row[columns + 6] = pull * now.impulse[3 * c + i] - free[3 * c + i];
    }
    double predicted[3];
    predict(now, c, predicted);
    const double limit = friction[c] * predicted[0];
    const double length = std::sqrt(predicted[1] * predicted[1] + predicted[2] * predicted[2]);
    if (length < limit) return;
    const double inverse = 1.0 / std::fmax(length, 1e-300);  // no friction, no motion: 0 / 0
    const double e0 = predicted[1] * inverse, e1 = predicted[2] * inverse, s = limit * inverse;
    const double a00 = s * (1 - e0 * e0), a01 = -s * e0 * e1, a11 = s * (1 - e1 * e1);
    for (int v = 0; v < width; v += 8) {
      const Vector x = load(rows[1] + v), y = load(rows[2] + v);
      store(rows[1] + v, a00 * x + a01 * y);
      store(rows[2] + v, a01 * x + a11 * y);
    }
    const double rho = scale[c][1];
    rows[1][3 * p] -= rho * friction[c] * e0;
    rows[2][3 * p] -= rho * friction[c] * e1;
    rows[1][3 * p + 1] += rho * (1 - a00);
    rows[1][3 * p + 2] -= rho * a01;
    rows[2][3 * p + 1] -= rho * a01;
    rows[2][3 * p + 2] += rho * (1 - a11);
  }

  // Gauss elimination with row exchanges of `size` equations in rows of `width`; solutions replace the last vector.
  static bool eliminate(double* matrix, int size, int width) {
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
        for (int v = k / 8 * 8; v < width; v += 8) store(row + v, load(row + v) - factor * load(top + v));
      }
    }
    double* right = matrix + width - 8;
    for (int k = size - 1; k >= 0; --k) {
      const Vector value = load(right + k * width) / matrix[k * width + k];
      store(right + k * width, value);
      for (int i = 0; i < k; ++i)
        store(right + i * width, load(right + i * width) - matrix[i * width + k] * value);
    }
    return true;
  }
};

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
