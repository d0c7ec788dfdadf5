// Owns parts, robots and states, and advances the robots over threads.
//
// A robot's steps depend on nothing but the robot, and one thread takes it from first step to last,
// so results are the same bits for any batch and any number of threads.
#pragma once
#include <cstdlib>
#include <algorithm>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "model.hpp"

namespace pneumorph {

// Plain input of one part, before padding; all arrays row-major, see `reduction/reduced_part.py`.
struct PartInput {
  int modes = 0, tetrahedra = 0, membranes = 0, cavities = 0, contacts = 0;
  const double *tetrahedron_rest, *tetrahedron_gradient, *tetrahedron_lambda, *tetrahedron_mu;
  const double *membrane_rest, *membrane_gradient, *membrane_lambda, *membrane_mu;
  const double *linear_stiffness, *volume_1, *volume_2, *volume_3;
  double mass = 0;
  const double *first_moment, *first_moment_modes, *second_moment, *second_moment_modes, *second_moment_mode_pairs;
  const double *contact_points, *contact_modes;
};

struct MountInput {
  int part = 0;
  double rotation[9], translation[3];
  std::vector<int> regulators;
};

struct HubInput {
  double mass = 0, first_moment[3] = {0, 0, 0}, second_moment[9] = {0};
  std::vector<double> contact_points;
};

class AlignedArray {
 public:
  AlignedArray() = default;
  explicit AlignedArray(size_t bytes)
      : data_(static_cast<char*>(std::aligned_alloc(64, (bytes + 127) / 64 * 64)), &std::free) {
    if (!data_) throw std::bad_alloc();
    __builtin_memset(data_.get(), 0, (bytes + 127) / 64 * 64);
  }
  template <class T>
  T* as() const { return reinterpret_cast<T*>(data_.get()); }

 private:
  std::unique_ptr<char, void (*)(void*)> data_{nullptr, &std::free};
};

class Batch {
 public:
  Batch(const std::vector<PartInput>& parts, const Settings& settings, bool single_precision,
        const std::string& instruction_set);
  Batch(const Batch&) = delete;  // robots point into its arrays
  Batch& operator=(const Batch&) = delete;

  // Robots at rest: hub at the origin, modes zero, pressures zero.
  void set_robots(const std::vector<HubInput>& hubs, const std::vector<int>& hub_of_robot,
                  const std::vector<std::vector<MountInput>>& mounts);
  void reset(int robot);
  // `command`: (robot, regulator) real kPa. `active`: null or one byte a robot.
  void advance(const double* command, long long steps, const unsigned char* active, int threads, bool profile);

  int robot_count() const { return int(states_.size()); }
  int padded_modes() const { return padded_; }
  const std::string& instruction_set() const { return instruction_set_; }
  const Settings& settings() const { return settings_; }
  RobotState& state(int robot) { return states_[robot]; }
  const RobotModel& robot(int robot) const { return robots_[robot]; }
  const StageSeconds& stages() const { return stages_; }
  void clear_counters();

 private:
  void check_mounts(const std::vector<MountInput>& mounts) const;
  template <class Real>
  void pad_parts(const std::vector<PartInput>& inputs);

  Settings settings_;
  bool single_precision_;
  std::string instruction_set_;
  int padded_ = 0;
  std::vector<int> cavity_counts_, contact_counts_;
  std::vector<AlignedArray> storage_;
  std::vector<Part<float>> parts_single_;
  std::vector<Part<double>> parts_double_;
  std::vector<RobotModel> robots_;
  std::vector<RobotState> states_;
  std::vector<std::vector<Mount>> mounts_;
  std::vector<std::vector<int>> regulators_;
  std::vector<std::vector<double>> hub_points_;
  std::vector<AlignedArray> state_storage_;
  int contact_capacity_ = 0;
  StageSeconds stages_{};
};

}  // namespace pneumorph
