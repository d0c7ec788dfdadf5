// The world of one robot in a batch: what of its material, gravity, damping and floor is its own.
//
// Parts are shared. Their masses times m, hub included, are the same motion as all forces but weight and inertia over m: the
// modes stay orthonormal in the parts' own mass, and impulses are over m as well, which Coulomb's law does not notice.
// Equation (44) of docs/physics.md.
#pragma once
#include "model.hpp"

namespace pneumorph {

struct Conditions {
  double gravity[3] = {0, 0, -9800};  // mm/s^2, world axes
  double stiffness_damping = 0;       // s
  double modulus_factor = 1;          // of the parts' Young's moduli, not of their mounts'
  double mass_factor = 1;             // of parts and hub
  double damping_factor = 1;          // of the branches that relax
  double floor_height = 0;            // mm; what a ground's heights are counted from

  static constexpr int kCount = 8;
};

// Settings of a robot in its world.
inline Settings settings_under(const Conditions& conditions, Settings settings) {
  for (int i = 0; i < 3; ++i) settings.gravity[i] = conditions.gravity[i];
  settings.stiffness_damping = conditions.stiffness_damping;
  settings.elasticity = conditions.modulus_factor / conditions.mass_factor;
  settings.mount_elasticity = 1 / conditions.mass_factor;
  settings.branch_factor = conditions.damping_factor;
  settings.floor_height = conditions.floor_height;
  settings.pressure_slope /= conditions.mass_factor;
  settings.pressure_intercept /= conditions.mass_factor;
  return settings;
}

}  // namespace pneumorph
