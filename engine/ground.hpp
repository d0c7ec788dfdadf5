// The surface of a ground below a point, and how high it may be over an area; equation (32) of docs/physics.md.
#pragma once
#include "small_matrix.hpp"
#include "model.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Cell and place within it of a coordinate in spacings from the first of `count` nodes; beyond them the nearest.
inline int cell_of(double u, int count, double& place, bool& inside) {
  const double last = count - 1;
  inside = u >= 0 && u <= last;  // false for NaN
  u = inside ? u : (u > last ? last : 0.0);
  const int cell = int(u) < count - 2 ? int(u) : count - 2;
  place = u - cell;
  return cell;
}

// Hermite's cubics of values and slopes at both ends, and their derivatives.
inline void hermite_cubics(double t, double value[2], double slope[2], double value_rate[2], double slope_rate[2]) {
  const double s = 1 - t;
  value[0] = (1 + 2 * t) * s * s, value[1] = (3 - 2 * t) * t * t;
  slope[0] = t * s * s, slope[1] = -t * t * s;
  value_rate[0] = -6 * t * s, value_rate[1] = 6 * t * s;
  slope_rate[0] = s * (1 - 3 * t), slope_rate[1] = t * (3 * t - 2);
}

// Height over the base [mm] and unit normal below a place.
inline double height_below(const Ground& ground, double x, double y, double normal[3]) {
  double t[2], of[2][4][2];
  bool inside[2];
  const double per = 1 / ground.spacing;
  const int i = cell_of((x - ground.corner[0]) * per, ground.count[0], t[0], inside[0]);
  const int j = cell_of((y - ground.corner[1]) * per, ground.count[1], t[1], inside[1]);
  for (int axis = 0; axis < 2; ++axis)
    hermite_cubics(t[axis], of[axis][0], of[axis][1], of[axis][2], of[axis][3]);
  double height = 0, by_x = 0, by_y = 0;
  for (int p = 0; p < 2; ++p)
    for (int q = 0; q < 2; ++q) {
      const double* at = ground.nodes + 4 * (long(i + p) * ground.count[1] + j + q);
      const double along_x = of[0][0][p] * at[0] + of[0][1][p] * at[1], rate_x = of[0][2][p] * at[0] + of[0][3][p] * at[1];
      const double cross_x = of[0][0][p] * at[2] + of[0][1][p] * at[3], bent_x = of[0][2][p] * at[2] + of[0][3][p] * at[3];
      height += of[1][0][q] * along_x + of[1][1][q] * cross_x;
      by_x += of[1][0][q] * rate_x + of[1][1][q] * bent_x;
      by_y += of[1][2][q] * along_x + of[1][3][q] * cross_x;
    }
  normal[0] = inside[0] ? -by_x * per : 0, normal[1] = inside[1] ? -by_y * per : 0;
  normal[2] = 1 / std::sqrt(1 + normal[0] * normal[0] + normal[1] * normal[1]);
  normal[0] *= normal[2], normal[1] *= normal[2];
  return height;
}

// No height between two corners of an area is above this [mm].
inline double ceiling_over(const Ground& ground, const double low[2], const double high[2]) {
  int first[2], last[2];
  for (int axis = 0; axis < 2; ++axis) {
    double place;
    bool inside;
    first[axis] = cell_of((low[axis] - ground.corner[axis]) / ground.spacing, ground.count[axis], place, inside) / ground.tile_cells;
    last[axis] = cell_of((high[axis] - ground.corner[axis]) / ground.spacing, ground.count[axis], place, inside) / ground.tile_cells;
  }
  double top = ground.ceilings[long(first[0]) * ground.tiles[1] + first[1]];
  for (int i = first[0]; i <= last[0]; ++i)
    for (int j = first[1]; j <= last[1]; ++j) top = std::fmax(top, ground.ceilings[long(i) * ground.tiles[1] + j]);
  return top;
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
