// The Python module `pneumorph._engine`.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>

#include <stdexcept>

#include "dense_contact.hpp"

namespace nb = nanobind;
using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using NewVector = nb::ndarray<nb::numpy, double, nb::ndim<1>>;

static NewVector to_numpy(std::vector<double> values) {
  auto* owned = new std::vector<double>(std::move(values));
  nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
  return NewVector(owned->data(), {owned->size()}, owner);
}

static std::tuple<NewVector, double, int> solve_friction_contacts(Matrix delassus, Vector free_velocity,
                                                                  double friction, Vector warm_start,
                                                                  double tolerance, int max_sweeps) {
  const size_t n = free_velocity.shape(0);
  if (n % 3 != 0 || delassus.shape(0) != n || delassus.shape(1) != n || warm_start.shape(0) != n)
    throw std::invalid_argument("delassus must be (3c, 3c) and free_velocity, warm_start (3c,)");
  pneumorph::ContactSolution solution;
  {
    nb::gil_scoped_release release;
    solution = pneumorph::solve_dense_contacts(delassus.data(), free_velocity.data(), int(n / 3), friction,
                                               warm_start.data(), tolerance, max_sweeps);
  }
  return {to_numpy(std::move(solution.impulse)), solution.residual, solution.sweeps};
}

NB_MODULE(_engine, module) {
  module.doc() = "Batched reduced-order stepper and contact solver.";
  module.def("solve_friction_contacts", &solve_friction_contacts, nb::arg("delassus"),
             nb::arg("free_velocity"), nb::arg("friction"), nb::arg("warm_start"), nb::arg("tolerance"),
             nb::arg("max_sweeps"),
             "Unilateral contact with Coulomb friction over a dense Delassus operator.\n\n"
             "Rows of a contact are normal, tangent, tangent. Returns impulse [mN s] (3c,), the largest\n"
             "violated velocity [mm/s] and the number of sweeps.");
}
