// `FrontPattern` and `FrontalCholesky` of the Python module; pneumorph/fem/frontal_cholesky.py wraps them.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>

#include <optional>

#include "frontal_cholesky.hpp"

namespace nb = nanobind;
using pneumorph::FrontPattern;
using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Integers = nb::ndarray<const int, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Columns = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

static std::vector<int> values(const Integers& array) { return {array.data(), array.data() + array.size()}; }

static void make_pattern(FrontPattern* self, Integers starts, Integers row_starts, Integers rows, Integers landing,
                         Integers parents, Integers entry_starts, Integers entry_source, Integers entry_target, size_t data_count) {
  FrontPattern pattern;
  pattern.starts = values(starts);
  pattern.row_starts = values(row_starts), pattern.rows = values(rows), pattern.landing = values(landing);
  pattern.parents = values(parents);
  pattern.entry_starts = values(entry_starts);
  pattern.entry_source = values(entry_source), pattern.entry_target = values(entry_target);
  pattern.data_count = data_count;
  pattern.complete();
  new (self) FrontPattern(std::move(pattern));
}

class PythonFactor {
 public:
  PythonFactor(const FrontPattern& pattern, Vector data)
      : pattern_(pattern), factor_(pattern, pneumorph::Blas::of_scipy()) {
    if (data.size() != pattern.data_count)
      throw std::invalid_argument("data has " + std::to_string(data.size()) + " numbers, expected " +
                                  std::to_string(pattern.data_count));
    nb::gil_scoped_release release;
    failed_block_ = factor_.factorise(data.data());
  }
  int failed_block() const { return failed_block_; }

  void half_solve(Columns y, Integers begin, Integers end, std::optional<Columns> gram) const {
    const size_t columns = checked_columns(y), blocks = size_t(pattern_.block_count());
    bool sound = begin.size() == blocks && end.size() == blocks;
    for (size_t b = 0; sound && b < blocks; ++b) {
      const int first = begin.data()[b], last = end.data()[b], parent = pattern_.parents[b];
      sound = 0 <= first && first <= last && size_t(last) <= columns &&
              (first == last || (begin.data()[parent] <= first && last <= end.data()[parent]));
    }
    if (!sound) throw std::invalid_argument("each block's columns, from begin to end, must be its parent's too");
    if (gram && (gram->shape(0) != columns || gram->shape(1) != columns))
      throw std::invalid_argument("gram must have a row and a column for each column of y");
    nb::gil_scoped_release release;
    factor_.half_solve(y.data(), int(columns), begin.data(), end.data(), gram ? gram->data() : nullptr);
  }

  void half_solve_transposed(Columns x) const {
    const size_t columns = checked_columns(x);
    nb::gil_scoped_release release;
    factor_.half_solve_transposed(x.data(), int(columns));
  }

 private:
  size_t checked_columns(const Columns& y) const {
    if (y.shape(0) != size_t(pattern_.size()))
      throw std::invalid_argument(std::to_string(y.shape(0)) + " rows, expected " +
                                  std::to_string(pattern_.size()));
    if (failed_block_ >= 0) throw std::invalid_argument("the matrix was not positive definite");
    return y.shape(1);
  }
  const FrontPattern& pattern_;
  pneumorph::FrontalCholesky factor_;
  int failed_block_ = -1;
};

void bind_frontal_cholesky(nb::module_& module) {
  nb::class_<FrontPattern>(module, "FrontPattern")
      .def("__init__", &make_pattern, nb::arg("starts"), nb::arg("row_starts"), nb::arg("rows"),
           nb::arg("landing"), nb::arg("parents"), nb::arg("entry_starts"), nb::arg("entry_source"), nb::arg("entry_target"),
           nb::arg("data_count"));
  nb::class_<PythonFactor>(module, "FrontalCholesky")
      .def(nb::init<const FrontPattern&, Vector>(), nb::keep_alive<1, 2>(), nb::arg("pattern"), nb::arg("data"))
      .def_prop_ro("failed_block", &PythonFactor::failed_block)
      .def("half_solve", &PythonFactor::half_solve, nb::arg("y").noconvert(), nb::arg("begin"),
           nb::arg("end"), nb::arg("gram").noconvert().none())
      .def("half_solve_transposed", &PythonFactor::half_solve_transposed, nb::arg("x").noconvert());
}
