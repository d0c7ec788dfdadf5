// `Friction` of the Python module.
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <stdexcept>
#include <string>
#include <tuple>

#include "dense_contact.hpp"
#include "numpy_arrays.hpp"

// Contacts of a full-order robot, with the shapes of what comes from Python checked.
class PythonFriction {
 public:
  PythonFriction(Matrix delassus, Vector free_velocity, Vector friction)
      : points_(check(delassus, free_velocity, friction)),
        problem_(delassus.data(), free_velocity.data(), friction.data(), int(points_)) {}

  NewArray sweep(Matrix start, double tolerance, int most) {
    std::vector<double> impulse;
    const double* from = checked(start);
    {
      nb::gil_scoped_release release;
      impulse = problem_.sweep(from, tolerance, most);
    }
    return to_numpy(std::move(impulse), {points_, 3});
  }

  std::tuple<NewArray, NewArray, double> newton(Matrix start, double tolerance) {
    const double* from = checked(start);
    std::vector<double> impulse, velocity;
    double residual;
    {
      nb::gil_scoped_release release;
      const auto& best = problem_.newton(from, tolerance);
      impulse.assign(best.impulse, best.impulse + 3 * points_);
      velocity.assign(best.velocity, best.velocity + 3 * points_);
      residual = best.residual;
    }
    return {to_numpy(std::move(impulse), {points_, 3}), to_numpy(std::move(velocity), {points_, 3}), residual};
  }

 private:
  static size_t check(const Matrix& delassus, const Vector& free_velocity, const Vector& friction) {
    const size_t points = friction.shape(0), n = 3 * points;
    if (delassus.shape(0) != n || delassus.shape(1) != n || free_velocity.shape(0) != n)
      throw std::invalid_argument("delassus must be (3c, 3c), free_velocity (3c,) and friction (c,)");
    return points;
  }
  const double* checked(const Matrix& start) const {
    if (start.shape(0) != points_ || start.shape(1) != 3)
      throw std::invalid_argument("start must be (" + std::to_string(points_) + ", 3), got (" +
                                  std::to_string(start.shape(0)) + ", " + std::to_string(start.shape(1)) + ")");
    return start.data();
  }
  size_t points_;
  pneumorph::DenseFriction problem_;
};

void bind_friction(nb::module_& module) {
  nb::class_<PythonFriction>(module, "Friction",
                             "Unilateral contact with Coulomb friction over a dense Delassus operator.\n\n"
                             "Rows of a contact are normal, tangent, tangent.")
      .def(nb::init<Matrix, Vector, Vector>(), nb::arg("delassus"), nb::arg("free_velocity"), nb::arg("friction"))
      .def("sweep", &PythonFriction::sweep, nb::arg("start"), nb::arg("tolerance"), nb::arg("most"),
           "Impulses (c, 3) [mN s] after projected Gauss-Seidel sweeps, at most so many.")
      .def("newton", &PythonFriction::newton, nb::arg("start"), nb::arg("tolerance"),
           "Impulses (c, 3), velocities (c, 3) [mm/s] and the largest violated velocity of the best that Newton's\n"
           "method finds; with an infinite tolerance of the start, put into the cones.");
}
