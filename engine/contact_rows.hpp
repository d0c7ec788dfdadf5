// One row triple for every contact point near the floor: its velocity if nothing touched, and how the
// robot answers its impulse.
//
// Impulses act through W = G G^T + P P^T with G_c = J_modes U^-1 (of the point's part) and
// P_c = (J_hub - G_c E) X L_hub^-T, so a product with W costs M + 6 numbers a row.
#pragma once
#include "workspace.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// The operator of a row whose response is known.
template <int M>
inline void finish_row(ContactRow<M>& row) {
  double w[9];
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) {
      DoubleLanes dot = {};
      for (int v = 0; v < M / 8 + 1; ++v) dot += load(&row.response[i][8 * v]) * load(&row.response[j][8 * v]);
      w[3 * i + j] = w[3 * j + i] = sum_lanes(dot);
    }
  row.point = point_operator(w);
}

// Rows of a point's hub Jacobian: world axes in the order z, x, y against (V, W) along `axes`' columns.
inline void hub_jacobian(const double axes[9], const double arm[3], double jacobian[3][6]) {
  static const int kAxis[3] = {2, 0, 1};
  for (int i = 0; i < 3; ++i) {
    const double* direction = axes + 3 * kAxis[i];
    for (int j = 0; j < 3; ++j) jacobian[i][j] = direction[j];
    cross(arm, direction, jacobian[i] + 3);
  }
}

inline void times_hub_factor(const double row[6], const double inverse[36], double* out) {
  for (int i = 0; i < 6; ++i) {
    double sum = 0;
    for (int j = 0; j <= i; ++j) sum += inverse[6 * i + j] * row[j];
    out[i] = sum;
  }
  out[6] = out[7] = 0;
}

// Points on the hub itself. Returns the number of rows so far; `deepest` is the worst penetration [mm].
template <int M, class Real>
int add_hub_rows(const RobotModel& robot, const Settings& settings, RobotState& state, Workspace<M, Real>& work,
                 int row_count, double& deepest) {
  constexpr int kVectors = M / 8;
  const double h = settings.time_step;
  const HubSystem& hub = work.hub;
  for (int c = 0; c < robot.hub_contact_count; ++c) {
    const double* point = robot.hub_contact_points + 3 * c;
    const double gap = state.position[2] - settings.floor_height + state.rotation[6] * point[0] +
                       state.rotation[7] * point[1] + state.rotation[8] * point[2];
    deepest = std::fmax(deepest, -gap);
    double* impulse = state.impulses + 3 * c;
    double turning[3];
    cross(hub.velocity + 3, point, turning);
    double approach = 0;
    for (int i = 0; i < 3; ++i) approach += state.rotation[6 + i] * (hub.velocity[i] + turning[i]);
    if (!(gap + std::fmin(0.0, h * approach) < settings.contact_margin)) {
      impulse[0] = impulse[1] = impulse[2] = 0;
      continue;
    }
    ContactRow<M>& row = work.rows[row_count++];
    double jacobian[3][6];
    hub_jacobian(state.rotation, point, jacobian);
    for (int i = 0; i < 3; ++i) {
      for (int v = 0; v < kVectors; ++v) store(&row.response[i][8 * v], DoubleLanes{});
      times_hub_factor(jacobian[i], hub.factor, &row.response[i][M]);
      row.free_velocity[i] = i == 0 ? gap / h : 0.0;
      for (int j = 0; j < 6; ++j) row.free_velocity[i] += jacobian[i][j] * hub.free_velocity[j];
    }
    row.impulse = impulse;
    row.mount = -1;
    finish_row(row);
  }
  return row_count;
}

// Points of mounted part k.
template <int M, class Real>
int add_part_rows(const Part<Real>* parts, const RobotModel& robot, int k, const Settings& settings,
                  RobotState& state, Workspace<M, Real>& work, int row_count, double& deepest) {
  constexpr int kVectors = M / 8;
  const double h = settings.time_step;
  const HubSystem& hub = work.hub;
  const Mount& mount = robot.mounts[k];
  const Part<Real>& part = parts[mount.part];
  const double* alpha = state.modes + k * M;
  LegSystem<M>& leg = work.legs[k];
  double* world = work.world[k];
  multiply_matrices(state.rotation, mount.rotation, world);
  double height = state.position[2] - settings.floor_height;
  for (int i = 0; i < 3; ++i) height += state.rotation[6 + i] * mount.translation[i];
  const double up[3] = {world[6], world[7], world[8]};
  // How fast a point approaches the floor at the old velocities, but for turning of its deflection.
  double part_velocity[6], lever[3], origin_speed = 0;
  for (int i = 0; i < 6; ++i) {
    part_velocity[i] = 0;
    for (int j = 0; j < 6; ++j) part_velocity[i] += work.transform[k][6 * i + j] * hub.velocity[j];
  }
  for (int i = 0; i < 3; ++i) origin_speed += up[i] * part_velocity[i];
  cross(up, part_velocity + 3, lever);  // up . (W x y) = y . (up x W)
  const double* rates = state.mode_rates + k * M;
  // The free motion of this part: u = E^T-reduced right side less coupling with the hub.
  double part_free[6];
  alignas(64) double free_reduced[M];
  for (int i = 0; i < 6; ++i) {
    part_free[i] = 0;
    for (int j = 0; j < 6; ++j) part_free[i] += work.transform[k][6 * i + j] * hub.free_velocity[j];
  }
  for (int v = 0; v < kVectors; ++v) {
    DoubleLanes value = load(&leg.reduced_right[8 * v]);
    for (int i = 0; i < 6; ++i) value -= part_free[i] * load(&leg.reduced_coupling[i][8 * v]);
    store(&free_reduced[8 * v], value);
  }
  for (int c = 0; c < part.contact_count; ++c) {
    const double* point = part.contact_points + 3 * c;
    const double* modes = part.contact_modes + long(c) * 3 * M;
    DoubleLanes lift = {}, lift_rate = {};
    for (int v = 0; v < kVectors; ++v) {
      const DoubleLanes row = up[0] * load(modes + 8 * v) + up[1] * load(modes + M + 8 * v) +
                              up[2] * load(modes + 2 * M + 8 * v);
      lift += load(alpha + 8 * v) * row;
      lift_rate += load(rates + 8 * v) * row;
    }
    const double gap = height + up[0] * point[0] + up[1] * point[1] + up[2] * point[2] + sum_lanes(lift);
    deepest = std::fmax(deepest, -gap);
    double* impulse = state.impulses + 3 * (mount.contact_offset + c);
    const double approach = origin_speed + lever[0] * point[0] + lever[1] * point[1] + lever[2] * point[2] +
                            sum_lanes(lift_rate);
    if (!(gap + std::fmin(0.0, h * approach) < settings.contact_margin)) {
      impulse[0] = impulse[1] = impulse[2] = 0;
      continue;
    }
    ContactRow<M>& row = work.rows[row_count++];
    double arm[3];
    for (int i = 0; i < 3; ++i) {
      DoubleLanes dot = {};
      for (int v = 0; v < kVectors; ++v) dot += load(alpha + 8 * v) * load(modes + i * M + 8 * v);
      arm[i] = point[i] + sum_lanes(dot);
    }
    double jacobian[3][6];
    hub_jacobian(world, arm, jacobian);
    for (int i = 0; i < 3; ++i) {
      alignas(64) double modal[M];
      for (int v = 0; v < kVectors; ++v)
        store(&modal[8 * v], jacobian[i][0] * load(modes + 8 * v) + jacobian[i][1] * load(modes + M + 8 * v) +
                                 jacobian[i][2] * load(modes + 2 * M + 8 * v));
      times_inverse<M>(modal, leg.inverse_upper, row.response[i]);
      // Free velocity: hub part plus modal part.
      double velocity_sum = i == 0 ? gap / h : 0.0;
      DoubleLanes dot = {};
      for (int v = 0; v < kVectors; ++v) dot += load(&row.response[i][8 * v]) * load(&free_reduced[8 * v]);
      velocity_sum += sum_lanes(dot);
      double reduced[6], hub_row[6];
      for (int j = 0; j < 6; ++j) {
        velocity_sum += jacobian[i][j] * part_free[j];
        DoubleLanes coupled = {};
        for (int v = 0; v < kVectors; ++v)
          coupled += load(&row.response[i][8 * v]) * load(&leg.reduced_coupling[j][8 * v]);
        reduced[j] = jacobian[i][j] - sum_lanes(coupled);
      }
      for (int j = 0; j < 6; ++j) {
        hub_row[j] = 0;
        for (int l = 0; l < 6; ++l) hub_row[j] += reduced[l] * work.transform[k][6 * l + j];
      }
      times_hub_factor(hub_row, hub.factor, &row.response[i][M]);
      row.free_velocity[i] = velocity_sum;
    }
    row.impulse = impulse;
    row.mount = k;
    finish_row(row);
  }
  return row_count;
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
