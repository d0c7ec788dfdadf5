// How far a robot's parts are from rest, relative to the furthest snapshot they were reduced from: (43) of docs/physics.md,
// pneumorph/reduction/snapshot_range.py. Beside the kernels, which know nothing of it: it changes no step.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "model.hpp"

namespace pneumorph {

// Rows W of a part, (mode, mode); none of a part that does not know its range.
struct SnapshotRange {
  int modes = 0;
  std::vector<double> rows;

  double ratio(const double* alpha) const {
    double square = 0;
    for (int i = 0; i < modes; ++i) {
      double along = 0;
      for (int a = 0; a < modes; ++a) along += rows[size_t(i) * modes + a] * alpha[a];
      square += along * along;
    }
    return std::sqrt(square);
  }
};

// What a robot's largest ratio is before its first step: NaN where none of its parts knows its range.
inline double ratio_at_rest(const std::vector<SnapshotRange>& ranges, const RobotModel& robot) {
  for (int k = 0; k < robot.mount_count; ++k)
    if (ranges[robot.mounts[k].part].modes > 0) return 0;
  return std::numeric_limits<double>::quiet_NaN();
}

// Advances a robot, whose mounts have `padded` modes each, and notes its largest ratio after any step. It goes step by
// step where a part knows its range: a kernel takes one step as it takes many.
inline void advance_and_note(const Kernel& kernel, const void* parts, const std::vector<SnapshotRange>& ranges, int padded,
                             const RobotModel& robot, const Settings& settings, const double* command, long long steps,
                             RobotState& state, void* workspace, StageSeconds* stages, double& most) {
  if (std::isnan(most)) return kernel.advance(parts, robot, settings, command, steps, state, workspace, stages);
  for (long long step = 0; step < steps && state.status == kRunning; ++step) {
    kernel.advance(parts, robot, settings, command, 1, state, workspace, stages);
    for (int k = 0; k < robot.mount_count; ++k)
      most = std::max(most, ranges[robot.mounts[k].part].ratio(state.modes + size_t(k) * padded));
  }
}

}  // namespace pneumorph
