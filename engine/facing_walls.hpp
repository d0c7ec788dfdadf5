// Walls that face each other across a gap, such as those of a PneuNet's teeth, and may not pass through each other: equation (45)
// of docs/physics.md. Pairs of points, each with its gap's direction; a pair that overlaps is pushed apart in proportion.
#pragma once
#include "outer_products.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// v = v_0 + V alpha of three rows.
template <int M>
inline void affine_vector(const double* rest, const double* modes, const double* alpha, double vector[3]) {
  for (int i = 0; i < 3; ++i) {
    DoubleLanes dot = {};
    for (int v = 0; v < M; v += 8) dot += load(modes + i * M + v) * load(alpha + v);
    vector[i] = rest[i] + sum_lanes(dot);
  }
}

// Adds k/2 depth^2 of every pair: the `work` of its stress on the modes and the stiffness k dg (x) dg.
template <int M, class Real>
void add_facing_walls(const Part<Real>& part, const double* alpha, Real work[M], Real stiffness[M][M]) {
  constexpr int kRows = 32;
  alignas(64) Real rows[kRows][kRowStride<M>];
  int count = 0;
  for (int g = 0; g < part.wall_gap_count; ++g) {
    double axis[3], normal[3];
    affine_vector<M>(part.wall_axis + 3 * g, part.wall_axis_modes + 3L * g * M, alpha, axis);
    const double length = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    for (int i = 0; i < 3; ++i) normal[i] = axis[i] / length;
    for (int pair = part.wall_pair_first[g]; pair < part.wall_pair_first[g + 1]; ++pair) {
      const double* modes = part.wall_pair_modes + 3L * pair * M;
      double apart[3], across[3];
      affine_vector<M>(part.wall_pair + 3 * pair, modes, alpha, apart);
      const double gap = normal[0] * apart[0] + normal[1] * apart[1] + normal[2] * apart[2];
      if (!(gap < 0)) continue;
      // d gap = n . d apart + (apart - gap n) / |axis| . d axis: the direction turns with the walls.
      for (int i = 0; i < 3; ++i) across[i] = (apart[i] - gap * normal[i]) / length;
      const double root = std::sqrt(part.wall_pair_stiffness[pair]);
      const Real stress = Real(root * gap);
      for (int a = 0; a < M; ++a) {
        double change = 0;
        for (int i = 0; i < 3; ++i)
          change += normal[i] * modes[i * M + a] + across[i] * part.wall_axis_modes[(3L * g + i) * M + a];
        rows[count][a] = Real(root * change);
        work[a] += stress * rows[count][a];
      }
      if (++count == kRows) add_outer_products<true, M>(rows, count, stiffness), count = 0;
    }
  }
  if (count > 0) add_outer_products<true, M>(rows, count, stiffness);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
