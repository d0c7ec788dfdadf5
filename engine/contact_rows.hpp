// The contact points near the floor, and a row triple for each that may touch it: its velocity if nothing touched,
// and how the robot answers its impulse. Equations (18) and (27) of docs/physics.md.
//
// Impulses act through W = G G^T + P P^T with G_c = J_modes U^-1 (of the point's part) and
// P_c = (J_hub - G_c E) X L_hub^-T, so a product with W costs M + 6 numbers a row.
//
// Points of a part whose contact_flexibility is known give way beyond the modes, quasi-statically and alike in all directions:
// a force F_d at a point d moves a point c by r_cd F_d besides. At the end of a step that is r_cd lambda_d / h, of which
// r_cd lambda_d(before) / h was there at its start, so that W has r_cd / h^2 besides, and tangents start from what is left of
// the impulses of the step before. A normal counts from its gap by the modes alone. Equation (47).
#pragma once
#include "workspace.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Rounding of a height in single precision is below this [mm].
constexpr double kHeightSlack = 1e-3;

// What 1 mm/mN of a part's flexibility is worth in W [1/kg].
inline double flexibility_scale(const Settings& settings) {
  return 1.0 / (settings.elasticity * settings.time_step * settings.time_step);
}

// The points of mounted part k that carried something in the last step, where its flexibility is known. So many at most that
// the rest, of legs that lie flat, is left out.
template <int M, class Real>
inline void note_pressed(const Part<Real>& part, const Mount& mount, const RobotState& state, MountView<M>& view) {
  view.pressed_count = 0;
  if (!part.contact_flexibility) return;
  const double* before = state.impulses + 3 * mount.contact_offset;
  for (int d = 0; d < part.contact_count && view.pressed_count < kNewtonPoints; ++d)
    if (before[3 * d] > 0) view.pressed[view.pressed_count++] = d;
}

// How far their impulses moved point c beyond the modes, along its normal or a tangent: what its place by the modes lacks at
// the start of the step [mm].
template <int M, class Real>
inline double moved_before(const Part<Real>& part, const Mount& mount, int c, int axis, const Settings& settings,
                           const RobotState& state, const MountView<M>& view) {
  if (view.pressed_count == 0) return 0;
  const double *flexibility = part.contact_flexibility + long(c) * part.contact_count,
               *before = state.impulses + 3 * mount.contact_offset + axis;
  double moved = 0;
  for (int n = 0; n < view.pressed_count; ++n) moved += flexibility[view.pressed[n]] * before[3 * view.pressed[n]];
  return settings.time_step * flexibility_scale(settings) * moved;
}

// The operator of a row whose response is known.
template <int M>
inline void finish_row(ContactRow<M>& row, const Settings& settings) {
  double w[9];
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) {
      DoubleLanes dot = {};
      for (int v = 0; v < M / 8 + 1; ++v) dot += load(&row.response[i][8 * v]) * load(&row.response[j][8 * v]);
      w[3 * i + j] = w[3 * j + i] = sum_lanes(dot);
    }
  if (row.flexibility)
    for (int i = 0; i < 3; ++i) w[4 * i] += flexibility_scale(settings) * row.flexibility[row.point_number];
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

// Candidates on the hub itself. Returns their number so far; `deepest` is the worst penetration [mm].
inline int find_hub_candidates(const RobotModel& robot, const Settings& settings, const RobotState& state,
                               const HubSystem& hub, Candidate* candidates, int count, double& deepest) {
  const double* up = state.rotation + 6;
  double turn[3];
  cross(up, hub.velocity + 3, turn);  // up . (W x r) = r . (up x W)
  const double speed = up[0] * hub.velocity[0] + up[1] * hub.velocity[1] + up[2] * hub.velocity[2];
  for (int c = 0; c < robot.hub_contact_count; ++c) {
    const double* r = robot.hub_contact_points + 3 * c;
    const double gap = state.position[2] - settings.floor_height + up[0] * r[0] + up[1] * r[1] + up[2] * r[2];
    deepest = std::fmax(deepest, -gap);
    const double approach = speed + turn[0] * r[0] + turn[1] * r[1] + turn[2] * r[2];
    if (gap + std::fmin(0.0, settings.time_step * approach) < settings.contact_margin)
      candidates[count++] = {gap, gap + std::fmin(0.0, settings.time_step * approach), -1, c, false};
  }
  return count;
}

// How contact points of mounted part k see it, once the hub's free motion is known.
template <int M>
void view_mount(const RobotModel& robot, int k, const RobotState& state, const HubSystem& hub, const LegSystem<M>& leg,
                MountView<M>& view) {
  constexpr int kVectors = M / 8;
  multiply_matrices(state.rotation, robot.mounts[k].rotation, view.world);
  for (int i = 0; i < 6; ++i) {
    double sum = 0;
    for (int j = 0; j < 6; ++j) sum += view.transform[6 * i + j] * hub.free_velocity[j];
    view.free_velocity[i] = sum;
    times_hub_factor(view.transform + 6 * i, hub.factor, view.to_factor[i]);
  }
  alignas(64) double z[M], coupling[M][8] = {};
  for (int v = 0; v < kVectors; ++v) {
    DoubleLanes value = load(&leg.reduced_right[8 * v]);
    for (int i = 0; i < 6; ++i) value -= view.free_velocity[i] * load(&leg.reduced_coupling[i][8 * v]);
    store(&z[8 * v], value);
  }
  for (int i = 0; i < 6; ++i)
    for (int a = 0; a < M; ++a) coupling[a][i] = leg.reduced_coupling[i][a];
  for (int a = 0; a < M; ++a) {
    DoubleLanes row = {};
    for (int b = a; b < M; ++b) row += leg.inverse_upper[a][b] * load(coupling[b]);
    view.free_rates[a] = inverse_times<M>(leg.inverse_upper, a, z);
    store(view.hub_response[a], row);
  }
}

// How all points of a part are seen at once, in single precision.
template <int M>
struct LaneView {
  float up[3], lever[3], drop;  // upward axis; motion of a step by the old velocities, but for turning of the deflection
  alignas(64) float coordinate[M], change[M];
};

// Least heights over the part's origin of a block of points, now and by that motion.
template <int M, class Real>
__attribute__((always_inline)) inline void lowest_of_block(const Part<Real>& part, const LaneView<M>& view, int block, float* lowest) {
  using L = Lanes<float, kLane * sizeof(float)>;
  using Floats = L::type;
  const float* point = part.contact_point_lanes + block * 3 * kLane;
  const float* modes = part.contact_mode_lanes + long(block) * M * 3 * kLane;
  const float u0 = view.up[0], u1 = view.up[1], u2 = view.up[2];
  const Floats x = L::load(point), y = L::load(point + kLane), z = L::load(point + 2 * kLane);
  Floats lift = u0 * x + u1 * y + u2 * z, approach = view.drop + view.lever[0] * x + view.lever[1] * y + view.lever[2] * z;
  for (int a = 0; a < M; ++a, modes += 3 * kLane) {
    const Floats row = u0 * L::load(modes) + u1 * L::load(modes + kLane) + u2 * L::load(modes + 2 * kLane);
    lift += view.coordinate[a] * row;
    approach += view.change[a] * row;
  }
  L::store(lowest, where_negative(approach, lift + approach, lift));
}

// Height of the frame of mounted part k over the floor [mm].
inline double height_of_mount(const RobotModel& robot, int k, const Settings& settings, const RobotState& state) {
  double height = state.position[2] - settings.floor_height;
  for (int i = 0; i < 3; ++i) height += state.rotation[6 + i] * robot.mounts[k].translation[i];
  return height;
}

// Gap of a part's point, with the upward axis along the part's and the height of its frame [mm].
template <int M, class Real>
inline double gap_of_point(const Part<Real>& part, int c, const double* alpha, const double up[3], double height) {
  DoubleLanes sum = {};
  const double* own = part.contact_modes + long(c) * 3 * M;
  for (int v = 0; v < M; v += 8)
    sum += load(alpha + v) * (up[0] * load(own + v) + up[1] * load(own + M + v) + up[2] * load(own + 2 * M + v));
  const double* r = part.contact_points + 3 * c;
  return height + up[0] * r[0] + up[1] * r[1] + up[2] * r[2] + sum_lanes(sum);
}

// Candidates of mounted part k: all points' heights in single precision, those below the margin in double.
template <int M, class Real>
int find_part_candidates(const Part<Real>& part, const RobotModel& robot, int k, const Settings& settings,
                         const RobotState& state, const HubSystem& hub, const MountView<M>& view,
                         Candidate* candidates, int count, double& deepest) {
  const double* alpha = state.modes + k * M;
  const double* rates = state.mode_rates + k * M;
  const double* up = view.world + 6;
  const double height = height_of_mount(robot, k, settings, state);
  // How fast a point approaches the floor at the old velocities, but for turning of its deflection.
  double velocity[6], lever[3], speed = 0;
  for (int i = 0; i < 6; ++i) {
    velocity[i] = 0;
    for (int j = 0; j < 6; ++j) velocity[i] += view.transform[6 * i + j] * hub.velocity[j];
  }
  for (int i = 0; i < 3; ++i) speed += up[i] * velocity[i];
  cross(up, velocity + 3, lever);  // up . (W x y) = y . (up x W)
  const double h = settings.time_step;
  const float limit = float(settings.contact_margin - height + kHeightSlack);
  LaneView<M> lanes;
  alignas(64) float lowest[kLane];
  for (int i = 0; i < 3; ++i) lanes.up[i] = float(up[i]), lanes.lever[i] = float(h * lever[i]);
  lanes.drop = float(h * speed);
  for (int a = 0; a < M; ++a) lanes.coordinate[a] = float(alpha[a]), lanes.change[a] = float(h * rates[a]);
  for (int block = 0; block * kLane < part.contact_count; ++block) {
    lowest_of_block<M, Real>(part, lanes, block, lowest);
    for (int lane = 0; lane < kLane; ++lane) {
      const int c = block * kLane + lane;
      if (c >= part.contact_count || lowest[lane] >= limit) continue;
      const double gap = gap_of_point<M>(part, c, alpha, up, height);
      const double lift = moved_before(part, robot.mounts[k], c, 0, settings, state, view);
      deepest = std::fmax(deepest, -gap - lift);
      candidates[count++] = {gap, height + double(lowest[lane]) + lift, k, c, false};
    }
  }
  return count;
}

// How far the rows' impulses lift a candidate beyond the modes, along its normal [mm].
template <int M, class Real>
double flexible_lift(const Candidate& at, const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                     const ContactRow<M>* rows, int row_count) {
  if (at.mount < 0) return 0;
  const Part<Real>& part = parts[robot.mounts[at.mount].part];
  if (!part.contact_flexibility) return 0;
  const double* flexibility = part.contact_flexibility + long(at.point) * part.contact_count;
  double lift = 0;
  for (int c = 0; c < row_count; ++c)
    if (rows[c].mount == at.mount) lift += flexibility[rows[c].point_number] * rows[c].impulse[0];
  return settings.time_step * flexibility_scale(settings) * lift;
}

// Height over the floor that a candidate would have after the step's motion, by the modes [mm].
template <int M, class Real>
double next_gap(const Candidate& at, const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                const RobotState& state, const Workspace<M, Real>& work) {
  if (at.mount < 0) {
    const double *velocity = work.hub.next_velocity, *up = state.rotation + 6;
    double turning[3], speed = 0;
    cross(velocity + 3, robot.hub_contact_points + 3 * at.point, turning);
    for (int i = 0; i < 3; ++i) speed += up[i] * (velocity[i] + turning[i]);
    return at.gap + settings.time_step * speed;
  }
  const MountView<M>& view = work.views[at.mount];
  const Part<Real>& part = parts[robot.mounts[at.mount].part];
  const double *modes = part.contact_modes + long(at.point) * 3 * M, *point = part.contact_points + 3 * at.point;
  const double *alpha = state.modes + at.mount * M, *up = view.world + 6;
  DoubleLanes sum = {};
  for (int v = 0; v < M; v += 8)
    for (int i = 0; i < 3; ++i)
      sum += load(modes + i * M + v) * (up[i] * load(work.rates[at.mount] + v) + view.next_lever[i] * load(alpha + v));
  double speed = view.next_speed + sum_lanes(sum);
  for (int i = 0; i < 3; ++i) speed += view.next_lever[i] * point[i];
  return at.gap + settings.time_step * speed;
}

// mu of a contact point in this step, given the normal impulse of the step before: (42) of docs/physics.md.
inline double contact_friction(const Settings& settings, const double given[2], double impulse) {
  if (settings.friction_exponent == 0) return given[0];
  const double factor = std::pow(impulse / given[1], settings.friction_exponent);
  return given[0] * std::fmin(std::fmax(factor, settings.friction_least), settings.friction_most);
}

// How far the ends of a step's motion part from the straight way, over the step [mm/s]: positions go on by
// exp(h W) (y + h u) with the turning W of the body and the deflecting u of a point at y from its origin, so by
// h/2 W x (W x y + 2 u) besides h (W x y + u); of the motion before.
inline void turning_drift(const double turning[3], const double arm[3], const double deflecting[3], double time_step, double out[3]) {
  double once[3];
  cross(turning, arm, once);
  for (int i = 0; i < 3; ++i) once[i] = 0.5 * time_step * (once[i] + 2 * deflecting[i]);
  cross(turning, once, out);
}

// The row of a candidate, warm started. `turned`: the floor's axes, as rows x, y, z along a body's; those of the world by
// default, which is what the body's rotation has.
struct LevelAxes {
  const double* operator()(const Candidate&, const double rotation[9], double*) const { return rotation; }
};
template <int M, class Real, class Axes = LevelAxes>
void make_row(const Candidate& at, const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
              const RobotState& state, const Workspace<M, Real>& work, ContactRow<M>& row, const Axes& axes = {}) {
  constexpr int kVectors = M / 8;
  const HubSystem& hub = work.hub;
  double jacobian[3][6], turned[9], drift[3] = {};
  row.mount = at.mount;
  row.contact = row.point_number = at.point;
  row.flexibility = nullptr;
  if (at.mount < 0) {
    const double *arm = robot.hub_contact_points + 3 * at.point, still[3] = {};
    hub_jacobian(axes(at, state.rotation, turned), arm, jacobian);
    if (settings.foreseen) turning_drift(hub.velocity + 3, arm, still, settings.time_step, drift);
    for (int i = 0; i < 3; ++i) {
      for (int v = 0; v < kVectors; ++v) store(&row.response[i][8 * v], DoubleLanes{});
      times_hub_factor(jacobian[i], hub.factor, &row.response[i][M]);
      row.free_velocity[i] = 0;
      for (int j = 0; j < 6; ++j) row.free_velocity[i] += jacobian[i][j] * hub.free_velocity[j];
    }
  } else {
    const Mount& mount = robot.mounts[at.mount];
    const MountView<M>& view = work.views[at.mount];
    const Part<Real>& part = parts[mount.part];
    const double* modes = part.contact_modes + long(at.point) * 3 * M;
    const double* alpha = state.modes + at.mount * M;
    row.contact += mount.contact_offset;
    if (part.contact_flexibility) row.flexibility = part.contact_flexibility + long(at.point) * part.contact_count;
    const double* rates = state.mode_rates + at.mount * M;
    double arm[3], from_hub[3], deflecting[3];
    for (int i = 0; i < 3; ++i) {
      DoubleLanes dot = {}, rate = {};
      for (int v = 0; v < kVectors; ++v) {
        const DoubleLanes own = load(modes + i * M + 8 * v);
        dot += load(alpha + 8 * v) * own, rate += load(rates + 8 * v) * own;
      }
      arm[i] = part.contact_points[3 * at.point + i] + sum_lanes(dot);
      from_hub[i] = view.origin[i] + arm[i];
      deflecting[i] = sum_lanes(rate);
    }
    if (settings.foreseen) turning_drift(view.turning, from_hub, deflecting, settings.time_step, drift);
    hub_jacobian(axes(at, view.world, turned), arm, jacobian);
    for (int i = 0; i < 3; ++i) {
      alignas(64) double modal[M], reduced[8];
      DoubleLanes free = {}, hub_row = {}, coupled = {};
      for (int v = 0; v < kVectors; ++v) {
        const DoubleLanes value = jacobian[i][0] * load(modes + 8 * v) + jacobian[i][1] * load(modes + M + 8 * v) +
                                  jacobian[i][2] * load(modes + 2 * M + 8 * v);
        store(&modal[8 * v], value);
        free += value * load(&view.free_rates[8 * v]);
      }
      times_inverse<M>(modal, work.mounts[at.mount].leg.inverse_upper, row.response[i]);
      for (int a = 0; a < M; ++a) coupled += modal[a] * load(view.hub_response[a]);
      store(reduced, coupled);
      row.free_velocity[i] = sum_lanes(free);
      for (int j = 0; j < 6; ++j) {
        row.free_velocity[i] += jacobian[i][j] * view.free_velocity[j];
        hub_row += (jacobian[i][j] - reduced[j]) * load(view.to_factor[j]);
      }
      store(&row.response[i][M], hub_row);
    }
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) row.free_velocity[i] += jacobian[i][j] * drift[j];
  row.free_velocity[0] += at.gap / settings.time_step;
  if (row.flexibility)
    for (int i = 1; i < 3; ++i)
      row.free_velocity[i] -= moved_before(parts[robot.mounts[at.mount].part], robot.mounts[at.mount], at.point, i, settings,
                                           state, work.views[at.mount]) / settings.time_step;
  for (int i = 0; i < 3; ++i) row.impulse[i] = state.impulses[3 * row.contact + i];
  row.friction = contact_friction(settings, robot.friction + 2 * row.contact, row.impulse[0]);
  finish_row(row, settings);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
