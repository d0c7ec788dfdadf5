// `FrontPattern`, `FrontalCholesky` and `SingleFrontalCholesky` of the Python module; pneumorph/fem/frontal_cholesky.py wraps them.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>

#include <optional>

#include "frontal_cholesky.hpp"

namespace nb = nanobind;
using pneumorph::FrontPattern;
using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Integers = nb::ndarray<const int, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class Real>
using Columns = nb::ndarray<Real, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
template <class Real>
using Column = nb::ndarray<Real, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

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

template <class Real>
class PythonFactor {
 public:
  PythonFactor(const FrontPattern& pattern, Vector data)
      : pattern_(pattern), factor_(pattern, pneumorph::Blas<Real>::of_scipy()) {
    if (data.size() != pattern.data_count)
      throw std::invalid_argument("data has " + std::to_string(data.size()) + " numbers, expected " +
                                  std::to_string(pattern.data_count));
    auto stack = pneumorph::taken(pattern.spare_stacks<Real>(), pattern.stack_size);
    {
      nb::gil_scoped_release release;
      failed_block_ = factor_.factorise(data.data(), stack.get());
    }
    pattern.spare_stacks<Real>().push_back(std::move(stack));
  }
  int failed_block() const { return failed_block_; }

  void half_solve(Columns<Real> y, Integers begin, Integers end, std::optional<Columns<Real>> gram) const {
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

  void half_solve_transposed(Columns<Real> x) const {
    const size_t columns = checked_columns(x);
    nb::gil_scoped_release release;
    factor_.half_solve_transposed(x.data(), int(columns));
  }

  void half_solve_one(Column<Real> y) const {
    checked_rows(y.shape(0));
    nb::gil_scoped_release release;
    factor_.half_solve_one(y.data());
  }

  void half_solve_transposed_one(Column<Real> x) const {
    checked_rows(x.shape(0));
    nb::gil_scoped_release release;
    factor_.half_solve_transposed_one(x.data());
  }

 private:
  size_t checked_columns(const Columns<Real>& y) const {
    checked_rows(y.shape(0));
    return y.shape(1);
  }
  void checked_rows(size_t rows) const {
    if (rows != size_t(pattern_.size()))
      throw std::invalid_argument(std::to_string(rows) + " rows, expected " + std::to_string(pattern_.size()));
    if (failed_block_ >= 0) throw std::invalid_argument("the matrix was not positive definite");
  }
  const FrontPattern& pattern_;
  pneumorph::FrontalCholesky<Real> factor_;
  int failed_block_ = -1;
};

template <class Real>
static void bind_factor(nb::module_& module, const char* name) {
  using Factor = PythonFactor<Real>;
  nb::class_<Factor>(module, name)
      .def(nb::init<const FrontPattern&, Vector>(), nb::keep_alive<1, 2>(), nb::arg("pattern"), nb::arg("data"))
      .def_prop_ro("failed_block", &Factor::failed_block)
      .def("half_solve", &Factor::half_solve, nb::arg("y").noconvert(), nb::arg("begin"), nb::arg("end"),
           nb::arg("gram").noconvert().none())
      .def("half_solve_transposed", &Factor::half_solve_transposed, nb::arg("x").noconvert())
      .def("half_solve_one", &Factor::half_solve_one, nb::arg("y").noconvert())
      .def("half_solve_transposed_one", &Factor::half_solve_transposed_one, nb::arg("x").noconvert());
}

void bind_frontal_cholesky(nb::module_& module) {
  nb::class_<FrontPattern>(module, "FrontPattern")
      .def("__init__", &make_pattern, nb::arg("starts"), nb::arg("row_starts"), nb::arg("rows"),
           nb::arg("landing"), nb::arg("parents"), nb::arg("entry_starts"), nb::arg("entry_source"), nb::arg("entry_target"),
           nb::arg("data_count"));
  bind_factor<double>(module, "FrontalCholesky");
  bind_factor<float>(module, "SingleFrontalCholesky");
}
