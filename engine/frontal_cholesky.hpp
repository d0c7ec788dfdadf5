// Cholesky factors by a front that sweeps through a body (Irons 1970; Duff and Reid 1983): of the left side of equations
// (8) and (9) of docs/physics.md at full order.
//
// Blocks of unknowns are eliminated in the given order. The front of a block is the block itself and
// the later unknowns that eliminated ones have touched. Its first columns, the panel, become columns of
// L; what is left of it, the update, is added to the front of its parent: the next block in a sweep, any
// later one in a tree, whose blocks come after all those below them. All work is level-3 BLAS on the front.
#pragma once
#include <algorithm>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "blas.hpp"

namespace pneumorph {

// Found once for a sparsity. Unknowns are numbered in the order of elimination.
struct FrontPattern {
  FrontPattern() = default;
  FrontPattern(FrontPattern&&) = default;

  std::vector<int> starts;         // (block + 1,) first unknown of each block
  std::vector<int> row_starts;     // (block + 1,) into rows and landing
  std::vector<int> rows;           // unknowns of each front beyond its block, ascending
  std::vector<int> landing;        // place of each of them in the parent's front
  std::vector<int> parents;        // (block,) the last has none: itself
  std::vector<int> entry_starts;   // (block + 1,) into source and target
  std::vector<int> entry_source;   // which datum of the sparse matrix
  std::vector<int> entry_target;   // where in the panel, column-major
  size_t data_count = 0;           // of the sparse matrix
  std::vector<long> panel_starts;  // (block + 1,) into the factor; found by complete()
  int largest_update = 0;          // likewise
  long stack_size = 0;             // likewise: of updates that wait for their parents
  std::vector<int> child_counts;   // (block,) likewise
  // Rows that land side by side, likewise: (run,) their first among their block's, and (block + 1,) into it.
  std::vector<int> runs, run_starts;
  template <class Real>
  using Memories = std::vector<std::unique_ptr<Real[]>>;
  // Memory of factors that are gone, for those to come: fresh pages cost half a factorisation.
  mutable std::tuple<Memories<float>, Memories<double>> panels, stacks;
  template <class Real>
  Memories<Real>& spare_panels() const {
    return std::get<Memories<Real>>(panels);
  }
  template <class Real>
  Memories<Real>& spare_stacks() const {
    return std::get<Memories<Real>>(stacks);
  }

  int block_count() const { return int(starts.size()) - 1; }
  int size() const { return starts.back(); }
  int width(int block) const { return starts[block + 1] - starts[block]; }
  int update_size(int block) const { return row_starts[block + 1] - row_starts[block]; }

  // Checks what the factorisation relies on, so that no wrong index leaves an array.
  void complete() {
    const int blocks = block_count();
    auto require = [](bool holds, const char* what) {
      if (!holds) throw std::invalid_argument(std::string("front pattern: ") + what);
    };
    require(blocks >= 1 && starts[0] == 0, "starts must begin with 0 and have one block at least");
    for (const auto* counts : {&row_starts, &entry_starts})
      require(int(counts->size()) == blocks + 1 && counts->front() == 0 &&
                  std::is_sorted(counts->begin(), counts->end()),
              "row_starts and entry_starts must ascend from 0 and be as long as starts");
    require(rows.size() == landing.size() && int(rows.size()) == row_starts.back(), "rows or landing too short");
    require(entry_source.size() == entry_target.size() && int(entry_source.size()) == entry_starts.back(),
            "entry_source or entry_target too short");
    require(int(parents.size()) == blocks, "parents must be as many as blocks");
    panel_starts.assign(1, 0);
    child_counts.assign(blocks, 0);
    runs.clear();
    run_starts.assign(1, 0);
    std::vector<int> waiting;
    long top = 0;
    for (int b = 0; b < blocks; ++b) {
      const int m = update_size(b), w = width(b), parent = parents[b];
      require(b + 1 == blocks ? parent == b : parent > b && parent < blocks, "a parent must come later");
      stack_size = std::max(stack_size, top + long(m) * m);
      for (; !waiting.empty() && parents[waiting.back()] == b; waiting.pop_back(), ++child_counts[b]) {
        const long below = update_size(waiting.back());
        top -= below * below;
      }
      for (int child : waiting) require(parents[child] > b, "blocks must follow all those below them");
      waiting.push_back(b);
      top += long(m) * m;
      require(w > 0, "blocks must not be empty");
      require(b + 1 < blocks || m == 0, "the last front must end with its block");
      for (int i = row_starts[b]; i < row_starts[b + 1]; ++i) {
        require(rows[i] >= starts[b + 1] && rows[i] < size(), "rows must lie beyond their block");
        require(landing[i] >= 0 && landing[i] < width(parent) + update_size(parent) &&
                    (i == row_starts[b] || landing[i] > landing[i - 1]),
                "landing must ascend within the parent's front");
        if (i == row_starts[b] || landing[i] != landing[i - 1] + 1 || landing[i] == width(parent))
          runs.push_back(i - row_starts[b]);
      }
      run_starts.push_back(int(runs.size()));
      for (int i = entry_starts[b]; i < entry_starts[b + 1]; ++i)
        require(entry_source[i] >= 0 && size_t(entry_source[i]) < data_count && entry_target[i] >= 0 &&
                    entry_target[i] < (w + m) * w,
                "an entry lies outside its panel");
      panel_starts.push_back(panel_starts.back() + long(w + m) * w);
      largest_update = std::max(largest_update, m);
    }
  }
};

// Memory of that size, from those that are spare where there is one.
template <class Real>
std::unique_ptr<Real[]> taken(std::vector<std::unique_ptr<Real[]>>& spare, long size) {
  if (spare.empty()) return std::unique_ptr<Real[]>(new Real[size]);
  std::unique_ptr<Real[]> memory = std::move(spare.back());
  spare.pop_back();
  return memory;
}

// In double precision, or in single: half the memory and half the time, for what only leads to a solution.
template <class Real>
class FrontalCholesky {
 public:
  FrontalCholesky(const FrontPattern& pattern, const Blas<Real>& blas)
      : pattern_(pattern), blas_(blas), panels_(taken(pattern.spare_panels<Real>(), pattern.panel_starts.back())) {}
  FrontalCholesky(const FrontalCholesky&) = delete;
  ~FrontalCholesky() { pattern_.spare_panels<Real>().push_back(std::move(panels_)); }

  // A = L L^T; the number of the block where A is not positive definite, or -1.
  // `stack` has the pattern's stack_size numbers, whatever they are.
  int factorise(const double* data, Real* stack) {
    const auto& p = pattern_;
    std::vector<int> waiting;  // blocks whose updates lie on the stack
    Real* top = stack;
    for (int b = 0; b < p.block_count(); ++b) {
      const int w = p.width(b), m = p.update_size(b), height = w + m;
      Real *panel = panels_.get() + p.panel_starts[b], *update = top, *bottom = top;
      std::memset(panel, 0, sizeof(Real) * height * w);
      for (int i = p.entry_starts[b]; i < p.entry_starts[b + 1]; ++i)
        panel[p.entry_target[i]] += Real(data[p.entry_source[i]]);
      // Sums of single precision begin with the square, which then needs no zeros; those of double precision end with it,
      // as in earlier versions, to the last bit.
      constexpr bool square_first = sizeof(Real) == sizeof(float);
      const size_t first_child = waiting.size() - p.child_counts[b];
      if (!square_first)
        for (int j = 0; j < m; ++j) std::memset(update + long(j) * m + j, 0, sizeof(Real) * (m - j));
      for (size_t k = waiting.size(); k-- > first_child;) {
        bottom -= long(p.update_size(waiting[k])) * p.update_size(waiting[k]);
        add_child(waiting[k], b, bottom, panel, update, true, !square_first);
      }
      if (blas_.factorise(w, panel, height)) return b;
      if (m > 0) {
        blas_.solve_right(true, m, w, panel, height, panel + w, height);
        blas_.add_square(m, w, -1.0, panel + w, height, square_first ? 0.0 : 1.0, update, m);
      }
      if (square_first) {
        const Real* below = top;
        for (size_t k = waiting.size(); k-- > first_child;) {
          below -= long(p.update_size(waiting[k])) * p.update_size(waiting[k]);
          add_child(waiting[k], b, below, panel, update, false, m > 0);
        }
      }
      waiting.resize(first_child);
      waiting.push_back(b);
      if (bottom != update)
        for (int j = 0; j < m; ++j)
          std::memmove(bottom + long(j) * m + j, update + long(j) * m + j, sizeof(Real) * (m - j));
      top = bottom + long(m) * m;
    }
    return -1;
  }

  // Y <- L^-1 Y, row-major with `columns` columns, of which those from begin[b] to end[b] are not zero in
  // block b; adds Y^T Y to `gram`, the lower triangle of its columns, unless it is null.
  void half_solve(Real* y, int columns, const int* begin, const int* end, Real* gram) const {
    const auto& p = pattern_;
    std::vector<Real> change(long(p.largest_update) * columns);
    for (int b = 0; b < p.block_count(); ++b) {
      const int w = p.width(b), m = p.update_size(b), skipped = begin[b], a = end[b] - skipped;
      if (a == 0) continue;
      const Real* panel = panels_.get() + p.panel_starts[b];
      Real* here = y + long(p.starts[b]) * columns + skipped;
      // A row-major (w, a) is a column-major (a, w).
      blas_.solve_right(true, a, w, panel, w + m, here, columns);
      if (gram) blas_.add_square(a, w, 1.0, here, columns, 1.0, gram + long(skipped) * columns + skipped, columns);
      if (m == 0) continue;
      blas_.multiply(true, a, m, w, 1.0, here, columns, panel + w, w + m, 0.0, change.data(), a);
      const int* row = p.rows.data() + p.row_starts[b];
      for (int i = 0; i < m; ++i) {
        Real* to = y + long(row[i]) * columns + skipped;
        const Real* from = &change[long(i) * a];
        for (int c = 0; c < a; ++c) to[c] -= from[c];
      }
    }
  }

  // X <- L^-T X, row-major.
  void half_solve_transposed(Real* x, int columns) const {
    const auto& p = pattern_;
    std::vector<Real> beyond(long(p.largest_update) * columns);
    for (int b = p.block_count() - 1; b >= 0; --b) {
      const int w = p.width(b), m = p.update_size(b);
      const Real* panel = panels_.get() + p.panel_starts[b];
      Real* here = x + long(p.starts[b]) * columns;
      const int* row = p.rows.data() + p.row_starts[b];
      for (int i = 0; i < m; ++i)
        std::copy_n(x + long(row[i]) * columns, columns, &beyond[long(i) * columns]);
      if (m > 0)
        blas_.multiply(false, columns, w, m, -1.0, beyond.data(), columns, panel + w, w + m, 1.0, here, columns);
      blas_.solve_right(false, columns, w, panel, w + m, here, columns);
    }
  }

  // The same of one column.
  void half_solve_one(Real* y) const {
    const auto& p = pattern_;
    std::vector<Real> change(p.largest_update);
    for (int b = 0; b < p.block_count(); ++b) {
      const int w = p.width(b), m = p.update_size(b);
      const Real* panel = panels_.get() + p.panel_starts[b];
      Real* here = y + p.starts[b];
      blas_.solve_one(false, w, panel, w + m, here);
      if (m == 0) continue;
      blas_.multiply_one(false, m, w, 1.0, panel + w, w + m, here, 0.0, change.data());
      const int* row = p.rows.data() + p.row_starts[b];
      for (int i = 0; i < m; ++i) y[row[i]] -= change[i];
    }
  }
  void half_solve_transposed_one(Real* x) const {
    const auto& p = pattern_;
    std::vector<Real> beyond(p.largest_update);
    for (int b = p.block_count() - 1; b >= 0; --b) {
      const int w = p.width(b), m = p.update_size(b);
      const Real* panel = panels_.get() + p.panel_starts[b];
      Real* here = x + p.starts[b];
      const int* row = p.rows.data() + p.row_starts[b];
      for (int i = 0; i < m; ++i) beyond[i] = x[row[i]];
      if (m > 0) blas_.multiply_one(true, m, w, -1.0, panel + w, w + m, beyond.data(), 1.0, here);
      blas_.solve_one(true, w, panel, w + m, here);
    }
  }

  int size() const { return pattern_.size(); }

 private:
  // Adds a child's update to its parent's panel and to the parent's own update.
  void add_child(int child, int parent, const Real* from, Real* panel, Real* update, bool to_panel, bool to_update) const {
    const auto& p = pattern_;
    const int w = p.width(parent), m = p.update_size(parent), below = p.update_size(child);
    const int* place = p.landing.data() + p.row_starts[child];
    const int *run = p.runs.data() + p.run_starts[child], *last = p.runs.data() + p.run_starts[child + 1];
    for (int j = 0; j < below; ++j, from += below) {
      const bool in_panel = place[j] < w;
      if (!(in_panel ? to_panel : to_update)) continue;
      Real* to = in_panel ? panel + long(place[j]) * (w + m) : update + long(place[j] - w) * m - w;
      while (run + 1 < last && run[1] <= j) ++run;
      for (const int* r = run; r < last; ++r) {
        const int begin = std::max(*r, j), end = r + 1 < last ? r[1] : below;
        Real* target = to + place[begin] - begin;
        for (int i = begin; i < end; ++i) target[i] += from[i];
      }
    }
  }

  const FrontPattern& pattern_;
  const Blas<Real>& blas_;
  std::unique_ptr<Real[]> panels_;
};

}  // namespace pneumorph
