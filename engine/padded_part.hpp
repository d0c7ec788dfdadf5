// Parts as the kernels read them: modes padded to whole vectors, elements and contact points side by side.
#pragma once
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

#include "model.hpp"

namespace pneumorph {

// Plain input of one part, before padding; all arrays row-major, see `reduction/reduced_part.py`.
struct PartInput {
  int tetrahedron_law = 0, membrane_law = 0;  // of enum Law
  int modes = 0, tetrahedra = 0, membranes = 0, cavities = 0, contacts = 0;
  const double *tetrahedron_rest, *tetrahedron_gradient, *tetrahedron_lambda, *tetrahedron_mu;
  const double *membrane_rest, *membrane_gradient, *membrane_lambda, *membrane_mu;
  double yeoh_c2 = 0, yeoh_c3 = 0;  // over C1
  int pressures = 0, stretches = 0, branches = 0;
  double dilatation_lambda = 0, stretch_modulus = 0;
  const double *dilatation_1, *dilatation_2, *dilatation_3, *stretch_1, *stretch_2, *branch_ratio, *branch_time;
  int wall_gaps = 0, wall_pairs = 0;
  const double *wall_axis, *wall_axis_modes, *wall_pair_gap, *wall_pair, *wall_pair_modes, *wall_pair_stiffness;
  const double *linear_stiffness, *volume_1, *volume_2, *volume_3;
  double mass = 0;
  const double *first_moment, *first_moment_modes, *second_moment, *second_moment_modes, *second_moment_mode_pairs;
  const double *contact_points, *contact_modes;
  const double* contact_flexibility = nullptr;  // (point, point), null for none
  const double* snapshot_range = nullptr;  // (mode, mode), null where it is not known
};

// Zeros on a boundary of 64 bytes, with a little to spare. What is never touched of a large one takes no memory.
class AlignedArray {
 public:
  AlignedArray() = default;
  explicit AlignedArray(size_t bytes) : memory_(std::calloc(bytes + 2 * kAlignment, 1), &std::free) {
    if (!memory_) throw std::bad_alloc();
  }
  template <class T>
  T* as() const {
    return reinterpret_cast<T*>((reinterpret_cast<uintptr_t>(memory_.get()) + kAlignment - 1) / kAlignment * kAlignment);
  }

 private:
  static constexpr size_t kAlignment = 64;
  std::unique_ptr<void, void (*)(void*)> memory_{nullptr, &std::free};
};

// The part with `padded` modes; its arrays live in `storage`. Throws std::invalid_argument for too many cavities, pressures,
// stretches or branches.
template <class Real>
Part<Real> pad_part(std::vector<AlignedArray>& storage, const PartInput& in, int padded);

}  // namespace pneumorph
