// A mounted part in a robot's step: its system (8), eliminated onto the hub (23) of docs/physics.md. In the stepper a part
// of the elements of elements.hpp; in rubber.cpp, which has the same code in a namespace of its own, one of rubber.hpp
// that was begun.
#pragma once
#include "workspace.hpp"
#if !defined(PNEUMORPH_KERNEL_NAME)
#include "kept_rubber.hpp"
#endif

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Sets up mounted part k, eliminates its modes and adds what is left to the hub's system.
template <int M, class Real>
bool add_part(const Part<Real>* parts, const RobotModel& robot, int k, const Settings& settings,
              RobotState& state, Workspace<M, Real>& work, Clock& clock) {
  HubSystem& hub = work.hub;
  const Mount& mount = robot.mounts[k];
  const Part<Real>& part = parts[mount.part];
  const double* alpha = state.modes + k * M;
  const double* rates = state.mode_rates + k * M;
  MountMemory<M, Real>& memory = work.mounts[k];
#if defined(PNEUMORPH_KERNEL_NAME)
  ElementSystem<M, Real>& elements = memory.elements;
  const double* end = alpha;  // where its forces are
#else
  RubberSystem<M, Real>& rubber = work.rubber[k];
  ElementSystem<M, Real>& elements = rubber.system;  // the solid's alone are remembered
  const double* end = rubber.end;
#endif
  LegSystem<M>& leg = memory.leg;
  MountView<M>& view = work.views[k];
  double* transform = view.transform;
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
    for (int j = 0; j < 6; ++j) part_velocity[i] += transform[6 * i + j] * hub.velocity[j];
  }
  multiply_transposed(mount.rotation, hub.gravity, part_gravity);
  // The part's origin turns about the hub's: its centrifugal acceleration acts like gravity.
  double circle[9], inward[3];
  for (int i = 0; i < 3; ++i) view.turning[i] = part_velocity[3 + i];
  centrifugal_matrix(view.turning, circle);
  multiply_transposed(mount.rotation, t, view.origin);
  multiply(circle, view.origin, inward);
  for (int i = 0; i < 3; ++i) part_gravity[i] -= inward[i];
  for (int c = 0; c < part.cavity_count; ++c) part_pressure[c] = work.pressure[mount.regulators[c]];

#if defined(PNEUMORPH_KERNEL_NAME)
  if (!state.has_memory) memory.fresh_steps = memory.wait = 0;
  const bool kept = state.has_memory && keep_stiffness(part, alpha, rates, part_velocity + 3, settings, memory, state);
  if (!kept) {
    element_system<M, Real>(part, alpha, settings.edge_rotations != 0, settings.published_damping != 0, elements);
    ++state.tangent_total;
  }
#else
  constexpr bool kept = false;  // of the whole part; its solid's alone
  rubber_system<M, Real>(part, rates, settings, memory, state, rubber);
#endif
  clock.lap(0);
  add_inertia_and_loads<M, Real>(part, alpha, end, rates, part_velocity, part_gravity, part_pressure, settings, leg);
  clock.lap(1);
  if (!kept && !factor_modes<M, Real>(part, elements, settings, leg)) return false;
  eliminate_modes<M, Real>(part, alpha, elements, settings, leg);
  double half[36];
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      half[6 * i + j] = 0;
      for (int l = 0; l < 6; ++l) half[6 * i + j] += leg.hub[6 * i + l] * transform[6 * l + j];
    }
  for (int i = 0; i < 6; ++i) {
    for (int l = 0; l < 6; ++l) hub.right[i] += transform[6 * l + i] * leg.right_hub[l];
    for (int j = 0; j < 6; ++j)
      for (int l = 0; l < 6; ++l) hub.matrix[6 * i + j] += transform[6 * l + i] * half[6 * l + j];
  }
  clock.lap(2);
  return true;
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
