#include "batch.hpp"

#include <atomic>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <thread>

namespace pneumorph {

namespace {

template <class Real>
Real* allocate(std::vector<AlignedArray>& storage, size_t count) {
  storage.emplace_back(count * sizeof(Real));
  return storage.back().as<Real>();
}

// Copies (rows, modes) into (rows, padded), zeros behind.
const double* pad_rows(std::vector<AlignedArray>& storage, const double* from, size_t rows, int modes, int padded) {
  double* to = allocate<double>(storage, rows * padded + 8);
  for (size_t r = 0; r < rows; ++r)
    for (int a = 0; a < modes; ++a) to[r * padded + a] = from[r * modes + a];
  return to;
}

const double* copy(std::vector<AlignedArray>& storage, const double* from, size_t count) {
  double* to = allocate<double>(storage, count + 1);
  for (size_t i = 0; i < count; ++i) to[i] = from[i];
  return to;
}

template <class Real>
ElementFamily<Real> pad_family(std::vector<AlignedArray>& storage, int columns, int count, const double* rest,
                               const double* gradient, const double* lambda, const double* mu, int modes, int padded) {
  const int rows = 3 * columns;
  ElementFamily<Real> family;
  family.block_count = (count + kLane - 1) / kLane;
  const size_t elements = size_t(family.block_count) * kLane;
  Real* rest_lanes = allocate<Real>(storage, elements * rows);
  Real* gradient_lanes = allocate<Real>(storage, elements * rows * padded);
  Real* gradient_modes = allocate<Real>(storage, elements * rows * padded);
  Real* lambda_lanes = allocate<Real>(storage, elements);
  Real* mu_lanes = allocate<Real>(storage, elements);
  Real* shear_root = allocate<Real>(storage, elements);
  Real* trace_root = allocate<Real>(storage, elements);
  for (size_t e = 0; e < elements; ++e) {
    const size_t block = e / kLane, lane = e % kLane;
    const bool real = e < size_t(count);
    for (int row = 0; row < rows; ++row) {
      // A padding element is at rest with no stiffness.
      const double value = real ? rest[e * rows + row] : (row % (columns + 1) == 0 ? 1.0 : 0.0);
      rest_lanes[(block * rows + row) * kLane + lane] = Real(value);
      for (int a = 0; real && a < modes; ++a) {
        const Real g = Real(gradient[(e * rows + row) * modes + a]);
        gradient_lanes[((block * rows + row) * padded + a) * kLane + lane] = g;
        gradient_modes[(e * rows + row) * padded + a] = g;
      }
    }
    const double l = real ? lambda[e] : 0.0, m = real ? mu[e] : 0.0;
    lambda_lanes[e] = Real(l);
    mu_lanes[e] = Real(m);
    shear_root[e] = Real(std::sqrt(2 * m));
    trace_root[e] = Real((std::sqrt(columns * l + 2 * m) - std::sqrt(2 * m)) / columns);
  }
  family.rest = rest_lanes;
  family.gradient_lanes = gradient_lanes;
  family.gradient_modes = gradient_modes;
  family.lambda = lambda_lanes;
  family.mu = mu_lanes;
  family.shear_root = shear_root;
  family.trace_root = trace_root;
  return family;
}

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

}  // namespace

template <class Real>
void Batch::pad_parts(const std::vector<PartInput>& inputs) {
  std::vector<Part<Real>> parts;
  for (const PartInput& in : inputs) {
    const int m = in.modes, p = padded_;
    if (in.cavities > kMaximumRegulators)
      throw std::invalid_argument("a part has " + std::to_string(in.cavities) + " cavities, at most " +
                                  std::to_string(kMaximumRegulators) + " are supported");
    Part<Real> part;
    part.tetrahedra = pad_family<Real>(storage_, 3, in.tetrahedra, in.tetrahedron_rest, in.tetrahedron_gradient,
                                       in.tetrahedron_lambda, in.tetrahedron_mu, m, p);
    part.membranes = pad_family<Real>(storage_, 2, in.membranes, in.membrane_rest, in.membrane_gradient,
                                      in.membrane_lambda, in.membrane_mu, m, p);
    part.linear_stiffness = pad_rows(storage_, in.linear_stiffness, m, m, p);
    for (int i = 0; i < m * m; ++i) part.has_linear_stiffness |= in.linear_stiffness[i] != 0.0;
    if (part.has_linear_stiffness) {
      double* square = allocate<double>(storage_, size_t(p) * p);
      for (int a = 0; a < m; ++a)
        for (int b = 0; b < m; ++b) square[a * p + b] = in.linear_stiffness[a * m + b];
      part.linear_stiffness = square;
    }
    part.cavity_count = in.cavities;
    part.volume_1 = pad_rows(storage_, in.volume_1, in.cavities, m, p);
    double* quadratic = allocate<double>(storage_, size_t(in.cavities) * p * p + 8);
    double* cubic = allocate<double>(storage_, size_t(in.cavities) * p * p * p + 8);
    for (int c = 0; c < in.cavities; ++c)
      for (int a = 0; a < m; ++a)
        for (int b = 0; b < m; ++b) {
          quadratic[(size_t(c) * p + a) * p + b] = in.volume_2[(size_t(c) * m + a) * m + b];
          for (int d = 0; d < m; ++d)
            cubic[((size_t(c) * p + a) * p + b) * p + d] = in.volume_3[((size_t(c) * m + a) * m + b) * m + d];
        }
    part.volume_2 = quadratic;
    part.volume_3 = cubic;
    part.mass = in.mass;
    for (int i = 0; i < 3; ++i) part.first_moment[i] = in.first_moment[i];
    for (int i = 0; i < 9; ++i) part.second_moment[i] = in.second_moment[i];
    part.first_moment_modes = pad_rows(storage_, in.first_moment_modes, 3, m, p);
    part.second_moment_modes = pad_rows(storage_, in.second_moment_modes, 9, m, p);
    double* pairs = allocate<double>(storage_, size_t(9) * p * p);
    for (int ij = 0; ij < 9; ++ij)
      for (int b = 0; b < m; ++b)
        for (int a = 0; a < m; ++a)
          pairs[(size_t(ij) * p + b) * p + a] = in.second_moment_mode_pairs[(size_t(ij) * m + b) * m + a];
    part.second_moment_mode_pairs = pairs;
    double* gyroscopic = allocate<double>(storage_, size_t(3) * p * p);
    for (int k = 0; k < 3; ++k) {
      const size_t ij = 3 * ((k + 1) % 3) + (k + 2) % 3, ji = 3 * ((k + 2) % 3) + (k + 1) % 3;
      for (size_t ba = 0; ba < size_t(p) * p; ++ba)
        gyroscopic[k * size_t(p) * p + ba] = pairs[ij * p * p + ba] - pairs[ji * p * p + ba];
    }
    part.gyroscopic = gyroscopic;
    part.contact_count = in.contacts;
    part.contact_points = copy(storage_, in.contact_points, size_t(in.contacts) * 3);
    part.contact_modes = pad_rows(storage_, in.contact_modes, size_t(in.contacts) * 3, m, p);
    parts.push_back(part);
    cavity_counts_.push_back(in.cavities);
    contact_counts_.push_back(in.contacts);
  }
  if constexpr (sizeof(Real) == 4)
    parts_single_ = parts;
  else
    parts_double_ = parts;
}

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
  if (single_precision)
    pad_parts<float>(parts);
  else
    pad_parts<double>(parts);
  select_kernel(instruction_set_, padded_, single_precision_, 0);
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

void Batch::set_robots(const std::vector<HubInput>& hubs, const std::vector<int>& hub_of_robot,
                       const std::vector<std::vector<MountInput>>& mounts) {
  const size_t count = mounts.size();
  // Everything is checked first, so that a refused call leaves the old robots as they were.
  for (size_t r = 0; r < count; ++r) {
    if (hub_of_robot[r] < 0 || size_t(hub_of_robot[r]) >= hubs.size())
      throw std::invalid_argument("a robot names hub " + std::to_string(hub_of_robot[r]) + " of " +
                                  std::to_string(hubs.size()));
    check_mounts(mounts[r]);
  }
  robots_.assign(count, RobotModel{});
  states_.assign(count, RobotState{});
  mounts_.assign(count, {});
  regulators_.assign(count, {});
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
    size_t regulator_total = 0;
    for (const MountInput& mount : mounts[r]) regulator_total += mount.regulators.size();
    regulators_[r].reserve(regulator_total + 1);
    int contacts = robot.hub_contact_count;
    for (const MountInput& in : mounts[r]) {
      Mount mount;
      mount.part = in.part;
      for (int i = 0; i < 9; ++i) mount.rotation[i] = in.rotation[i];
      for (int i = 0; i < 3; ++i) mount.translation[i] = in.translation[i];
      mount.regulators = regulators_[r].data() + regulators_[r].size();
      for (int regulator : in.regulators) regulators_[r].push_back(regulator);
      mount.contact_offset = contacts;
      contacts += contact_counts_[in.part];
      mounts_[r].push_back(mount);
    }
    robot.mounts = mounts_[r].data();
    robot.mount_count = int(mounts_[r].size());
    robot.contact_count = contacts;
    contact_capacity_ = std::max(contact_capacity_, contacts);
    const size_t modal = size_t(robot.mount_count) * padded_;
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
  fresh.rotation[0] = fresh.rotation[4] = fresh.rotation[8] = 1;
  for (int i = 0; i < model.mount_count * padded_; ++i) fresh.modes[i] = fresh.mode_rates[i] = 0;
  for (int i = 0; i < 3 * model.contact_count; ++i) fresh.impulses[i] = 0;
  state = fresh;
}

void Batch::clear_counters() {
  stages_ = StageSeconds{};
  for (RobotState& state : states_) {
    state.step_count = state.contact_total = state.sweep_total = state.unconverged_total = 0;
    state.worst_penetration = state.worst_residual = 0;
  }
}

void Batch::advance(const double* command, long long steps, const unsigned char* active, int threads, bool profile) {
  const Kernel kernel = select_kernel(instruction_set_, padded_, single_precision_, contact_capacity_);
  const void* parts = single_precision_ ? static_cast<const void*>(parts_single_.data())
                                        : static_cast<const void*>(parts_double_.data());
  const int count = robot_count();
  threads = std::max(1, std::min(threads, count));
  std::atomic<int> next{0};
  std::mutex sum_stages;
  auto work = [&] {
    AlignedArray workspace(kernel.workspace_bytes);
    StageSeconds stages{};
    for (int r = next.fetch_add(1); r < count; r = next.fetch_add(1))
      if (!active || active[r])
        kernel.advance(parts, robots_[r], settings_, command + size_t(r) * settings_.regulator_count, steps,
                       states_[r], workspace.as<void>(), profile ? &stages : nullptr);
    const std::lock_guard<std::mutex> guard(sum_stages);
    for (int i = 0; i < kStageCount; ++i) stages_.seconds[i] += stages.seconds[i];
  };
  std::vector<std::thread> pool;
  for (int t = 1; t < threads; ++t) pool.emplace_back(work);
  work();
  for (std::thread& thread : pool) thread.join();
}

}  // namespace pneumorph
