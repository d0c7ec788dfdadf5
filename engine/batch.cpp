#include "batch.hpp"

#include <atomic>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <type_traits>

#include "thread_pool.hpp"

namespace pneumorph {

namespace {

Kernel select_kernel(std::string& name, int modes, bool single_precision, int contact_capacity) {
#if defined(PNEUMORPH_X86)
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (name == "best") name = avx512 ? "avx512" : (avx2 ? "avx2" : "baseline");
  if (name == "avx512" && avx512) return kernel_avx512(modes, single_precision, contact_capacity);
  if (name == "avx2" && avx2) return kernel_avx2(modes, single_precision, contact_capacity);
#else
  if (name == "best") name = "baseline";
#endif
  if (name == "baseline") return kernel_baseline(modes, single_precision, contact_capacity);
  throw std::invalid_argument("instruction_set '" + name +
                              "' is not available on this machine; expected best, avx512, avx2 or baseline");
}

// Calls `use(left, c E, place)` for every component of every spring of a robot: what is left over of it, what the strain of
// the robot's modes adds (rubber.hpp), and its place in an array (mount, branch, point, 6) of these sizes.
template <class Real, class Use>
void for_springs(const std::vector<Part<Real>>& parts, const RobotModel& robot, const RobotState& state, double step,
                 int padded, int branches, int points, const Use& use) {
  constexpr int kFirst[6] = {0, 1, 2, 0, 0, 1}, kSecond[6] = {0, 1, 2, 1, 2, 2};
  for (int k = 0; k < robot.mount_count; ++k) {
    const Part<Real>& part = parts[robot.mounts[k].part];
    if (part.branch_count == 0) continue;
    const ElementFamily<Real>& family = part.tetrahedra;
    const double* alpha = state.modes + k * padded;
    Real* left = static_cast<Real*>(state.springs) + robot.mounts[k].spring_offset;
    const int count = (family.block_count - 1) * kLane + family.last_count;
    for (int point = 0; point < count; ++point) {
      const int block = point / kLane, lane = point % kLane;
      double f[9];
      for (int row = 0; row < 9; ++row) {
        f[row] = family.rest[(block * 9 + row) * kLane + lane];
        for (int a = 0; a < padded; ++a)
          f[row] += alpha[a] * family.gradient_lanes[((long(block) * padded + a) * 9 + row) * kLane + lane];
      }
      for (int i = 0; i < 6; ++i) {
        const int a = kFirst[i], b = kSecond[i];
        const double strain = 0.5 * (f[a] * f[b] + f[3 + a] * f[3 + b] + f[6 + a] * f[6 + b] - (a == b));
        for (int branch = 0; branch < part.branch_count; ++branch) {
          const double share = step / part.branch_time[branch], gain = -std::expm1(-share) / share;
          use(left[((long(block) * part.branch_count + branch) * 6 + i) * kLane + lane], gain * strain,
              ((size_t(k) * branches + branch) * points + point) * 6 + i);
        }
      }
    }
  }
}

}  // namespace

Batch::Batch(const std::vector<PartInput>& parts, const Settings& settings, bool single_precision,
             const std::string& instruction_set)
    : settings_(settings), single_precision_(single_precision), instruction_set_(instruction_set) {
  int most = 1;
  for (const PartInput& part : parts) most = std::max(most, part.modes);
  padded_ = (most + 7) / 8 * 8;
  if (padded_ > kMaximumModes)
    throw std::invalid_argument("a part has " + std::to_string(most) + " modes, at most " +
                                std::to_string(kMaximumModes) + " are supported; reduce it with a larger tolerance");
  if (settings.regulator_count > kMaximumRegulators)
    throw std::invalid_argument("regulator_count " + std::to_string(settings.regulator_count) + " exceeds " +
                                std::to_string(kMaximumRegulators));
  for (const PartInput& part : parts) {
    if (single_precision)
      parts_single_.push_back(pad_part<float>(storage_, part, padded_));
    else
      parts_double_.push_back(pad_part<double>(storage_, part, padded_));
    spring_counts_.push_back(single_precision ? parts_single_.back().spring_numbers() : parts_double_.back().spring_numbers());
    if (part.branches > 0) {
      spring_branches_ = std::max(spring_branches_, part.branches);
      spring_points_ = std::max(spring_points_, part.tetrahedra);
    }
    ranges_.emplace_back();
    if (part.snapshot_range)
      ranges_.back() = {part.modes, {part.snapshot_range, part.snapshot_range + size_t(part.modes) * part.modes}};
    cavity_counts_.push_back(part.cavities);
    contact_counts_.push_back(part.contacts);
  }
  mount_bytes_ = select_kernel(instruction_set_, padded_, single_precision_, 0).mount_bytes;
}

void Batch::check_mounts(const std::vector<MountInput>& mounts) const {
  if (mounts.size() > size_t(kMaximumMounts))
    throw std::invalid_argument("a robot has " + std::to_string(mounts.size()) + " mounted parts, at most " +
                                std::to_string(kMaximumMounts) + " are supported");
  for (const MountInput& mount : mounts) {
    if (mount.part < 0 || size_t(mount.part) >= cavity_counts_.size())
      throw std::invalid_argument("a mount names part " + std::to_string(mount.part) + " of " +
                                  std::to_string(cavity_counts_.size()));
    if (int(mount.regulators.size()) != cavity_counts_[mount.part])
      throw std::invalid_argument("a mount has " + std::to_string(mount.regulators.size()) + " regulators for " +
                                  std::to_string(cavity_counts_[mount.part]) + " cavities");
    for (int regulator : mount.regulators)
      if (regulator < 0 || regulator >= settings_.regulator_count)
        throw std::invalid_argument("unknown regulator " + std::to_string(regulator) + ", expected 0 to " +
                                    std::to_string(settings_.regulator_count - 1));
  }
}

void Batch::check_friction(const std::vector<double>& friction, size_t points) {
  if (friction.size() != 2 * points)
    throw std::invalid_argument("friction has " + std::to_string(friction.size()) + " numbers, expected two for each of " +
                                std::to_string(points) + " contact points");
}

void Batch::set_robots(const std::vector<HubInput>& hubs, const std::vector<int>& hub_of_robot,
                       const std::vector<std::vector<MountInput>>& mounts,
                       const std::vector<std::vector<double>>& pressure_rates,
                       const std::vector<std::vector<double>>& frictions, const std::vector<Conditions>& conditions,
                       std::vector<GroundInput> grounds, const std::vector<int>& ground_of_robot) {
  const size_t count = mounts.size();
  // Everything is checked first, so that a refused call leaves the old robots as they were.
  for (size_t r = 0; r < count; ++r) {
    if (hub_of_robot[r] < 0 || size_t(hub_of_robot[r]) >= hubs.size())
      throw std::invalid_argument("a robot names hub " + std::to_string(hub_of_robot[r]) + " of " +
                                  std::to_string(hubs.size()));
    check_mounts(mounts[r]);
    const size_t rates = 2 * size_t(settings_.regulator_count) * settings_.pressure_cells;
    if (pressure_rates[r].size() != rates)
      throw std::invalid_argument("a robot has " + std::to_string(pressure_rates[r].size()) +
                                  " rates of pressure, expected " + std::to_string(rates));
    size_t points = hubs[hub_of_robot[r]].contact_points.size() / 3;
    for (const MountInput& mount : mounts[r]) points += contact_counts_[mount.part];
    check_friction(frictions[r], points);
    if (ground_of_robot[r] < -1 || ground_of_robot[r] >= int(grounds.size()))
      throw std::invalid_argument("a robot names ground " + std::to_string(ground_of_robot[r]) + " of " +
                                  std::to_string(grounds.size()));
  }
  ground_inputs_ = std::move(grounds);
  grounds_.clear();
  for (const GroundInput& in : ground_inputs_) {
    Ground ground;
    for (int i = 0; i < 2; ++i) ground.corner[i] = in.corner[i], ground.count[i] = in.count[i], ground.tiles[i] = in.tiles[i];
    ground.spacing = in.spacing, ground.steepest = in.steepest, ground.tile_cells = in.tile_cells;
    ground.nodes = in.nodes.data(), ground.ceilings = in.ceilings.data();
    grounds_.push_back(ground);
  }
  pressure_rates_ = pressure_rates;
  frictions_.assign(count, {});
  conditions_ = conditions;
  own_settings_.clear();
  for (const Conditions& own : conditions) own_settings_.push_back(settings_under(own, settings_));
  robots_.assign(count, RobotModel{});
  states_.assign(count, RobotState{});
  mounts_.assign(count, {});
  regulators_.assign(count, {});
  range_ratios_.assign(count, 0);
  spring_bytes_.assign(count, 0);
  state_storage_.clear();
  hub_points_.clear();
  contact_capacity_ = 0;
  for (const HubInput& hub : hubs) hub_points_.push_back(hub.contact_points);
  for (size_t r = 0; r < count; ++r) {
    const HubInput& hub = hubs[hub_of_robot[r]];
    RobotModel& robot = robots_[r];
    robot.hub_mass = hub.mass;
    for (int i = 0; i < 3; ++i) robot.hub_first_moment[i] = hub.first_moment[i];
    for (int i = 0; i < 9; ++i) robot.hub_second_moment[i] = hub.second_moment[i];
    robot.hub_contact_points = hub_points_[hub_of_robot[r]].data();
    robot.hub_contact_count = int(hub_points_[hub_of_robot[r]].size() / 3);
    for (int c = 0; c < robot.hub_contact_count; ++c) {
      const double* at = robot.hub_contact_points + 3 * c;
      robot.hub_contact_reach = std::fmax(robot.hub_contact_reach, std::hypot(at[0], at[1], at[2]));
    }
    size_t regulator_total = 0;
    for (const MountInput& mount : mounts[r]) regulator_total += mount.regulators.size();
    regulators_[r].reserve(regulator_total + 1);
    int contacts = robot.hub_contact_count;
    long springs = 0;
    for (const MountInput& in : mounts[r]) {
      Mount mount;
      mount.part = in.part;
      for (int i = 0; i < 9; ++i) mount.rotation[i] = in.rotation[i];
      for (int i = 0; i < 3; ++i) mount.translation[i] = in.translation[i];
      mount.regulators = regulators_[r].data() + regulators_[r].size();
      for (int regulator : in.regulators) regulators_[r].push_back(regulator);
      mount.contact_offset = contacts;
      contacts += contact_counts_[in.part];
      mount.spring_offset = springs;
      springs += spring_counts_[in.part];
      mounts_[r].push_back(mount);
    }
    robot.mounts = mounts_[r].data();
    robot.mount_count = int(mounts_[r].size());
    robot.contact_count = contacts;
    robot.pressure_rates = pressure_rates_[r].data();
    robot.ground = ground_of_robot[r] < 0 ? nullptr : &grounds_[ground_of_robot[r]];
    // A heavier robot is stepped as the model with smaller forces.
    frictions_[r] = frictions[r];
    for (size_t i = 1; i < frictions_[r].size(); i += 2) frictions_[r][i] /= conditions_[r].mass_factor;
    robot.friction = frictions_[r].data();
    contact_capacity_ = std::max(contact_capacity_, contacts);
    const size_t modal = size_t(robot.mount_count) * padded_;
    state_storage_.emplace_back(robot.mount_count * mount_bytes_);
    states_[r].memory = state_storage_.back().as<void>();
    spring_bytes_[r] = springs * (single_precision_ ? sizeof(float) : sizeof(double));
    state_storage_.emplace_back(spring_bytes_[r]);
    states_[r].springs = state_storage_.back().as<void>();
    state_storage_.emplace_back((2 * modal + 3 * size_t(contacts) + 16) * sizeof(double));
    double* data = state_storage_.back().as<double>();
    states_[r].modes = data;
    states_[r].mode_rates = data + modal;
    states_[r].impulses = data + 2 * modal;
    reset(int(r));
  }
}

void Batch::reset(int robot) {
  RobotState& state = states_.at(robot);
  const RobotModel& model = robots_[robot];
  RobotState fresh{};
  fresh.modes = state.modes;
  fresh.mode_rates = state.mode_rates;
  fresh.impulses = state.impulses;
  fresh.memory = state.memory;
  fresh.springs = state.springs;
  fresh.rotation[0] = fresh.rotation[4] = fresh.rotation[8] = 1;
  for (int i = 0; i < model.mount_count * padded_; ++i) fresh.modes[i] = fresh.mode_rates[i] = 0;
  for (int i = 0; i < 3 * model.contact_count; ++i) fresh.impulses[i] = 0;
  __builtin_memset(fresh.springs, 0, spring_bytes_[robot]);
  state = fresh;
  forget_range(robot);
}

void Batch::clear_counters() {
  stages_ = StageSeconds{};
  for (RobotState& state : states_) {
    state.step_count = state.contact_total = state.sweep_total = state.newton_total = state.unconverged_total = 0;
    state.tangent_total = state.tangent_error_total = 0;
    state.worst_tangent_error = 0;
    state.worst_penetration = state.worst_residual = 0;
  }
}

std::string Batch::memory(int robot) const {
  const RobotState& state = states_.at(robot);
  if (!state.has_memory) return {};
  std::string kept{static_cast<const char*>(state.memory), robots_[robot].mount_count * mount_bytes_};
  kept.append(static_cast<const char*>(state.springs), spring_bytes_[robot]);
  return kept.append(reinterpret_cast<const char*>(state.impulses), impulse_bytes(robot));
}

void Batch::set_memory(int robot, const std::string& memory) {
  RobotState& state = states_.at(robot);
  const size_t of_mounts = robots_[robot].mount_count * mount_bytes_, springs = spring_bytes_[robot];
  const size_t expected = of_mounts + springs + impulse_bytes(robot);
  if (!memory.empty() && memory.size() != expected)
    throw std::invalid_argument("the memory of a robot has " + std::to_string(memory.size()) + " bytes, expected " +
                                std::to_string(expected) + "; it is of another robot, precision or instruction set");
  state.has_memory = !memory.empty();
  if (!state.has_memory) return;
  memory.copy(static_cast<char*>(state.memory), of_mounts);
  memory.copy(static_cast<char*>(state.springs), springs, of_mounts);
  memory.copy(reinterpret_cast<char*>(state.impulses), impulse_bytes(robot), of_mounts + springs);
}

template <class Use>
void Batch::for_springs_of(int robot, const Use& use) const {
  const auto of = [&](const auto& parts) {
    for_springs(parts, robots_.at(robot), states_[robot], settings_.time_step, padded_, spring_branches_, spring_points_, use);
  };
  if (single_precision_)
    of(parts_single_);
  else
    of(parts_double_);
}

void Batch::read_springs(int robot, double* springs) const {
  const auto read = [&](auto& left, double moved, size_t at) { springs[at] = double(left) + moved; };
  for_springs_of(robot, read);
}

void Batch::write_springs(int robot, const double* springs) {
  const auto write = [&](auto& left, double moved, size_t at) { left = std::decay_t<decltype(left)>(springs[at] - moved); };
  for_springs_of(robot, write);
}

void Batch::advance(const double* command, long long steps, const unsigned char* active, int threads, bool profile) {
  const Kernel kernel = select_kernel(instruction_set_, padded_, single_precision_, contact_capacity_);
  const void* parts = single_precision_ ? static_cast<const void*>(parts_single_.data())
                                        : static_cast<const void*>(parts_double_.data());
  const int count = robot_count();
  threads = std::max(1, std::min(threads, count));
  if (workspace_bytes_ != kernel.workspace_bytes) workspaces_.clear(), workspace_bytes_ = kernel.workspace_bytes;
  while (int(workspaces_.size()) < threads) workspaces_.emplace_back(workspace_bytes_);
  std::atomic<int> next{0};
  std::mutex sum_stages;
  run_in_threads(threads, [&](int thread) {
    StageSeconds stages{};
    for (int r = next.fetch_add(1); r < count; r = next.fetch_add(1))
      if (!active || active[r])
        advance_and_note(kernel, parts, ranges_, padded_, robots_[r], own_settings_[r],
                         command + size_t(r) * settings_.regulator_count, steps, states_[r],
                         workspaces_[thread].as<void>(), profile ? &stages : nullptr, range_ratios_[r]);
    const std::lock_guard<std::mutex> guard(sum_stages);
    for (int i = 0; i < kStageCount; ++i) stages_.seconds[i] += stages.seconds[i];
  });
}

}  // namespace pneumorph
