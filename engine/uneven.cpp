// Contacts of a robot on a ground of heights, with the law of plane floors: each point sees the plane that touches the ground
// below it. Where a step ends with a point deeper than kDepth, because the ground bends within its way, the friction is solved
// again with the planes below where the points came to lie. Equation (32) of docs/physics.md.
//
// Compiled once per instruction set in a namespace of its own, as rubber.cpp is, so that nothing here changes what a compiler
// inlines and fuses for robots on planes.
#include "contact_solve.hpp"
#include "ground.hpp"
#include "mode_counts.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

constexpr double kDepth = 0.01;  // mm, as FullOrderSettings.penetration_tolerance_mm of full robots, and their passes
constexpr int kMostBends = 3;

// Axes of the plane that touches the ground, along a body's: x and y are its tangents, z its normal. The first tangent is in
// the world's plane of x and z.
struct UnevenAxes {
  const double* operator()(const Candidate& at, const double rotation[9], double* turned) const {
    const double* n = static_cast<const UnevenCandidate&>(at).normal;
    const double length = std::sqrt(n[0] * n[0] + n[2] * n[2]);
    double frame[9] = {n[2] / length, 0, -n[0] / length, 0, 0, 0, n[0], n[1], n[2]};
    cross(frame + 6, frame, frame + 3);
    multiply_matrices(frame, rotation, turned);
    return turned;
  }
};

// The hub's motion in the world.
struct HubMotion {
  double velocity[3], turning[3];
  // Velocity of a point that is fixed to the hub.
  void of(const double place[3], const double position[3], double* out) const {
    const double arm[3] = {place[0] - position[0], place[1] - position[1], place[2] - position[2]};
    cross(turning, arm, out);
    for (int i = 0; i < 3; ++i) out[i] += velocity[i];
  }
};

// What modal coordinates, or rates, do to a contact point, along the part's axes.
template <int M>
inline void deflection(const double* modes, const double* coefficients, double out[3]) {
  DoubleLanes sum[3] = {};
  for (int v = 0; v < M; v += 8)
    for (int i = 0; i < 3; ++i) sum[i] += load(modes + i * M + v) * load(coefficients + v);
  for (int i = 0; i < 3; ++i) out[i] = sum_lanes(sum[i]);
}

inline double dot3(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Gap of a place along the normal below it, which goes to `normal` [mm].
inline double gap_at(const Ground& ground, const Settings& settings, const double place[3], double normal[3]) {
  const double height = height_below(ground, place[0], place[1], normal);
  return normal[2] * (place[2] - settings.floor_height - height);
}

// Whether a point may come near where it goes, though it does not by the plane below it: the ground may rise on its way as
// steeply as anywhere.
inline bool may_come_near(const Ground& ground, const Settings& settings, const UnevenCandidate& at, const double velocity[3]) {
  const double aside = std::sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1]);
  const double above = at.gap / at.normal[2] + settings.time_step * (velocity[2] - ground.steepest * aside);
  return above < settings.contact_margin * std::sqrt(1 + ground.steepest * ground.steepest);
}

// Takes a point in, if it comes near at its velocity, by the plane below it or by the ground where it goes. Of the motion that
// a solve has `found`, those that are not watched yet.
inline int take_in(const RobotModel& robot, const Settings& settings, const double place[3], const double velocity[3],
                   int mount, int point, bool found, double lift, UnevenCandidate* candidates, int count, double& deepest) {
  if (found && is_watched(candidates, count, mount, point)) return count;
  UnevenCandidate& at = candidates[count];
  at.gap = gap_at(*robot.ground, settings, place, at.normal);
  deepest = std::fmax(deepest, -at.gap - lift);
  at.lowest = at.gap + std::fmin(0.0, settings.time_step * dot3(at.normal, velocity));
  if (found || (!(at.lowest < settings.contact_margin) && may_come_near(*robot.ground, settings, at, velocity))) {
    double end[3], below[3];
    for (int i = 0; i < 3; ++i) end[i] = place[i] + settings.time_step * velocity[i];
    at.lowest = std::fmin(at.lowest, gap_at(*robot.ground, settings, end, below));
  }
  if (!(at.lowest < settings.contact_margin)) return count;
  at.lowest += lift;
  at.working = false;
  for (int i = 0; i < 3; ++i) at.place[i] = place[i];
  at.mount = mount, at.point = point;
  return count + 1;
}

inline int find_uneven_hub_candidates(const RobotModel& robot, const Settings& settings, const RobotState& state,
                                      const HubMotion& motion, double reach, bool found, UnevenCandidate* candidates,
                                      int count, double& deepest) {
  const double fastest = length_of(motion.velocity) + length_of(motion.turning) * robot.hub_contact_reach;
  reach += settings.time_step * robot.ground->steepest * fastest;
  for (int c = 0; c < robot.hub_contact_count; ++c) {
    double place[3], velocity[3];
    multiply(state.rotation, robot.hub_contact_points + 3 * c, place);
    for (int i = 0; i < 3; ++i) place[i] += state.position[i];
    motion.of(place, state.position, velocity);
    const double lowest = place[2] - settings.floor_height + std::fmin(0.0, settings.time_step * velocity[2]);
    if (lowest > reach + ceiling_over(*robot.ground, place, place)) continue;
    count = take_in(robot, settings, place, velocity, -1, c, found, 0, candidates, count, deepest);
  }
  return count;
}

// All points' heights in single precision against the highest that the ground may be anywhere below the part, then the
// gaps of those that are lower.
template <int M, class Real>
int find_uneven_part_candidates(const Part<Real>& part, const RobotModel& robot, int k, const Settings& settings,
                                const RobotState& state, const HubMotion& motion, const double* rates, double reach, bool found,
                                const MountView<M>& view, UnevenCandidate* candidates, int count, double& deepest) {
  const double *alpha = state.modes + k * M, *world = view.world;
  const double h = settings.time_step;
  double origin[3], speed[3], turning[3], lever[3], bent = 0, low[2], high[2];
  multiply(state.rotation, robot.mounts[k].translation, origin);
  for (int i = 0; i < 3; ++i) origin[i] += state.position[i];
  motion.of(origin, state.position, speed);
  multiply_transposed(world, motion.turning, turning);
  cross(world + 6, turning, lever);
  for (int a = 0; a < M; ++a) bent += std::fabs(alpha[a]) * part.contact_reach[a];
  for (int i = 0; i < 2; ++i) {
    double centre = origin[i], half = bent;
    for (int j = 0; j < 3; ++j) {
      centre += world[3 * i + j] * part.contact_centre[j];
      half += std::fabs(world[3 * i + j]) * part.contact_half[j];
    }
    low[i] = centre - half, high[i] = centre + half;
  }
  // What comes from the side, at most as fast as any point of the part, to where the ground is higher; the lanes leave out how
  // the deflection turns.
  double middle[3], of_middle[3];
  multiply(world, part.contact_centre, middle);
  for (int i = 0; i < 3; ++i) middle[i] += origin[i];
  motion.of(middle, state.position, of_middle);
  const double turned = length_of(motion.turning) * bent;
  const double fastest = length_of(of_middle) + length_of(motion.turning) * length_of(part.contact_half) + turned +
                         most_bent<M>(rates, part.contact_reach);
  reach += h * (robot.ground->steepest * fastest + turned);
  const double over = ceiling_over(*robot.ground, low, high) + settings.floor_height - origin[2];
  const float limit = float(reach + over + kHeightSlack);
  LaneView<M> lanes;
  alignas(64) float lowest[kLane];
  for (int i = 0; i < 3; ++i) lanes.up[i] = float(world[6 + i]), lanes.lever[i] = float(h * lever[i]);
  lanes.drop = float(h * speed[2]);
  for (int a = 0; a < M; ++a) lanes.coordinate[a] = float(alpha[a]), lanes.change[a] = float(h * rates[a]);
  for (int block = 0; block * kLane < part.contact_count; ++block) {
    lowest_of_block<M, Real>(part, lanes, block, lowest);
    for (int lane = 0; lane < kLane; ++lane) {
      const int c = block * kLane + lane;
      if (c >= part.contact_count || lowest[lane] >= limit) continue;
      const double* modes = part.contact_modes + long(c) * 3 * M;
      double local[3], place[3], rate[3], moved[3], velocity[3];
      deflection<M>(modes, alpha, local);
      for (int i = 0; i < 3; ++i) local[i] += part.contact_points[3 * c + i];
      multiply(world, local, place);
      for (int i = 0; i < 3; ++i) place[i] += origin[i];
      deflection<M>(modes, rates, rate);
      multiply(world, rate, moved);
      motion.of(place, state.position, velocity);
      for (int i = 0; i < 3; ++i) velocity[i] += moved[i];
      const double lift = moved_before(part, robot.mounts[k], c, 0, settings, state, view);
      count = take_in(robot, settings, place, velocity, k, c, found, lift, candidates, count, deepest);
    }
  }
  return count;
}

// The largest change of velocity among all points of a part, but for turning of the deflection; change of its frame's
// velocity and turning rate along its axes, and of its modal rates [mm/s].
template <int M, class Real>
double most_changed(const Part<Real>& part, const double velocity[3], const double turning[3], const double* rates) {
  using L = Lanes<float, kLane * sizeof(float)>;
  using Floats = L::type;
  float of[3], by[3], of_modes[M];
  for (int i = 0; i < 3; ++i) of[i] = float(velocity[i]), by[i] = float(turning[i]);
  for (int a = 0; a < M; ++a) of_modes[a] = float(rates[a]);
  alignas(64) float squares[kLane];
  float most = 0;
  for (int block = 0; block * kLane < part.contact_count; ++block) {
    const float *point = part.contact_point_lanes + block * 3 * kLane, *modes = part.contact_mode_lanes + long(block) * M * 3 * kLane;
    const Floats x = L::load(point), y = L::load(point + kLane), z = L::load(point + 2 * kLane);
    Floats u = of[0] + by[1] * z - by[2] * y, v = of[1] + by[2] * x - by[0] * z, w = of[2] + by[0] * y - by[1] * x;
    for (int a = 0; a < M; ++a, modes += 3 * kLane) {
      u += of_modes[a] * L::load(modes);
      v += of_modes[a] * L::load(modes + kLane);
      w += of_modes[a] * L::load(modes + 2 * kLane);
    }
    L::store(squares, u * u + v * v + w * w);
    for (int lane = 0; lane < kLane && block * kLane + lane < part.contact_count; ++lane) most = std::fmax(most, squares[lane]);
  }
  return std::sqrt(double(most));
}

// Candidates with the points besides that the last solve's motion brings near the ground, as take_thrown_points of a plane.
// A quarter of the margin is kept for what the ground bends along the way.
template <int M, class Real>
int take_thrown_uneven_points(const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                              const RobotState& state, const HubMotion& motion, const Workspace<M, Real>& work,
                              UnevenCandidate* candidates, int count) {
  const double h = settings.time_step, slope = robot.ground->steepest;
  const double allowed = 0.75 * settings.contact_margin / h, reach = settings.contact_margin * std::sqrt(1 + slope * slope);
  const double turning = length_of(motion.turning);
  double above = 0;
  HubMotion change;
  for (int i = 0; i < 3; ++i) {
    change.velocity[i] = motion.velocity[i] - state.velocity[i];
    change.turning[i] = motion.turning[i] - state.angular_velocity[i];
  }
  const double turned = length_of(change.turning);
  if (robot.hub_contact_count > 0 && length_of(change.velocity) + turned * robot.hub_contact_reach > allowed) {
    count = find_uneven_hub_candidates(robot, settings, state, motion, reach, true, candidates, count, above);
  }
  for (int k = 0; k < robot.mount_count; ++k) {
    const Part<Real>& part = parts[robot.mounts[k].part];
    double place[3], centre[3], velocity[3];
    multiply(state.rotation, robot.mounts[k].translation, place);
    multiply(work.views[k].world, part.contact_centre, centre);
    for (int i = 0; i < 3; ++i) place[i] += centre[i] + state.position[i];
    alignas(64) double rates[M];
    for (int v = 0; v < M; v += 8) store(rates + v, load(work.rates[k] + v) - load(state.mode_rates + k * M + v));
    // The lanes leave out how the deflection turns.
    const double bent = turning * most_bent<M>(state.modes + k * M, part.contact_reach), half = length_of(part.contact_half);
    change.of(place, state.position, velocity);
    if (length_of(velocity) + turned * half + bent + most_bent<M>(rates, part.contact_reach) <= allowed) continue;
    double origin[3], of_frame[3], of_part[3], by_part[3];
    multiply(state.rotation, robot.mounts[k].translation, origin);
    for (int i = 0; i < 3; ++i) origin[i] += state.position[i];
    change.of(origin, state.position, of_frame);
    multiply_transposed(work.views[k].world, of_frame, of_part);
    multiply_transposed(work.views[k].world, change.turning, by_part);
    if (most_changed<M>(part, of_part, by_part, rates) + bent <= allowed) continue;
    count = find_uneven_part_candidates<M, Real>(part, robot, k, settings, state, motion, work.rates[k], reach, true,
                                                 work.views[k], candidates, count, above);
  }
  return count;
}

// Way of a candidate by the step's motion [mm].
template <int M, class Real>
void way_of(const UnevenCandidate& at, const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
            const RobotState& state, const HubMotion& motion, const Workspace<M, Real>& work, double way[3]) {
  motion.of(at.place, state.position, way);
  if (at.mount >= 0) {
    double rate[3], moved[3];
    deflection<M>(parts[robot.mounts[at.mount].part].contact_modes + long(at.point) * 3 * M, work.rates[at.mount], rate);
    multiply(work.views[at.mount].world, rate, moved);
    for (int i = 0; i < 3; ++i) way[i] += moved[i];
  }
  for (int i = 0; i < 3; ++i) way[i] *= settings.time_step;
}

// As solve_contacts of the stepper, on one plane for each point; then on the planes below where the points came to lie.
template <int M, class Real>
int solve_uneven_contacts(const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                          const RobotState& state, int candidate_count, Workspace<M, Real>& work, FrictionReport& report,
                          Clock& clock) {
  UnevenCandidate* candidates = work.uneven_candidates(robot);
  int row_count = 0, bends = 0;
  const auto add_row = [&](UnevenCandidate& at) {
    at.working = true;
    at.row = row_count++;
    make_row(at, parts, robot, settings, state, work, work.rows[at.row], UnevenAxes{});
  };
  for (int c = 0; c < candidate_count; ++c) {
    UnevenCandidate& at = candidates[c];
    const int contact = at.mount < 0 ? at.point : robot.mounts[at.mount].contact_offset + at.point;
    at.working = false;
    if (at.lowest < kNearGap || state.impulses[3 * contact] > 0) add_row(at);
  }
  clock.lap(3);
  const double allowed = settings.contact_tolerance * settings.time_step;
  for (int pass = 0;; ++pass) {
    solve_friction(settings, row_count, work, report);
    sum_impulses(row_count, work);
    const bool sound = find_velocities(parts, robot, settings, work);
    clock.lap(4);
    if (!sound) return -1;
    HubMotion motion;
    multiply(state.rotation, work.hub.next_velocity, motion.velocity);
    multiply(state.rotation, work.hub.next_velocity + 3, motion.turning);
    candidate_count = take_thrown_uneven_points(parts, robot, settings, state, motion, work, candidates, candidate_count);
    const int before = row_count;
    double deepest = 0, passed = 0, place[3];
    for (int c = 0; c < candidate_count; ++c) {
      UnevenCandidate& at = candidates[c];
      double below[3];
      way_of(at, parts, robot, settings, state, motion, work, at.way);
      for (int i = 0; i < 3; ++i) place[i] = at.place[i] + at.way[i];
      const double lift = flexible_lift(at, parts, robot, settings, work.rows, before);
      deepest = std::fmax(deepest, -gap_at(*robot.ground, settings, place, below) - lift);
      const double gap = at.gap + dot3(at.normal, at.way) + lift;
      if (at.working || gap >= -allowed) continue;
      passed = std::fmax(passed, -gap);
      if (pass < kContactPasses) add_row(at);
    }
    if (row_count == before) {
      if (deepest > kDepth && bends < kMostBends && pass < kContactPasses) {
        ++bends;
        for (int c = 0; c < candidate_count; ++c) {
          UnevenCandidate& at = candidates[c];
          for (int i = 0; i < 3; ++i) place[i] = at.place[i] + at.way[i];
          const double gap = gap_at(*robot.ground, settings, place, at.normal);
          at.gap = gap - dot3(at.normal, at.way);
          if (at.working) {
            ContactRow<M>& row = work.rows[at.row];
            const double impulse[3] = {row.impulse[0], row.impulse[1], row.impulse[2]};
            make_row(at, parts, robot, settings, state, work, row, UnevenAxes{});
            for (int i = 0; i < 3; ++i) row.impulse[i] = impulse[i];
          } else if (gap < -allowed) {
            add_row(at);
          }
        }
      } else {
        if (passed > allowed) report.residual = std::fmax(report.residual, passed / settings.time_step);
        clock.lap(3);
        return row_count;
      }
    }
    clock.lap(3);
  }
}

template <int M, class Real>
int uneven_contacts(const Part<Real>* parts, const RobotModel& robot, const Settings& settings, const RobotState& state,
                    void* of_stepper, void* of_clock, FrictionReport& report, double& deepest) {
  // The same structures as the stepper's, of this namespace.
  auto& work = *static_cast<Workspace<M, Real>*>(of_stepper);
  auto& clock = *static_cast<Clock*>(of_clock);
  HubMotion motion;
  for (int i = 0; i < 3; ++i) motion.velocity[i] = state.velocity[i], motion.turning[i] = state.angular_velocity[i];
  // A point this far over the highest ground where it goes is not near.
  const double slope = robot.ground->steepest, reach = settings.contact_margin * std::sqrt(1 + slope * slope);
  UnevenCandidate* candidates = work.uneven_candidates(robot);
  int count = find_uneven_hub_candidates(robot, settings, state, motion, reach, false, candidates, 0, deepest);
  for (int k = 0; k < robot.mount_count; ++k) {
    view_mount<M>(robot, k, state, work.hub, work.mounts[k].leg, work.views[k]);
    note_pressed(parts[robot.mounts[k].part], robot.mounts[k], state, work.views[k]);
    count = find_uneven_part_candidates<M, Real>(parts[robot.mounts[k].part], robot, k, settings, state, motion,
                                                 state.mode_rates + k * M, reach, false, work.views[k], candidates, count, deepest);
  }
  return solve_uneven_contacts(parts, robot, settings, state, count, work, report, clock);
}

template <class Real>
int uneven_contacts_of(int modes, const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                       const RobotState& state, void* work, void* clock, FrictionReport& report, double& deepest) {
  return with_modes(modes, [&](auto count) {
    return uneven_contacts<decltype(count)::value, Real>(parts, robot, settings, state, work, clock, report, deepest);
  });
}

}  // namespace PNEUMORPH_INSTRUCTION_SET

int PNEUMORPH_UNEVEN_NAME(int modes, const Part<float>* parts, const RobotModel& robot, const Settings& settings,
                          const RobotState& state, void* work, void* clock, FrictionReport& report, double& deepest) {
  return PNEUMORPH_INSTRUCTION_SET::uneven_contacts_of(modes, parts, robot, settings, state, work, clock, report, deepest);
}

int PNEUMORPH_UNEVEN_NAME(int modes, const Part<double>* parts, const RobotModel& robot, const Settings& settings,
                          const RobotState& state, void* work, void* clock, FrictionReport& report, double& deepest) {
  return PNEUMORPH_INSTRUCTION_SET::uneven_contacts_of(modes, parts, robot, settings, state, work, clock, report, deepest);
}

}  // namespace pneumorph
