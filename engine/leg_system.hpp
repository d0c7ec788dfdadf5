// Mass, forces and stiffness of one mounted part, in the part's own frame, and their elimination.
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

using DoubleLanes = Lanes<double>::type;

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
  DoubleLanes sum[kVectors] = {};
  for (int b = 0; b < M; ++b) {
    const DoubleLanes value = broadcast(row[b]);
    for (int v = 0; v < kVectors; ++v) sum[v] += value * load(&inverse_upper[b][8 * v]);
  }
  for (int v = 0; v < kVectors; ++v) store(out + 8 * v, sum[v]);
}

// U^-1 of D = U^T U, in place of D (upper part read); false if D is not positive definite.
template <int M>
inline bool invert_upper_factor(double d[M][M]) {
  constexpr int kVectors = M / 8;
  for (int j = 0; j < M; ++j) {
    if (!(d[j][j] > 0)) return false;
    const double scale = 1.0 / std::sqrt(d[j][j]);
    for (int v = 0; v < kVectors; ++v) store(&d[j][8 * v], load(&d[j][8 * v]) * scale);
    for (int i = j + 1; i < M; ++i) {
      const double factor = d[j][i];
      for (int v = i / 8; v < kVectors; ++v)
        store(&d[i][8 * v], load(&d[i][8 * v]) - factor * load(&d[j][8 * v]));
    }
  }
  alignas(64) double row[M];
  for (int i = M - 1; i >= 0; --i) {
    const double inverse = 1.0 / d[i][i];
    DoubleLanes sum[kVectors] = {};
    for (int j = i + 1; j < M; ++j) {
      const double factor = d[i][j];
      for (int v = 0; v < kVectors; ++v) sum[v] -= factor * load(&d[j][8 * v]);
    }
    for (int v = 0; v < kVectors; ++v) store(&row[8 * v], sum[v] * inverse);
    for (int j = 0; j < i; ++j) d[i][j] = 0;
    row[i] = inverse;
    for (int j = i; j < M; ++j) d[i][j] = row[j];
  }
  return true;
}

// Mass of the part about its origin and its products with the old rates; gravity; pressure.
// `velocity`: old V and W in the part's frame. Fills coupling, hub, right sides with (1 + a h) M and M u + h f.
template <int M, class Real>
void add_inertia_and_loads(const Part<Real>& part, const double* alpha, const double* rates,
                           const double velocity[6], const double gravity[3], const double* pressure,
                           const Settings& settings, LegSystem<M>& leg) {
  constexpr int kVectors = M / 8;
  const double h = settings.time_step, mass_scale = 1.0 + settings.mass_damping * h;
  // Lever L_ij^a = sum m y_i Phi_j^a and second moment S = sum m y y^T.
  alignas(64) double lever[9][M];
  double second[9];
  for (int ij = 0; ij < 9; ++ij) {
    const double* linear = part.second_moment_modes + ij * M;
    const double* pairs = part.second_moment_mode_pairs + long(ij) * M * M;
    DoubleLanes sum[kVectors], dot = {};
    for (int v = 0; v < kVectors; ++v) sum[v] = load(linear + 8 * v);
    for (int b = 0; b < M; ++b) {
      const DoubleLanes coordinate = broadcast(alpha[b]);
      for (int v = 0; v < kVectors; ++v) sum[v] += coordinate * load(pairs + b * M + 8 * v);
    }
    for (int v = 0; v < kVectors; ++v) {
      store(&lever[ij][8 * v], sum[v]);
      dot += sum[v] * load(alpha + 8 * v);
    }
    second[ij] = part.second_moment[ij] + sum_lanes(dot);
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      DoubleLanes dot = {};
      const double* linear = part.second_moment_modes + (3 * i + j) * M;
      for (int v = 0; v < kVectors; ++v) dot += load(linear + 8 * v) * load(alpha + 8 * v);
      second[3 * j + i] += sum_lanes(dot);
    }
  double first[3], mode_momentum[6];
  alignas(64) double mass_coupling[6][M];
  for (int i = 0; i < 3; ++i) {
    DoubleLanes dot = {};
    for (int v = 0; v < kVectors; ++v) {
      const DoubleLanes row = load(part.first_moment_modes + i * M + 8 * v);
      store(&mass_coupling[i][8 * v], row);
      dot += row * load(alpha + 8 * v);
    }
    first[i] = leg.first_moment[i] = part.first_moment[i] + sum_lanes(dot);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const int i1 = (axis + 1) % 3, i2 = (axis + 2) % 3;
    for (int v = 0; v < kVectors; ++v)
      store(&mass_coupling[3 + axis][8 * v], load(&lever[3 * i1 + i2][8 * v]) - load(&lever[3 * i2 + i1][8 * v]));
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
  add_velocity_products<M>(part.gyroscopic, rates, velocity + 3, first, second, lever, mode_momentum, h,
                           leg.right_hub, leg.right_modes);
  // Pressure does work p dV; the cavity's volume is a cubic of the modal coordinates. A closed
  // cavity exerts no net force or moment, so the hub's rows have no such term.
  for (int cavity = 0; cavity < part.cavity_count; ++cavity) {
    const double amount = h * pressure[cavity];
    if (amount == 0.0) continue;
    DoubleLanes gradient[kVectors];
    for (int v = 0; v < kVectors; ++v) gradient[v] = load(part.volume_1 + cavity * M + 8 * v);
    const double* quadratic = part.volume_2 + long(cavity) * M * M;
    const double* cubic = part.volume_3 + long(cavity) * M * M * M;
    for (int b = 0; b < M; ++b) {
      DoubleLanes row[kVectors] = {};
      for (int c = 0; c < M; ++c) {
        const DoubleLanes coordinate = broadcast(0.5 * alpha[c]);
        for (int v = 0; v < kVectors; ++v) row[v] += coordinate * load(cubic + (long(b) * M + c) * M + 8 * v);
      }
      for (int v = 0; v < kVectors; ++v)
        gradient[v] += alpha[b] * (row[v] + load(quadratic + b * M + 8 * v));
    }
    for (int v = 0; v < kVectors; ++v)
      store(&leg.right_modes[8 * v], load(&leg.right_modes[8 * v]) + amount * gradient[v]);
  }
}

// Adds the elements' part and eliminates the modes; false if the modal block is not positive definite.
template <int M, class Real>
bool eliminate_modes(const Part<Real>& part, const double* alpha, const ElementSystem<M, Real>& elements,
                     const Settings& settings, LegSystem<M>& leg) {
  constexpr int kVectors = M / 8;
  const double h = settings.time_step;
  const double scale = h * (h + settings.stiffness_damping);
  auto& d = leg.inverse_upper;
  for (int a = 0; a < M; ++a) {
    for (int b = 0; b < M; ++b) d[a][b] = scale * double(elements.stiffness[a][b]);
    d[a][a] += 1.0 + settings.mass_damping * h;  // modes are orthonormal in mass
    leg.right_modes[a] += h * double(elements.force[a]);
  }
  if (part.has_linear_stiffness)
    for (int a = 0; a < M; ++a) {
      DoubleLanes dot = {};
      for (int v = 0; v < kVectors; ++v) {
        const DoubleLanes row = load(part.linear_stiffness + a * M + 8 * v);
        dot += row * load(alpha + 8 * v);
        store(&d[a][8 * v], load(&d[a][8 * v]) + scale * row);
      }
      leg.right_modes[a] -= h * sum_lanes(dot);
    }
  if (settings.published_damping) {
    for (int i = 0; i < 3; ++i) {
      for (int a = 0; a < M; ++a) leg.coupling[3 + i][a] += scale * double(elements.turn_stiffness[i][a]);
      for (int j = 0; j < 3; ++j)
        leg.hub[6 * (3 + i) + 3 + j] += scale * double(elements.turn_turn_stiffness[3 * i + j]);
      leg.right_hub[3 + i] += h * double(elements.moment[i]);
    }
  }
  if (!invert_upper_factor<M>(d)) return false;
  for (int i = 0; i < 6; ++i) times_inverse<M>(leg.coupling[i], d, leg.reduced_coupling[i]);
  times_inverse<M>(leg.right_modes, d, leg.reduced_right);
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
  return true;
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
