// Cholesky factors by a front that sweeps through a body (Irons 1970; Duff and Reid 1983): of the left side of equations
// (8) and (9) of docs/physics.md at full order.
//
// Blocks of unknowns are eliminated in the given order. The front of a block is the block itself and
// the later unknowns that eliminated ones have touched. Its first columns, the panel, become columns of
// L; what is left of it, the update, is added to the next front. All work is level-3 BLAS on the front.
#pragma once
#include <algorithm>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
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
  std::vector<int> landing;        // place of each of them in the next front
  std::vector<int> entry_starts;   // (block + 1,) into source and target
  std::vector<int> entry_source;   // which datum of the sparse matrix
  std::vector<int> entry_target;   // where in the panel, column-major
  size_t data_count = 0;           // of the sparse matrix
  std::vector<long> panel_starts;  // (block + 1,) into the factor; found by complete()
  int largest_update = 0;          // likewise
  // Memory of factors that are gone, for those to come: fresh pages cost half a factorisation.
  mutable std::vector<std::unique_ptr<double[]>> spare;

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
    panel_starts.assign(1, 0);
    for (int b = 0; b < blocks; ++b) {
      const int m = update_size(b), w = width(b);
      require(w > 0, "blocks must not be empty");
      require(b + 1 < blocks || m == 0, "the last front must end with its block");
      for (int i = row_starts[b]; i < row_starts[b + 1]; ++i) {
        require(rows[i] >= starts[b + 1] && rows[i] < size(), "rows must lie beyond their block");
        require(landing[i] >= 0 && landing[i] < width(b + 1) + update_size(b + 1) &&
                    (i == row_starts[b] || landing[i] > landing[i - 1]),
                "landing must ascend within the next front");
      }
      for (int i = entry_starts[b]; i < entry_starts[b + 1]; ++i)
        require(entry_source[i] >= 0 && size_t(entry_source[i]) < data_count && entry_target[i] >= 0 &&
                    entry_target[i] < (w + m) * w,
                "an entry lies outside its panel");
      panel_starts.push_back(panel_starts.back() + long(w + m) * w);
      largest_update = std::max(largest_update, m);
    }
  }
};

class FrontalCholesky {
 public:
  FrontalCholesky(const FrontPattern& pattern, const Blas& blas) : pattern_(pattern), blas_(blas) {
    if (pattern.spare.empty()) {
      panels_.reset(new double[pattern.panel_starts.back()]);
    } else {
      panels_ = std::move(pattern.spare.back());
      pattern.spare.pop_back();
    }
  }
  FrontalCholesky(const FrontalCholesky&) = delete;
  ~FrontalCholesky() { pattern_.spare.push_back(std::move(panels_)); }

  // A = L L^T; the number of the block where A is not positive definite, or -1.
  int factorise(const double* data) {
    const auto& p = pattern_;
    std::vector<double> update(long(p.largest_update) * p.largest_update), next(update.size());
    for (int b = 0; b < p.block_count(); ++b) {
      const int w = p.width(b), m = p.update_size(b), height = w + m;
      double* panel = panels_.get() + p.panel_starts[b];
      std::memset(panel, 0, sizeof(double) * height * w);
      for (int i = p.entry_starts[b]; i < p.entry_starts[b + 1]; ++i)
        panel[p.entry_target[i]] += data[p.entry_source[i]];
      for (int j = 0; j < m; ++j) std::memset(&next[long(j) * m + j], 0, sizeof(double) * (m - j));
      if (b > 0) {
        const int before = p.update_size(b - 1);
        const int* place = p.landing.data() + p.row_starts[b - 1];
        for (int j = 0; j < before; ++j) {
          const double* from = &update[long(j) * before];
          const bool in_panel = place[j] < w;
          double* to = in_panel ? panel + long(place[j]) * height : &next[long(place[j] - w) * m];
          const int first = in_panel ? 0 : w;
          for (int i = j; i < before; ++i) to[place[i] - first] += from[i];
        }
      }
      update.swap(next);
      if (blas_.factorise(w, panel, height)) return b;
      if (m == 0) continue;
      blas_.solve_right(true, m, w, panel, height, panel + w, height);
      blas_.add_square(m, w, -1.0, panel + w, height, update.data(), m);
    }
    return -1;
  }

  // Y <- L^-1 Y, row-major with `columns` columns, of which the first active[b] are not zero down to
  // block b; adds Y^T Y to `gram`, the lower triangle of its columns.
  void half_solve(double* y, int columns, const int* active, double* gram) const {
    const auto& p = pattern_;
    std::vector<double> change(long(p.largest_update) * columns);
    for (int b = 0; b < p.block_count(); ++b) {
      const int w = p.width(b), m = p.update_size(b), a = active[b];
      if (a == 0) continue;
      const double* panel = panels_.get() + p.panel_starts[b];
      double* here = y + long(p.starts[b]) * columns;
      // A row-major (w, a) is a column-major (a, w).
      blas_.solve_right(true, a, w, panel, w + m, here, columns);
      blas_.add_square(a, w, 1.0, here, columns, gram, columns);
      if (m == 0) continue;
      blas_.multiply(true, a, m, w, 1.0, here, columns, panel + w, w + m, 0.0, change.data(), a);
      const int* row = p.rows.data() + p.row_starts[b];
      for (int i = 0; i < m; ++i) {
        double* to = y + long(row[i]) * columns;
        const double* from = &change[long(i) * a];
        for (int c = 0; c < a; ++c) to[c] -= from[c];
      }
    }
  }

  // X <- L^-T X, row-major.
  void half_solve_transposed(double* x, int columns) const {
    const auto& p = pattern_;
    std::vector<double> beyond(long(p.largest_update) * columns);
    for (int b = p.block_count() - 1; b >= 0; --b) {
      const int w = p.width(b), m = p.update_size(b);
      const double* panel = panels_.get() + p.panel_starts[b];
      double* here = x + long(p.starts[b]) * columns;
      const int* row = p.rows.data() + p.row_starts[b];
      for (int i = 0; i < m; ++i)
        std::copy_n(x + long(row[i]) * columns, columns, &beyond[long(i) * columns]);
      if (m > 0)
        blas_.multiply(false, columns, w, m, -1.0, beyond.data(), columns, panel + w, w + m, 1.0, here, columns);
      blas_.solve_right(false, columns, w, panel, w + m, here, columns);
    }
  }

  int size() const { return pattern_.size(); }

 private:
  const FrontPattern& pattern_;
  const Blas& blas_;
  std::unique_ptr<double[]> panels_;
};

}  // namespace pneumorph
