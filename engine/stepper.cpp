// One implicit step of one robot: parts eliminated onto the hub, contact solved, everything moved on.
//
// Compiled once per instruction set (PNEUMORPH_INSTRUCTION_SET names the copy). The system is a block
// arrow: modal blocks D_k of the mounted parts, a hub block of six unknowns (velocity of the hub's
// origin and turning rate, along the hub's own axes). Contact impulses act through
//   W = G G^T + P P^T,  G_c = J_modes U^-1 (per part),  P_c = (J_hub - G_c E) X L_hub^-T,
// so a Gauss-Seidel update costs a product with M + 6 numbers per row.
#include <ctime>

#include "friction.hpp"
#include "leg_system.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

template <int M>
struct ContactRow {
  alignas(64) double response[3][M + 8];  // rows: normal, x, y; columns: modes of its part, hub (6, padded)
  PointOperator point;
  double free_velocity[3];
  double* impulse;
  int mount;                              // -1: on the hub
};

template <int M>
struct ContactAccumulator {
  alignas(64) double modes[kMaximumMounts + 1][M];  // last: stands for the hub's own points
  alignas(64) double hub[8];
};

template <int M, class Real>
struct Workspace {
  ElementSystem<M, Real> elements;
  LegSystem<M> legs[kMaximumMounts];
  double transform[kMaximumMounts][36];  // hub unknowns (hub axes) to part unknowns (part axes)
  double world[kMaximumMounts][9];       // part frame to world
  alignas(64) double rates[kMaximumMounts][M];
  ContactAccumulator<M> sum;
  ContactRow<M> rows[1];                 // as many as the robot has contact points
};

struct Clock {
  explicit Clock(StageSeconds* s) : stages(s) {
    if (stages) last = now();
  }
  void lap(int stage) {
    if (!stages) return;
    const double time = now();
    stages->seconds[stage] += time - last;
    last = time;
  }
  static double now() {
    timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
  }
  StageSeconds* stages;
  double last = 0;
};

// Velocity of a contact row at zero contact impulse, its response and its operator.
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

template <int M, class Real>
bool step_robot(const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                const double* command, RobotState& state, Workspace<M, Real>& work, StageSeconds* stages) {
  constexpr int kVectors = M / 8;
  const double h = settings.time_step;
  const bool published = settings.published_damping != 0;
  Clock clock(stages);

  double pressure[kMaximumRegulators];
  const double most = settings.pressure_rate * h;
  for (int i = 0; i < settings.regulator_count; ++i) {
    const double change = command[i] - state.regulated[i];
    state.regulated[i] += change > most ? most : (change < -most ? -most : change);
    pressure[i] = std::fmax(0.0, settings.pressure_slope * state.regulated[i] + settings.pressure_intercept);
  }

  // The hub's own block, along the hub's axes.
  double velocity[6], gravity[3];
  multiply_transposed(state.rotation, state.velocity, velocity);
  multiply_transposed(state.rotation, state.angular_velocity, velocity + 3);
  multiply_transposed(state.rotation, settings.gravity, gravity);
  double hub[36] = {0}, right[6];
  {
    const double mass_scale = 1.0 + settings.mass_damping * h;
    const double* first = robot.hub_first_moment;
    const double* second = robot.hub_second_moment;
    double mass[36] = {0};
    for (int i = 0; i < 3; ++i) mass[7 * i] = robot.hub_mass;
    const double skew[9] = {0, first[2], -first[1], -first[2], 0, first[0], first[1], -first[0], 0};
    const double trace = second[0] + second[4] + second[8];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        mass[6 * i + 3 + j] = mass[6 * (3 + j) + i] = skew[3 * i + j];
        mass[6 * (3 + i) + 3 + j] = (i == j ? trace : 0.0) - second[3 * i + j];
      }
    double torque[3];
    cross(first, gravity, torque);
    for (int i = 0; i < 6; ++i) {
      right[i] = h * (i < 3 ? robot.hub_mass * gravity[i] : torque[i - 3]);
      for (int j = 0; j < 6; ++j) {
        right[i] += mass[6 * i + j] * velocity[j];
        hub[6 * i + j] = mass_scale * mass[6 * i + j];
      }
    }
  }

  for (int k = 0; k < robot.mount_count; ++k) {
    const Mount& mount = robot.mounts[k];
    const Part<Real>& part = parts[mount.part];
    const double* alpha = state.modes + k * M;
    const double* rates = state.mode_rates + k * M;
    LegSystem<M>& leg = work.legs[k];
    double* transform = work.transform[k];
    // V_part = R^T (V + W x t), W_part = R^T W.
    const double* t = mount.translation;
    for (int i = 0; i < 3; ++i) {
      const double axis[3] = {mount.rotation[i], mount.rotation[3 + i], mount.rotation[6 + i]};
      double lever[3];
      cross(t, axis, lever);
      for (int j = 0; j < 3; ++j) {
        transform[6 * i + j] = axis[j];
        transform[6 * i + 3 + j] = lever[j];
        transform[6 * (3 + i) + j] = 0;
        transform[6 * (3 + i) + 3 + j] = axis[j];
      }
    }
    double part_velocity[6], part_gravity[3], part_pressure[kMaximumRegulators];
    for (int i = 0; i < 6; ++i) {
      part_velocity[i] = 0;
      for (int j = 0; j < 6; ++j) part_velocity[i] += transform[6 * i + j] * velocity[j];
    }
    multiply_transposed(mount.rotation, gravity, part_gravity);
    for (int c = 0; c < part.cavity_count; ++c) part_pressure[c] = pressure[mount.regulators[c]];

    element_system<M, Real>(part, alpha, settings.edge_rotations != 0, published, work.elements);
    clock.lap(0);
    add_inertia_and_loads<M, Real>(part, alpha, rates, part_velocity, part_gravity, part_pressure, settings, leg);
    clock.lap(1);
    if (!eliminate_modes<M, Real>(part, alpha, work.elements, settings, leg)) return false;
    double half[36];
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        half[6 * i + j] = 0;
        for (int l = 0; l < 6; ++l) half[6 * i + j] += leg.hub[6 * i + l] * transform[6 * l + j];
      }
    for (int i = 0; i < 6; ++i) {
      for (int l = 0; l < 6; ++l) right[i] += transform[6 * l + i] * leg.right_hub[l];
      for (int j = 0; j < 6; ++j)
        for (int l = 0; l < 6; ++l) hub[6 * i + j] += transform[6 * l + i] * half[6 * l + j];
    }
    clock.lap(2);
  }

  double factor[36];
  if (!inverse_cholesky_6(hub, factor)) return false;
  double reduced_right[8], hub_free[6];  // the first padded like a row of responses
  times_hub_factor(right, factor, reduced_right);
  for (int i = 0; i < 6; ++i) {
    hub_free[i] = 0;
    for (int j = i; j < 6; ++j) hub_free[i] += factor[6 * j + i] * reduced_right[j];
  }
  clock.lap(2);

  // Contact rows of every point near the floor.
  int row_count = 0;
  double deepest = 0;
  auto& sum = work.sum;
  __builtin_memset(&sum, 0, sizeof(sum));
  for (int c = 0; c < robot.hub_contact_count; ++c) {
    const double* point = robot.hub_contact_points + 3 * c;
    const double gap = state.position[2] - settings.floor_height + state.rotation[6] * point[0] +
                       state.rotation[7] * point[1] + state.rotation[8] * point[2];
    deepest = std::fmax(deepest, -gap);
    double* impulse = state.impulses + 3 * c;
    double turning[3];
    cross(velocity + 3, point, turning);
    double approach = 0;
    for (int i = 0; i < 3; ++i) approach += state.rotation[6 + i] * (velocity[i] + turning[i]);
    if (!(gap + std::fmin(0.0, h * approach) < settings.contact_margin)) {
      impulse[0] = impulse[1] = impulse[2] = 0;
      continue;
    }
    ContactRow<M>& row = work.rows[row_count++];
    double jacobian[3][6];
    hub_jacobian(state.rotation, point, jacobian);
    for (int i = 0; i < 3; ++i) {
      for (int v = 0; v < kVectors; ++v) store(&row.response[i][8 * v], DoubleLanes{});
      times_hub_factor(jacobian[i], factor, &row.response[i][M]);
      row.free_velocity[i] = i == 0 ? gap / h : 0.0;
      for (int j = 0; j < 6; ++j) row.free_velocity[i] += jacobian[i][j] * hub_free[j];
    }
    row.impulse = impulse;
    row.mount = -1;
    finish_row(row);
  }
  for (int k = 0; k < robot.mount_count; ++k) {
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
      for (int j = 0; j < 6; ++j) part_velocity[i] += work.transform[k][6 * i + j] * velocity[j];
    }
    for (int i = 0; i < 3; ++i) origin_speed += up[i] * part_velocity[i];
    cross(up, part_velocity + 3, lever);  // up . (W x y) = y . (up x W)
    const double* rates = state.mode_rates + k * M;
    // The free motion of this part: u = E^T-reduced right side less coupling with the hub.
    double part_free[6];
    alignas(64) double free_reduced[M];
    for (int i = 0; i < 6; ++i) {
      part_free[i] = 0;
      for (int j = 0; j < 6; ++j) part_free[i] += work.transform[k][6 * i + j] * hub_free[j];
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
        times_hub_factor(hub_row, factor, &row.response[i][M]);
        row.free_velocity[i] = velocity_sum;
      }
      row.impulse = impulse;
      row.mount = k;
      finish_row(row);
    }
  }
  clock.lap(3);

  // Projected Gauss-Seidel with exact Coulomb cones, warm started.
  for (int c = 0; c < row_count; ++c) {
    const ContactRow<M>& row = work.rows[c];
    double* modes = sum.modes[row.mount < 0 ? kMaximumMounts : row.mount];
    for (int i = 0; i < 3; ++i) {
      for (int v = 0; v < kVectors; ++v)
        store(modes + 8 * v, load(modes + 8 * v) + row.impulse[i] * load(&row.response[i][8 * v]));
      store(sum.hub, load(sum.hub) + row.impulse[i] * load(&row.response[i][M]));
    }
  }
  int sweep = 0;
  double residual = 0;
  while (row_count > 0 && sweep < settings.contact_sweeps) {
    residual = 0;
    ++sweep;
    for (int c = 0; c < row_count; ++c) {
      ContactRow<M>& row = work.rows[c];
      double* modes = sum.modes[row.mount < 0 ? kMaximumMounts : row.mount];
      DoubleLanes dots[3];
      const DoubleLanes hub_sum = load(sum.hub);
      for (int i = 0; i < 3; ++i) dots[i] = hub_sum * load(&row.response[i][M]);
      for (int v = 0; v < kVectors; ++v) {
        const DoubleLanes value = load(modes + 8 * v);
        for (int i = 0; i < 3; ++i) dots[i] += value * load(&row.response[i][8 * v]);
      }
      double v[3], delta[3];
      for (int i = 0; i < 3; ++i) v[i] = row.free_velocity[i] + sum_lanes(dots[i]);
      residual = std::fmax(residual, project_point(row.point, v, settings.friction, row.impulse, delta));
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
  clock.lap(4);

  // New velocities; a step that is not finite and slow enough leaves the state as it was.
  for (int i = 0; i < 6; ++i) {
    velocity[i] = hub_free[i];
    for (int j = i; j < 6; ++j) velocity[i] += factor[6 * j + i] * sum.hub[j];
  }
  bool sound = true;
  for (int i = 0; i < 3; ++i)
    sound = sound && std::fabs(velocity[i]) < settings.speed_limit && std::fabs(h * velocity[3 + i]) < 1.0;
  for (int k = 0; k < robot.mount_count; ++k) {
    const LegSystem<M>& leg = work.legs[k];
    double part_velocity[6];
    for (int i = 0; i < 6; ++i) {
      part_velocity[i] = 0;
      for (int j = 0; j < 6; ++j) part_velocity[i] += work.transform[k][6 * i + j] * velocity[j];
    }
    alignas(64) double z[M];
    for (int v = 0; v < kVectors; ++v) {
      DoubleLanes value = load(&leg.reduced_right[8 * v]) + load(&sum.modes[k][8 * v]);
      for (int i = 0; i < 6; ++i) value -= part_velocity[i] * load(&leg.reduced_coupling[i][8 * v]);
      store(&z[8 * v], value);
    }
    double energy = 0;  // twice the kinetic energy of the modes: bounds every modal rate
    for (int a = 0; a < M; ++a) {
      DoubleLanes dot = {};
      for (int v = a / 8; v < kVectors; ++v) dot += load(&leg.inverse_upper[a][8 * v]) * load(&z[8 * v]);
      work.rates[k][a] = sum_lanes(dot);
      energy += work.rates[k][a] * work.rates[k][a];
    }
    const double mass = parts[robot.mounts[k].part].mass;
    sound = sound && energy < mass * settings.speed_limit * settings.speed_limit;
  }
  if (!sound) return false;
  for (int k = 0; k < robot.mount_count; ++k)
    for (int v = 0; v < kVectors; ++v) {
      const DoubleLanes rate = load(&work.rates[k][8 * v]);
      double* alpha = state.modes + k * M + 8 * v;
      store(state.mode_rates + k * M + 8 * v, rate);
      store(alpha, load(alpha) + h * rate);
    }
  double spatial[3], turn[3];
  multiply(state.rotation, velocity, spatial);
  multiply(state.rotation, velocity + 3, turn);
  for (int i = 0; i < 3; ++i) {
    state.velocity[i] = spatial[i];
    state.angular_velocity[i] = turn[i];
    state.position[i] += h * spatial[i];
    turn[i] *= h;
  }
  rotate_by(turn, state.rotation);
  state.active_contacts = row_count;
  state.sweeps = sweep;
  state.contact_residual = residual;
  state.step_count += 1;
  state.contact_total += row_count;
  state.sweep_total += sweep;
  state.worst_penetration = std::fmax(state.worst_penetration, deepest);
  clock.lap(5);
  return true;
}

template <int M, class Real>
void advance(const void* parts, const RobotModel& robot, const Settings& settings, const double* command,
             long long steps, RobotState& state, void* workspace, StageSeconds* stages) {
  auto& work = *static_cast<Workspace<M, Real>*>(workspace);
  for (long long step = 0; step < steps && state.status == kRunning; ++step)
    if (!step_robot<M, Real>(static_cast<const Part<Real>*>(parts), robot, settings, command, state, work, stages))
      state.status = kDiverged;
}

template <int M, class Real>
Kernel kernel_for(int contact_capacity) {
  Kernel kernel;
  kernel.advance = &advance<M, Real>;
  kernel.workspace_bytes = sizeof(Workspace<M, Real>) + sizeof(ContactRow<M>) * (unsigned long)(contact_capacity);
  return kernel;
}

Kernel kernel(int modes, int single_precision, int contact_capacity) {
  if (single_precision) {
    if (modes == 16) return kernel_for<16, float>(contact_capacity);
    if (modes == 8) return kernel_for<8, float>(contact_capacity);
    if (modes == 24) return kernel_for<24, float>(contact_capacity);
    if (modes == 32) return kernel_for<32, float>(contact_capacity);
  } else {
    if (modes == 8) return kernel_for<8, double>(contact_capacity);
    if (modes == 16) return kernel_for<16, double>(contact_capacity);
    if (modes == 24) return kernel_for<24, double>(contact_capacity);
    if (modes == 32) return kernel_for<32, double>(contact_capacity);
  }
  return Kernel{};
}

}  // namespace PNEUMORPH_INSTRUCTION_SET

Kernel PNEUMORPH_KERNEL_NAME(int modes, int single_precision, int contact_capacity) {
  return PNEUMORPH_INSTRUCTION_SET::kernel(modes, single_precision, contact_capacity);
}

}  // namespace pneumorph
