// Owns parts, robots and states, and advances the robots over threads.
//
// A robot's steps depend on nothing but the robot, and one thread takes it from first step to last,
// so results are the same bits for any batch and any number of threads.
#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "conditions.hpp"
#include "padded_part.hpp"
#include "snapshot_range.hpp"

namespace pneumorph {

struct MountInput {
  int part = 0;
  double rotation[9], translation[3];
  std::vector<int> regulators;
};

struct HubInput {
  double mass = 0, first_moment[3] = {0, 0, 0}, second_moment[9] = {0};
  std::vector<double> contact_points;
};

// A ground, as Ground of model.hpp has it.
struct GroundInput {
  double corner[2] = {0, 0}, spacing = 1, steepest = 0;
  int count[2] = {0, 0}, tile_cells = 1, tiles[2] = {0, 0};
  std::vector<double> nodes, ceilings;
};

class Batch {
 public:
  Batch(const std::vector<PartInput>& parts, const Settings& settings, bool single_precision,
        const std::string& instruction_set);
  Batch(const Batch&) = delete;  // robots point into its arrays
  Batch& operator=(const Batch&) = delete;

  // Robots at rest: hub at the origin, modes zero, pressures zero. `grounds` are held once; that of a robot is its number, or
  // -1 for a plane.
  void set_robots(const std::vector<HubInput>& hubs, const std::vector<int>& hub_of_robot,
                  const std::vector<std::vector<MountInput>>& mounts,
                  const std::vector<std::vector<double>>& pressure_rates,
                  const std::vector<std::vector<double>>& frictions, const std::vector<Conditions>& conditions,
                  std::vector<GroundInput> grounds, const std::vector<int>& ground_of_robot);
  void reset(int robot);
  // `command`: (robot, regulator) real kPa. `active`: null or one byte a robot.
  void advance(const double* command, long long steps, const unsigned char* active, int threads, bool profile);

  int robot_count() const { return int(states_.size()); }
  // Springs of a robot's mounts, (mount, branch, point, 6), padded to the most branches and points of any part.
  int spring_branches() const { return spring_branches_; }
  int spring_points() const { return spring_points_; }
  void read_springs(int robot, double* springs) const;
  void write_springs(int robot, const double* springs);
  int padded_modes() const { return padded_; }
  const std::string& instruction_set() const { return instruction_set_; }
  const Settings& settings() const { return settings_; }
  // What the impulses of a robot's state are over.
  double mass_factor(int robot) const { return conditions_[robot].mass_factor; }
  RobotState& state(int robot) { return states_[robot]; }
  const RobotModel& robot(int robot) const { return robots_[robot]; }
  const StageSeconds& stages() const { return stages_; }
  // Largest ratio since the robot was reset or forgot it, of the states that its steps ended in; NaN where no part knows
  // its range.
  double range_ratio(int robot) const { return range_ratios_[robot]; }
  void forget_range(int robot) { range_ratios_[robot] = ratio_at_rest(ranges_, robots_[robot]); }
  void clear_counters();
  // What a robot keeps of its last step beside its state, and its springs and impulses to the last bit, as this build has
  // it; empty: nothing.
  std::string memory(int robot) const;
  void set_memory(int robot, const std::string& memory);

 private:
  template <class Use>
  void for_springs_of(int robot, const Use& use) const;
  size_t impulse_bytes(int robot) const { return 3 * size_t(robots_[robot].contact_count) * sizeof(double); }
  void check_mounts(const std::vector<MountInput>& mounts) const;
  static void check_friction(const std::vector<double>& friction, size_t points);

  Settings settings_;
  bool single_precision_;
  std::string instruction_set_;
  int padded_ = 0, spring_branches_ = 0, spring_points_ = 0;
  std::vector<int> cavity_counts_, contact_counts_;
  std::vector<long> spring_counts_;  // numbers that a part's springs take
  std::vector<AlignedArray> storage_;
  std::vector<Part<float>> parts_single_;
  std::vector<Part<double>> parts_double_;
  std::vector<RobotModel> robots_;
  std::vector<RobotState> states_;
  std::vector<std::vector<Mount>> mounts_;
  std::vector<std::vector<int>> regulators_;
  std::vector<std::vector<double>> hub_points_, pressure_rates_, frictions_;
  std::vector<GroundInput> ground_inputs_;
  std::vector<Ground> grounds_;
  std::vector<Conditions> conditions_;   // of each robot
  std::vector<Settings> own_settings_;   // likewise
  std::vector<SnapshotRange> ranges_;  // of each part
  std::vector<double> range_ratios_;   // of each robot
  std::vector<AlignedArray> state_storage_;
  std::vector<size_t> spring_bytes_;  // of each robot
  int contact_capacity_ = 0;
  std::vector<AlignedArray> workspaces_;  // one for each thread
  unsigned long workspace_bytes_ = 0, mount_bytes_ = 0;
  StageSeconds stages_{};
};

}  // namespace pneumorph
