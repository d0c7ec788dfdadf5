// Mass, forces and stiffness of one mounted part, in the part's own frame, and their elimination: equations (8), (17),
// (19), (20) and (23) of docs/physics.md.
//
// Unknowns of a part: velocity V of its origin and turning rate W of the hub, both along the axes of
// the part's frame, and the modal rates. A node moves with v = V + W x y + Phi rate, y = Y + Phi alpha.
// Linearly implicit Euler with Rayleigh damping, projected on these (Galerkin):
//   [(1 + a h) M + h (h + b) K] u_new = M u + h f.
#pragma once
#include "elements.hpp"
#include "small_matrix.hpp"
#include "velocity_products.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

inline double stiffness_scale(const Settings& settings) {
  return settings.time_step * (settings.time_step + settings.stiffness_damping);
}

inline double element_scale(const Settings& settings) { return settings.elasticity * stiffness_scale(settings); }

template <int M>
struct LegSystem {
  static constexpr int kVectors = M / 8;
  alignas(64) double inverse_upper[M][M];  // Y with D = U^T U, Y = U^-1; D the modal block
  alignas(64) double coupling[6][M];       // C: hub (V, W) against modes
  alignas(64) double reduced_coupling[6][M];  // E^T: rows (L^-1 C^T)^T
  alignas(64) double right_modes[M];
  alignas(64) double reduced_right[M];     // L^-1 b
  double hub[36], right_hub[6];            // the hub's block, part axes; after elimination: Schur parts
  double first_moment[3];
};

// row * Y for a row vector over modes.
template <int M>
inline void times_inverse(const double* row, const double inverse_upper[M][M], double* out) {
  constexpr int kVectors = M / 8;
  DoubleLanes sum[kVectors] = {};  // in registers, as all loops over it are unrolled
#pragma GCC unroll 8
  for (int block = 0; block < kVectors; ++block)
    for (int b = 8 * block; b < 8 * block + 8; ++b)
#pragma GCC unroll 8
      for (int v = block; v < kVectors; ++v) sum[v] += row[b] * load(&inverse_upper[b][8 * v]);
#pragma GCC unroll 8
  for (int v = 0; v < kVectors; ++v) store(out + 8 * v, sum[v]);
}

// Row `a` of Y times a column over modes.
template <int M>
inline double inverse_times(const double inverse_upper[M][M], int a, const double* column) {
  DoubleLanes dot = {};
  for (int v = a / 8; v < M / 8; ++v) dot += load(&inverse_upper[a][8 * v]) * load(column + 8 * v);
  return sum_lanes(dot);
}

// Upper factor of the 8 x 8 block at `d`, in rows of M: d = u^T u, and the inverse of u in its place; false if not
// positive definite.
template <int M>
inline bool invert_block(double* d) {
  static const double kUnit[15] = {0, 0, 0, 0, 0, 0, 0, 1};  // from 7 - i on: the i-th unit row
  DoubleLanes row[8];
#pragma GCC unroll 8
  for (int i = 0; i < 8; ++i) row[i] = load(d + i * M);
  double inverse[8];
#pragma GCC unroll 8
  for (int j = 0; j < 8; ++j) {
    const double pivot = row[j][j];
    if (!(pivot > 0)) return false;
    inverse[j] = 1.0 / std::sqrt(pivot);
    row[j] *= inverse[j];
#pragma GCC unroll 8
    for (int i = j + 1; i < 8; ++i) row[i] -= row[j][i] * row[j];
  }
  // Rows of the inverse from the last up: y_i = (e_i - sum_j>i u_ij y_j) / u_ii.
  DoubleLanes y[8];
#pragma GCC unroll 8
  for (int i = 7; i >= 0; --i) {
    DoubleLanes sum = load(kUnit + 7 - i);
#pragma GCC unroll 8
    for (int j = i + 1; j < 8; ++j) sum -= row[i][j] * y[j];
    y[i] = sum * inverse[i];
  }
#pragma GCC unroll 8
  for (int i = 0; i < 8; ++i) store(d + i * M, y[i]);
  return true;
}

// out (+/-)= a^T b or a b of 8 x 8 blocks in rows of M.
template <int M, bool Transposed>
inline void multiply_blocks(const double* a, const double* b, DoubleLanes out[8], double sign) {
#pragma GCC unroll 8
  for (int k = 0; k < 8; ++k) {
    const DoubleLanes right = sign * load(b + k * M);
#pragma GCC unroll 8
    for (int i = 0; i < 8; ++i) out[i] += a[Transposed ? k * M + i : i * M + k] * right;
  }
}

// U^-1 of D = U^T U, in place of D (upper part read), by blocks of eight; false if D is not positive definite.
template <int M>
inline bool invert_upper_factor(double d[M][M]) {
  constexpr int kBlocks = M / 8;
  const auto at = [&](int i, int j) { return &d[8 * i][8 * j]; };
  const auto put = [&](int i, int j, const DoubleLanes value[8]) {
    for (int r = 0; r < 8; ++r) store(at(i, j) + r * M, value[r]);
  };
  // Diagonal blocks become Y_ii = U_ii^-1, blocks right of them U_ij.
  for (int i = 0; i < kBlocks; ++i) {
    if (!invert_block<M>(at(i, i))) return false;
    for (int j = i + 1; j < kBlocks; ++j) {
      DoubleLanes u[8] = {};
      multiply_blocks<M, true>(at(i, i), at(i, j), u, 1.0);
      put(i, j, u);
    }
    for (int j = i + 1; j < kBlocks; ++j)
      for (int l = j; l < kBlocks; ++l) {
        DoubleLanes rest[8];
        for (int r = 0; r < 8; ++r) rest[r] = load(at(j, l) + r * M);
        multiply_blocks<M, true>(at(i, j), at(i, l), rest, -1.0);
        put(j, l, rest);
      }
  }
  // Y_ij = -Y_ii sum_(i<l<=j) U_il Y_lj, from the last row up and from the last column back.
  for (int i = kBlocks - 2; i >= 0; --i)
    for (int j = kBlocks - 1; j > i; --j) {
      DoubleLanes sum[8] = {}, y[8] = {};
      for (int l = i + 1; l <= j; ++l) multiply_blocks<M, false>(at(i, l), at(l, j), sum, 1.0);
      put(i, j, sum);  // U_ij is read by no other column
      multiply_blocks<M, false>(at(i, i), at(i, j), y, -1.0);
      put(i, j, y);
    }
  return true;
}

// sum += amounts (count) times rows (count, M).
template <int M, class Real>
inline void add_products(const double* amounts, const Real* rows, int count, Real* sum) {
  using L = Lanes<Real, (M * sizeof(Real)) % kRegisterBytes == 0 ? kRegisterBytes : 32>;
  constexpr int kWidths = M / L::count;
  typename L::type total[2][kWidths] = {};  // two chains, to hide the latency of sums
  for (int i = 0; i < count; i += 2)
    for (int chain = 0; chain < 2; ++chain) {
      const Real amount = Real(amounts[i + chain]);
      for (int v = 0; v < kWidths; ++v) total[chain][v] += amount * L::load(rows + (i + chain) * M + v * L::count);
    }
  for (int v = 0; v < kWidths; ++v) L::store(sum + v * L::count, total[0][v] + total[1][v]);
}

// Mass of the part about its origin and its products with the old rates; gravity; pressure.
// `velocity`: old V and W in the part's frame; `end`: where the pressure acts. Fills coupling, hub, right sides with
// (1 + a h) M and M u + h f.
template <int M, class Real>
void add_inertia_and_loads(const Part<Real>& part, const double* alpha, const double* end, const double* rates,
                           const double velocity[6], const double gravity[3], const double* pressure,
                           const Settings& settings, LegSystem<M>& leg) {
  constexpr int kVectors = M / 8;
  const double h = settings.time_step, mass_scale = 1.0 + settings.mass_damping * h;
  constexpr int kPairs = pair_count(M);
  alignas(64) double pairs[kPairs];  // products of the coordinates where the pressure acts
  for (int v = kPairs - 16; v < kPairs; v += 8) store(pairs + v, DoubleLanes{});
  for (int b = 0; b < M; ++b)
    for (int c = b; c < M; ++c) pairs[pair_index(b, c, M)] = end[b] * end[c];
  double second[9];                       // sum m y y^T
  alignas(64) double second_change[6][M];  // its change with each mode: xx, xy, xz, yy, yz, zz
  for (int i = 0, entry = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j, ++entry) {
      const double* linear = part.second_moment_modes + entry * M;
      const double* matrix = part.second_moment_matrices + entry * M * M;
      DoubleLanes change[kVectors], dot = {};
      for (int v = 0; v < kVectors; ++v) change[v] = load(linear + 8 * v);
      for (int b = 0; b < M; ++b)
        for (int v = 0; v < kVectors; ++v) change[v] += alpha[b] * load(matrix + b * M + 8 * v);
      for (int v = 0; v < kVectors; ++v) {
        store(&second_change[entry][8 * v], change[v]);
        dot += 0.5 * (change[v] + load(linear + 8 * v)) * load(alpha + 8 * v);
      }
      second[3 * i + j] = second[3 * j + i] = part.second_moment[entry] + sum_lanes(dot);
    }
  double first[3], mode_momentum[6];
  alignas(64) double mass_coupling[6][M];
  for (int i = 0; i < 3; ++i) {
    DoubleLanes dot = {}, lever[kVectors];
    for (int v = 0; v < kVectors; ++v) {
      const DoubleLanes row = load(part.first_moment_modes + i * M + 8 * v);
      store(&mass_coupling[i][8 * v], row);
      dot += row * load(alpha + 8 * v);
      lever[v] = load(part.lever + i * M + 8 * v);
    }
    first[i] = leg.first_moment[i] = part.first_moment[i] + sum_lanes(dot);
    const double* modes = part.lever_modes + i * M * M;  // sum m (y x Phi)
    for (int b = 0; b < M; ++b)
      for (int v = 0; v < kVectors; ++v) lever[v] += alpha[b] * load(modes + b * M + 8 * v);
    for (int v = 0; v < kVectors; ++v) store(&mass_coupling[3 + i][8 * v], lever[v]);
  }
  for (int i = 0; i < 6; ++i) {
    DoubleLanes dot = {};
    for (int v = 0; v < kVectors; ++v) dot += load(&mass_coupling[i][8 * v]) * load(rates + 8 * v);
    mode_momentum[i] = sum_lanes(dot);
  }
  double mass[36];
  rigid_mass(part.mass, first, second, mass);

  for (int i = 0; i < 6; ++i) {
    double sum = mode_momentum[i];
    for (int j = 0; j < 6; ++j) {
      sum += mass[6 * i + j] * velocity[j];
      leg.hub[6 * i + j] = mass_scale * mass[6 * i + j];
    }
    leg.right_hub[i] = sum;
  }
  double torque[3];
  cross(first, gravity, torque);
  for (int i = 0; i < 3; ++i) {
    leg.right_hub[i] += h * part.mass * gravity[i];
    leg.right_hub[3 + i] += h * torque[i];
  }
  for (int v = 0; v < kVectors; ++v) {
    DoubleLanes sum = load(rates + 8 * v);
    for (int i = 0; i < 6; ++i) {
      const DoubleLanes row = load(&mass_coupling[i][8 * v]);
      sum += velocity[i] * row;
      store(&leg.coupling[i][8 * v], mass_scale * row);
    }
    for (int i = 0; i < 3; ++i) sum += (h * gravity[i]) * load(&mass_coupling[i][8 * v]);
    store(&leg.right_modes[8 * v], sum);
  }
  add_velocity_products<M>(part.lever_modes, rates, velocity + 3, first, second, second_change, mode_momentum, h,
                           leg.right_hub, leg.right_modes);
  // Pressure does work p dV; the cavity's volume is a cubic of the modal coordinates. A closed
  // cavity exerts no net force or moment, so the hub's rows have no such term.
  for (int cavity = 0; cavity < part.cavity_count; ++cavity) {
    const double amount = h * pressure[cavity];
    if (amount == 0.0) continue;
    DoubleLanes gradient[kVectors];
    for (int v = 0; v < kVectors; ++v) gradient[v] = load(part.volume_1 + cavity * M + 8 * v);
    const double* quadratic = part.volume_2 + long(cavity) * M * M;
    for (int b = 0; b < M; ++b)
      for (int v = 0; v < kVectors; ++v) gradient[v] += end[b] * load(quadratic + b * M + 8 * v);
    alignas(64) Real cubic[M] = {};
    const Real* coefficients = part.volume_3 + long(cavity) * kPairs * M;
    add_products<M, Real>(pairs, coefficients, kPairs, cubic);
    for (int v = 0; v < kVectors; ++v) {
      alignas(64) double last[8];
      for (int i = 0; i < 8; ++i) last[i] = double(cubic[8 * v + i]);
      store(&leg.right_modes[8 * v], load(&leg.right_modes[8 * v]) + amount * (gradient[v] + load(last)));
    }
  }
}

// Factor of the modal block with the elements' stiffness; false if it is not positive definite.
template <int M, class Real>
bool factor_modes(const Part<Real>& part, const ElementSystem<M, Real>& elements, const Settings& settings,
                  LegSystem<M>& leg) {
  const double scale = element_scale(settings), mount_scale = settings.mount_elasticity * stiffness_scale(settings);
  auto& d = leg.inverse_upper;
  for (int a = 0; a < M; ++a) {
    for (int b = a / 8 * 8; b < M; ++b) d[a][b] = scale * double(elements.stiffness[a][b]);
    d[a][a] += 1.0 + settings.mass_damping * settings.time_step;  // modes are orthonormal in mass
  }
  if (part.has_linear_stiffness)
    for (int a = 0; a < M; ++a)
      for (int v = a / 8 * 8; v < M; v += 8)
        store(&d[a][v], load(&d[a][v]) + mount_scale * load(part.linear_stiffness + a * M + v));
  return invert_upper_factor<M>(d);
}

// Adds the elements' forces and eliminates the modes, whose block is factored.
template <int M, class Real>
void eliminate_modes(const Part<Real>& part, const double* alpha, const ElementSystem<M, Real>& elements,
                     const Settings& settings, LegSystem<M>& leg) {
  constexpr int kVectors = M / 8;
  const double h = settings.elasticity * settings.time_step, scale = element_scale(settings);
  const double mount_h = settings.mount_elasticity * settings.time_step;
  const auto predicted = [](Real lack, Real last) { return 2.0 * double(lack) - double(last); };
  for (int a = 0; a < M; ++a)
    leg.right_modes[a] += h * double(elements.force[a]) - scale * predicted(elements.lack[a], elements.last_lack[a]);
  if (part.has_linear_stiffness)
    for (int a = 0; a < M; ++a) {
      DoubleLanes dot = {};
      for (int v = 0; v < M; v += 8) dot += load(part.linear_stiffness + a * M + v) * load(alpha + v);
      leg.right_modes[a] -= mount_h * sum_lanes(dot);
    }
  if (settings.published_damping)
    for (int i = 0; i < 3; ++i) {
      for (int a = 0; a < M; ++a) leg.coupling[3 + i][a] += scale * double(elements.turn_stiffness[i][a]);
      for (int j = 0; j < 3; ++j)
        leg.hub[6 * (3 + i) + 3 + j] += scale * double(elements.turn_turn_stiffness[3 * i + j]);
      leg.right_hub[3 + i] += h * double(elements.moment[i]) -
                              scale * predicted(elements.turn_lack[i], elements.last_turn_lack[i]);
    }
  for (int i = 0; i < 6; ++i) times_inverse<M>(leg.coupling[i], leg.inverse_upper, leg.reduced_coupling[i]);
  times_inverse<M>(leg.right_modes, leg.inverse_upper, leg.reduced_right);
  for (int i = 0; i < 6; ++i) {
    DoubleLanes dot = {};
    for (int v = 0; v < kVectors; ++v)
      dot += load(&leg.reduced_coupling[i][8 * v]) * load(&leg.reduced_right[8 * v]);
    leg.right_hub[i] -= sum_lanes(dot);
    for (int j = i; j < 6; ++j) {
      DoubleLanes product = {};
      for (int v = 0; v < kVectors; ++v)
        product += load(&leg.reduced_coupling[i][8 * v]) * load(&leg.reduced_coupling[j][8 * v]);
      leg.hub[6 * i + j] -= sum_lanes(product);
      leg.hub[6 * j + i] = leg.hub[6 * i + j];
    }
  }
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
