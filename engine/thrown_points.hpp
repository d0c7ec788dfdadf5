// Points that nobody watched and that a step's own impulses throw into the floor: one leg lands, and another comes down
// faster than it did. After every solve the end of each such point is bounded from below, for a whole part at once; where
// the bound lets one pass the floor, all points of the part are looked at again, by the motion found. So the law (28) of
// docs/physics.md holds for every point.
//
// An unwatched point's gap is above the margin, and so is its gap after a step of the motion before. So it ends above the
// margin less what the change of its velocity takes, and a change below margin / time step needs no look.
#pragma once
#include "contact_rows.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Rare, and kept apart from what the compiler inlines and fuses for a step.
#define PNEUMORPH_RARELY __attribute__((noinline, cold))

template <class AnyCandidate>
inline bool is_watched(const AnyCandidate* candidates, int count, int mount, int point) {
  for (int c = 0; c < count; ++c)
    if (candidates[c].mount == mount && candidates[c].point == point) return true;
  return false;
}

// Sum of |c| by how far each mode takes any contact point: no point is bent by more [mm, or mm/s for rates].
template <int M>
inline double most_bent(const double* coefficients, const double* reach) {
  DoubleLanes sum = {};
  for (int v = 0; v < M; v += 8) {
    const DoubleLanes value = load(coefficients + v) * load(reach + v);
    sum += where_negative(value, -value, value);
  }
  return sum_lanes(sum);
}

inline double length_of(const double v[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// No point of mounted part k loses more upward speed to the solve than this [mm/s]; its old velocity is what
// find_part_candidates takes for it.
template <int M, class Real>
inline double most_thrown(const Part<Real>& part, int k, const RobotState& state, const double change[6],
                          const Workspace<M, Real>& work) {
  const MountView<M>& view = work.views[k];
  const double *up = view.world + 6, *alpha = state.modes + k * M, *old = state.mode_rates + k * M;
  double of_part[6], lever[3], thrown = 0;
  for (int i = 0; i < 6; ++i) {
    of_part[i] = 0;
    for (int j = 0; j < 6; ++j) of_part[i] += view.transform[6 * i + j] * change[j];
  }
  cross(up, of_part + 3, lever);
  for (int i = 0; i < 3; ++i)
    thrown += std::fabs(lever[i]) * part.contact_half[i] - lever[i] * part.contact_centre[i] - up[i] * of_part[i];
  alignas(64) double rates[M];
  for (int v = 0; v < M; v += 8) store(rates + v, load(work.rates[k] + v) - load(old + v));
  return thrown + most_bent<M>(rates, part.contact_reach) +
         length_of(view.next_lever) * most_bent<M>(alpha, part.contact_reach);
}

template <int M, class Real>
PNEUMORPH_RARELY int take_thrown_of_hub(const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                                        const RobotState& state, const Workspace<M, Real>& work, Candidate* candidates,
                                        int count) {
  const double* up = state.rotation + 6;
  for (int c = 0; c < robot.hub_contact_count; ++c) {
    const double* r = robot.hub_contact_points + 3 * c;
    const double gap = state.position[2] - settings.floor_height + up[0] * r[0] + up[1] * r[1] + up[2] * r[2];
    const Candidate at = {gap, gap, -1, c, false};
    if (next_gap(at, parts, robot, settings, state, work) < 0 && !is_watched(candidates, count, -1, c))
      candidates[count++] = at;
  }
  return count;
}

template <int M, class Real>
PNEUMORPH_RARELY int take_thrown_of_part(const Part<Real>* parts, const RobotModel& robot, int k,
                                         const Settings& settings, const RobotState& state,
                                         const Workspace<M, Real>& work, Candidate* candidates, int count) {
  const Part<Real>& part = parts[robot.mounts[k].part];
  const MountView<M>& view = work.views[k];
  const double *alpha = state.modes + k * M, *up = view.world + 6, h = settings.time_step;
  const double height = height_of_mount(robot, k, settings, state);
  // The lanes leave out how the deflection turns.
  const double turned = h * length_of(view.next_lever) * most_bent<M>(alpha, part.contact_reach);
  const float limit = float(turned - height + kHeightSlack);
  LaneView<M> lanes;
  alignas(64) float lowest[kLane];
  for (int i = 0; i < 3; ++i) lanes.up[i] = float(up[i]), lanes.lever[i] = float(h * view.next_lever[i]);
  lanes.drop = float(h * view.next_speed);
  for (int a = 0; a < M; ++a) lanes.coordinate[a] = float(alpha[a]), lanes.change[a] = float(h * work.rates[k][a]);
  for (int block = 0; block * kLane < part.contact_count; ++block) {
    lowest_of_block<M, Real>(part, lanes, block, lowest);
    for (int lane = 0; lane < kLane; ++lane) {
      const int c = block * kLane + lane;
      if (c >= part.contact_count || lowest[lane] >= limit) continue;
      const double gap = gap_of_point<M>(part, c, alpha, up, height);
      const Candidate at = {gap, gap, k, c, false};
      if (next_gap(at, parts, robot, settings, state, work) < 0 && !is_watched(candidates, count, k, c))
        candidates[count++] = at;
    }
  }
  return count;
}

// Candidates with the points besides that the last solve's motion takes below the floor.
template <int M, class Real>
inline int take_thrown_points(const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                              const RobotState& state, const Workspace<M, Real>& work, Candidate* candidates, int count) {
  const double allowed = settings.contact_margin / settings.time_step, *up = state.rotation + 6;
  double change[6], lever[3], lost = 0;
  for (int i = 0; i < 6; ++i) change[i] = work.hub.next_velocity[i] - work.hub.velocity[i];
  cross(up, change + 3, lever);
  for (int i = 0; i < 3; ++i) lost -= up[i] * change[i];
  if (robot.hub_contact_count > 0 && lost + length_of(lever) * robot.hub_contact_reach > allowed)
    count = take_thrown_of_hub(parts, robot, settings, state, work, candidates, count);
  for (int k = 0; k < robot.mount_count; ++k)
    if (most_thrown<M>(parts[robot.mounts[k].part], k, state, change, work) > allowed)
      count = take_thrown_of_part(parts, robot, k, settings, state, work, candidates, count);
  return count;
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
