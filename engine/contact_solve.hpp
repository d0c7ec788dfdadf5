// The friction of one step: which points take part, Newton's method, and Gauss-Seidel sweeps where it fails.
// Equations (27) to (30) of docs/physics.md.
#pragma once
#include "thrown_points.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

constexpr double kNearGap = 0.0;     // mm; points not pressed before that would stay above it join only if found to pass the floor
constexpr int kContactPasses = 10;   // solves with more and more points
constexpr int kFirstSweeps = 20;     // after Newton's first failure; each next time four times as many

template <int M>
inline double* modal_sum(ContactAccumulator<M>& sum, const ContactRow<M>& row) {
  return sum.modes[row.mount < 0 ? kMaximumMounts : row.mount];
}

// What the rows' impulses do to the factored unknowns, into `work.sum`.
template <int M, class Real>
void sum_impulses(int row_count, Workspace<M, Real>& work) {
  __builtin_memset(&work.sum, 0, sizeof(work.sum));
  for (int c = 0; c < row_count; ++c) {
    const ContactRow<M>& row = work.rows[c];
    double* modes = modal_sum(work.sum, row);
    for (int i = 0; i < 3; ++i) {
      for (int v = 0; v < M; v += 8) store(modes + v, load(modes + v) + row.impulse[i] * load(&row.response[i][v]));
      store(work.sum.hub, load(work.sum.hub) + row.impulse[i] * load(&row.response[i][M]));
    }
  }
}

// Velocities after the step, from the impulses' sums; false if they are not finite or too fast.
template <int M, class Real>
bool find_velocities(const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                     Workspace<M, Real>& work) {
  constexpr int kVectors = M / 8;
  HubSystem& hub = work.hub;
  double* velocity = hub.next_velocity;
  for (int i = 0; i < 6; ++i) {
    velocity[i] = hub.free_velocity[i];
    for (int j = i; j < 6; ++j) velocity[i] += hub.factor[6 * j + i] * work.sum.hub[j];
  }
  bool sound = true;
  for (int i = 0; i < 3; ++i)
    sound = sound && std::fabs(velocity[i]) < settings.speed_limit &&
            std::fabs(settings.time_step * velocity[3 + i]) < 1.0;
  for (int k = 0; k < robot.mount_count; ++k) {
    const LegSystem<M>& leg = work.mounts[k].leg;
    double part_velocity[6];
    for (int i = 0; i < 6; ++i) {
      part_velocity[i] = 0;
      for (int j = 0; j < 6; ++j) part_velocity[i] += work.views[k].transform[6 * i + j] * velocity[j];
    }
    MountView<M>& view = work.views[k];
    const double* up = view.world + 6;
    view.next_speed = up[0] * part_velocity[0] + up[1] * part_velocity[1] + up[2] * part_velocity[2];
    cross(up, part_velocity + 3, view.next_lever);
    alignas(64) double z[M];
    for (int v = 0; v < kVectors; ++v) {
      DoubleLanes value = load(&leg.reduced_right[8 * v]) + load(&work.sum.modes[k][8 * v]);
      for (int i = 0; i < 6; ++i) value -= part_velocity[i] * load(&leg.reduced_coupling[i][8 * v]);
      store(&z[8 * v], value);
    }
    double energy = 0;  // twice the kinetic energy of the modes: bounds every modal rate
    for (int a = 0; a < M; ++a) {
      work.rates[k][a] = inverse_times<M>(leg.inverse_upper, a, z);
      energy += work.rates[k][a] * work.rates[k][a];
    }
    const double mass = parts[robot.mounts[k].part].mass;
    sound = sound && energy < mass * settings.speed_limit * settings.speed_limit;
  }
  return sound;
}

// Projected Gauss-Seidel sweeps; returns the largest violation that the last of them removed.
template <int M, class Real>
double sweep_contacts(const Settings& settings, int row_count, int most, Workspace<M, Real>& work, int& sweeps) {
  constexpr int kVectors = M / 8;
  auto& sum = work.sum;
  sum_impulses(row_count, work);
  const double flexible = flexibility_scale(settings);
  double residual = 0;
  for (int sweep = 0; sweep < most; ++sweep) {
    residual = 0;
    ++sweeps;
    for (int c = 0; c < row_count; ++c) {
      ContactRow<M>& row = work.rows[c];
      double* modes = modal_sum(sum, row);
      DoubleLanes dots[3];
      const DoubleLanes hub_sum = load(sum.hub);
      for (int i = 0; i < 3; ++i) dots[i] = hub_sum * load(&row.response[i][M]);
      for (int v = 0; v < kVectors; ++v) {
        const DoubleLanes value = load(modes + 8 * v);
        for (int i = 0; i < 3; ++i) dots[i] += value * load(&row.response[i][8 * v]);
      }
      double v[3], delta[3];
      for (int i = 0; i < 3; ++i) v[i] = row.free_velocity[i] + sum_lanes(dots[i]);
      if (row.flexibility)
        for (int d = 0; d < row_count; ++d)
          if (work.rows[d].mount == row.mount) {
            const double flexibility = flexible * row.flexibility[work.rows[d].point_number];
            for (int i = 0; i < 3; ++i) v[i] += flexibility * work.rows[d].impulse[i];
          }
      residual = std::fmax(residual, project_point(row.point, v, row.friction, row.impulse, delta));
      if (delta[0] == 0 && delta[1] == 0 && delta[2] == 0) continue;
      DoubleLanes hub_value = load(sum.hub);
      for (int i = 0; i < 3; ++i) hub_value += delta[i] * load(&row.response[i][M]);
      store(sum.hub, hub_value);
      for (int w = 0; w < kVectors; ++w) {
        DoubleLanes value = load(modes + 8 * w);
        for (int i = 0; i < 3; ++i) value += delta[i] * load(&row.response[i][8 * w]);
        store(modes + 8 * w, value);
      }
    }
    if (residual <= settings.contact_tolerance) break;
  }
  return residual;
}

// The problem of the rows, sorted by mount; `order`: row of each of its points.
template <int M>
void pose_friction(const Settings& settings, const ContactRow<M>* rows, int row_count, FrictionProblem& problem, int* order) {
  problem.count = row_count;
  problem.group_count = 0;
  problem.caution = kReducedCaution;
  const double flexible = flexibility_scale(settings);
  double* block = problem.blocks;
  int placed = 0;
  for (int mount = -1; placed < row_count; ++mount) {
    const int first = placed;
    for (int r = 0; r < row_count; ++r)
      if (rows[r].mount == mount) order[placed++] = r;
    const int count = placed - first, stride = (3 * count + 7) / 8 * 8;
    if (count == 0) continue;
    problem.groups[problem.group_count++] = {first, count, stride, block, 0, nullptr, 0};
    for (int c = 0; c < count; ++c)
      for (int i = 0; i < 3; ++i) {
        double* to = block + (3 * c + i) * stride;
        const double* own = rows[order[first + c]].response[i];
        for (int j = 3 * count; j < stride; ++j) to[j] = 0;
        for (int d = 0; d <= c; ++d)
          for (int j = 0; j < 3; ++j) {
            const double* other = rows[order[first + d]].response[j];
            DoubleLanes dot = {};
            for (int v = 0; v < M; v += 8) dot += load(own + v) * load(other + v);
            to[3 * d + j] = block[(3 * d + j) * stride + 3 * c + i] = sum_lanes(dot);
          }
      }
    if (const double* flexibility = rows[order[first]].flexibility; flexibility)
      for (int c = 0; c < count; ++c)
        for (int d = 0; d < count; ++d) {
          const ContactRow<M>& row = rows[order[first + c]];
          const double both = flexible * row.flexibility[rows[order[first + d]].point_number];
          for (int i = 0; i < 3; ++i) block[(3 * c + i) * stride + 3 * d + i] += both;
        }
    block += 3 * count * stride;
  }
  for (int c = 0; c < row_count; ++c) {
    const ContactRow<M>& row = rows[order[c]];
    problem.points[c] = row.point;
    problem.friction[c] = row.friction;
    problem.scale[c][0] = 1.0 / row.point.normal_inverse;
    problem.scale[c][1] = 1.0 / row.point.tangent_inverse;
    for (int i = 0; i < 3; ++i) {
      problem.free[3 * c + i] = row.free_velocity[i];
      store(problem.hub[3 * c + i], load(&row.response[i][M]));
      for (int l = 0; l < 6; ++l) problem.hub_columns[l][3 * c + i] = row.response[i][M + l];
    }
  }
}

// Most points of one mount or of the hub.
template <int M>
int largest_group(const ContactRow<M>* rows, int row_count) {
  int counts[kMaximumMounts + 1] = {}, most = 0;
  for (int c = 0; c < row_count; ++c) {
    int& count = counts[rows[c].mount < 0 ? kMaximumMounts : rows[c].mount];
    if (++count > most) most = count;
  }
  return most;
}

// Impulses of the rows that obey the law to the tolerance, or the best found.
template <int M, class Real>
void solve_friction(const Settings& settings, int row_count, Workspace<M, Real>& work, FrictionReport& report) {
  ContactRow<M>* rows = work.rows;
  report.residual = 0;
  if (row_count == 0) return;
  if (row_count > kNewtonPoints || largest_group<M>(rows, row_count) > kGroupPoints) {
    report.residual = sweep_contacts(settings, row_count, settings.contact_sweeps, work, report.sweeps);
    return;
  }
  FrictionProblem& problem = work.friction;
  int order[kNewtonPoints];
  pose_friction<M>(settings, rows, row_count, problem, order);
  double best[kFrictionRows], least = 1e301;
  int left = settings.contact_sweeps, most = kFirstSweeps;
  while (true) {
    for (int c = 0; c < row_count; ++c)
      for (int i = 0; i < 3; ++i) problem.now.impulse[3 * c + i] = rows[order[c]].impulse[i];
    report.newton_steps += problem.newton(settings.contact_tolerance);
    if (problem.best.residual < least) {
      least = problem.best.residual;
      for (int i = 0; i < 3 * row_count; ++i) best[i] = problem.best.impulse[i];
    }
    if (least <= settings.contact_tolerance || left <= 0) break;
    const int share = most < left ? most : left;
    sweep_contacts(settings, row_count, share, work, report.sweeps);
    left -= share;
    most *= 4;
  }
  for (int c = 0; c < row_count; ++c)
    for (int i = 0; i < 3; ++i) rows[order[c]].impulse[i] = best[3 * c + i];
  report.residual = least;
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
