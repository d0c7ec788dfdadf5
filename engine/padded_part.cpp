#include "padded_part.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace pneumorph {

namespace {

template <class Real>
Real* allocate(std::vector<AlignedArray>& storage, size_t count) {
  storage.emplace_back(count * sizeof(Real));
  return storage.back().as<Real>();
}

// Copies (rows, modes) into (rows, padded), zeros behind.
const double* pad_rows(std::vector<AlignedArray>& storage, const double* from, size_t rows, int modes, int padded) {
  double* to = allocate<double>(storage, rows * padded + 8);
  for (size_t r = 0; r < rows; ++r)
    for (int a = 0; a < modes; ++a) to[r * padded + a] = from[r * modes + a];
  return to;
}

const double* copy(std::vector<AlignedArray>& storage, const double* from, size_t count) {
  double* to = allocate<double>(storage, count + 1);
  for (size_t i = 0; i < count; ++i) to[i] = from[i];
  return to;
}

template <class Real>
ElementFamily<Real> pad_family(std::vector<AlignedArray>& storage, int columns, int law, int count, const double* rest,
                               const double* gradient, const double* lambda, const double* mu, int modes, int padded) {
  const int rows = 3 * columns;
  ElementFamily<Real> family;
  family.law = law;
  if (count > 0 && mu[0] > 0) family.lambda_over_mu = Real(lambda[0] / mu[0]);
  family.block_count = (count + kLane - 1) / kLane;
  family.last_count = count - (family.block_count - 1) * kLane;
  const size_t elements = size_t(family.block_count) * kLane;
  Real* rest_lanes = allocate<Real>(storage, elements * rows);
  Real* gradient_lanes = allocate<Real>(storage, elements * rows * padded);
  Real* gradient_modes = allocate<Real>(storage, elements * rows * padded);
  Real* lambda_lanes = allocate<Real>(storage, elements);
  Real* mu_lanes = allocate<Real>(storage, elements);
  Real* row_scale = allocate<Real>(storage, elements);
  Real* inverse_scale = allocate<Real>(storage, elements);
  Real* trace_scale = allocate<Real>(storage, elements);
  for (size_t e = 0; e < elements; ++e) {
    const size_t block = e / kLane, lane = e % kLane;
    const bool real = e < size_t(count);
    for (int row = 0; row < rows; ++row) {
      // A padding element is at rest with no stiffness.
      const double value = real ? rest[e * rows + row] : (row % (columns + 1) == 0 ? 1.0 : 0.0);
      rest_lanes[(block * rows + row) * kLane + lane] = Real(value);
      for (int a = 0; real && a < modes; ++a) {
        const Real g = Real(gradient[(e * rows + row) * modes + a]);
        gradient_lanes[((block * padded + a) * rows + row) * kLane + lane] = g;
        const int wide = 64 / int(sizeof(Real)), column = a / wide * wide, width = std::min(wide, padded - column);
        gradient_modes[block * kLane * rows * padded + kLane * rows * column + (lane * rows + row) * width + a - column] = g;
      }
    }
    const double l = real ? lambda[e] : 0.0, m = real ? mu[e] : 0.0;
    lambda_lanes[e] = Real(l);
    mu_lanes[e] = Real(m);
    row_scale[e] = Real(std::sqrt(columns == 3 ? m : 2 * m));
    if (m > 0) inverse_scale[e] = Real(1 / std::sqrt(columns == 3 ? m : 2 * m));
    if (m > 0) trace_scale[e] = Real(columns == 3 ? std::sqrt(l / m) : (std::sqrt(l / m + 1) - 1) / 2);
  }
  family.rest = rest_lanes;
  family.gradient_lanes = gradient_lanes;
  family.gradient_modes = gradient_modes;
  family.lambda = lambda_lanes;
  family.mu = mu_lanes;
  family.row_scale = row_scale;
  family.inverse_scale = inverse_scale;
  family.trace_scale = trace_scale;
  return family;
}

// Sum over corotational tetrahedra of 2 mu G_a : G_b, (padded, padded).
template <class Real>
Real* constant_stiffness(std::vector<AlignedArray>& storage, const PartInput& in, int padded) {
  const size_t m = in.modes;
  std::vector<double> sum(m * m, 0.0);
  const size_t rows = in.tetrahedron_law == kCorotational ? size_t(in.tetrahedra) * 9 : 0;
  for (size_t row = 0; row < rows; ++row) {
    const double* g = in.tetrahedron_gradient + row * m;
    const double mu = in.tetrahedron_mu[row / 9];
    for (size_t a = 0; a < m; ++a)
      for (size_t b = 0; b < m; ++b) sum[a * m + b] += 2 * mu * g[a] * g[b];
  }
  Real* stiffness = allocate<Real>(storage, size_t(padded) * padded);
  for (size_t a = 0; a < m; ++a)
    for (size_t b = 0; b < m; ++b) stiffness[a * padded + b] = Real(sum[a * m + b]);
  return stiffness;
}

// Cubic polynomials: gradient_a = first + sum_b second alpha_b + sum over pairs third alpha_b alpha_c.
template <class Real>
struct PaddedCubics {
  const double *first, *second;
  const Real* third;
};

template <class Real>
PaddedCubics<Real> pad_cubics(std::vector<AlignedArray>& storage, int count, const double* linear, const double* square,
                              const double* cube, int modes, int p) {
  const size_t m = modes, pairs = pair_count(p);
  const double* first = pad_rows(storage, linear, count, modes, p);
  double* quadratic = allocate<double>(storage, size_t(count) * p * p + 8);
  Real* cubic = allocate<Real>(storage, count * pairs * p + 16);
  for (size_t c = 0; c < size_t(count); ++c)
    for (size_t a = 0; a < m; ++a) {
      for (size_t b = 0; b < m; ++b) quadratic[(c * p + a) * p + b] = square[(c * m + a) * m + b];
      const double* matrix = cube + (c * m + a) * m * m;
      for (size_t b = 0; b < m; ++b)
        for (size_t d = b; d < m; ++d)
          cubic[(c * pairs + pair_index(int(b), int(d), p)) * p + a] =
              Real(b == d ? 0.5 * matrix[b * m + b] : 0.5 * (matrix[b * m + d] + matrix[d * m + b]));
    }
  return {first, quadratic, cubic};
}

// Terms sum over b <= c <= a of t alpha_b alpha_c alpha_a of cubics, each in a lane: (block of cubics, block of modes a,
// pair b <= c up to the block's end, mode a, lane). `cube`: third derivatives, (cubic, mode, mode, mode).
template <class Real>
const Real* pad_cubic_terms(std::vector<AlignedArray>& storage, int count, const double* cube, int modes, int p) {
  const int m = modes, blocks = (count + kPressureLane - 1) / kPressureLane;
  size_t terms_of_block = 0;
  for (int first = 0; first < p; first += kCubicModes)
    terms_of_block += kCubicModes * size_t(first + kCubicModes) * (first + kCubicModes + 1) / 2;
  Real* terms = allocate<Real>(storage, blocks * terms_of_block * kPressureLane + 16);
  Real* at = terms;
  for (int block = 0; block < blocks; ++block)
    for (int first = 0; first < p; first += kCubicModes)
      for (int c = 0; c < first + kCubicModes; ++c)
        for (int b = 0; b <= c; ++b)
          for (int a = first; a < first + kCubicModes; ++a, at += kPressureLane) {
            if (a < c || a >= m) continue;
            // Of 6, 3 or 1 equal terms of the sum over all modes.
            const double share = b == c ? (c == a ? 1.0 / 6 : 0.5) : (c == a ? 0.5 : 1.0);
            for (int lane = 0; lane < kPressureLane && block * kPressureLane + lane < count; ++lane) {
              const double* own = cube + size_t(block * kPressureLane + lane) * m * m * m;
              const auto entry = [&](int i, int j, int k) { return own[(size_t(i) * m + j) * m + k]; };
              at[lane] = Real(share / 6 * (entry(a, b, c) + entry(a, c, b) + entry(b, a, c) + entry(b, c, a) +
                                           entry(c, a, b) + entry(c, b, a)));
            }
          }
  return terms;
}

// Matrices of modes, (count, mode, mode), each padded.
template <class Real>
const Real* pad_matrices(std::vector<AlignedArray>& storage, int count, const double* from, int modes, int p) {
  Real* to = allocate<Real>(storage, size_t(count) * p * p + 8);
  for (size_t row = 0; row < size_t(count) * modes; ++row)
    for (int a = 0; a < modes; ++a) to[(row / modes * p + row % modes) * p + a] = Real(from[row * modes + a]);
  return to;
}

// Volumes of the cavities, and what measured silicone has besides.
template <class Real>
void pad_volumes(std::vector<AlignedArray>& storage, const PartInput& in, int p, Part<Real>& part) {
  const auto cavities = pad_cubics<Real>(storage, in.cavities, in.volume_1, in.volume_2, in.volume_3, in.modes, p);
  part.cavity_count = in.cavities;
  part.volume_1 = cavities.first, part.volume_2 = cavities.second, part.volume_3 = cavities.third;
  part.pressure_count = in.pressures;
  part.dilatation_lambda = in.dilatation_lambda;
  part.dilatation_1 = pad_rows(storage, in.dilatation_1, in.pressures, in.modes, p);
  part.dilatation_2 = pad_matrices<Real>(storage, in.pressures, in.dilatation_2, in.modes, p);
  part.dilatation_3 = pad_cubic_terms<Real>(storage, in.pressures, in.dilatation_3, in.modes, p);
  part.stretch_count = in.stretches;
  part.stretch_modulus = in.stretch_modulus;
  part.stretch_1 = pad_rows(storage, in.stretch_1, in.stretches, in.modes, p);
  part.stretch_2 = pad_matrices<Real>(storage, in.stretches, in.stretch_2, in.modes, p);
  part.yeoh_c2 = Real(in.yeoh_c2), part.yeoh_c3 = Real(in.yeoh_c3);
  part.branch_count = in.branches;
  for (int b = 0; b < in.branches; ++b)
    part.branch_ratio[b] = in.branch_ratio[b], part.branch_time[b] = in.branch_time[b];
}

// Facing walls, the pairs of each gap together.
template <class Real>
void pad_walls(std::vector<AlignedArray>& storage, const PartInput& in, int p, Part<Real>& part) {
  part.wall_gap_count = in.wall_gaps;
  part.wall_axis = copy(storage, in.wall_axis, size_t(in.wall_gaps) * 3);
  part.wall_axis_modes = pad_rows(storage, in.wall_axis_modes, size_t(in.wall_gaps) * 3, in.modes, p);
  part.wall_pair = copy(storage, in.wall_pair, size_t(in.wall_pairs) * 3);
  part.wall_pair_modes = pad_rows(storage, in.wall_pair_modes, size_t(in.wall_pairs) * 3, in.modes, p);
  part.wall_pair_stiffness = copy(storage, in.wall_pair_stiffness, in.wall_pairs);
  int* first = allocate<int>(storage, in.wall_gaps + 1);
  for (int pair = 0; pair < in.wall_pairs; ++pair) {
    const double gap = in.wall_pair_gap[pair];
    if (!(gap >= 0 && gap < in.wall_gaps) || (pair > 0 && gap < in.wall_pair_gap[pair - 1]))
      throw std::invalid_argument("wall_pair_gap must rise from 0 to below the " + std::to_string(in.wall_gaps) + " gaps");
    for (int g = int(gap) + 1; g <= in.wall_gaps; ++g) first[g] = pair + 1;
  }
  part.wall_pair_first = first;
}

void check_count(int count, int most, const char* what) {
  if (count > most)
    throw std::invalid_argument("a part has " + std::to_string(count) + " " + what + ", at most " +
                                std::to_string(most) + " are supported");
}

// Moments of mass about the origin as polynomials of the modal coordinates.
template <class Real>
void pad_moments(std::vector<AlignedArray>& storage, const PartInput& in, int p, Part<Real>& part) {
  const size_t m = in.modes;
  part.mass = in.mass;
  for (int i = 0; i < 3; ++i) part.first_moment[i] = in.first_moment[i];
  part.first_moment_modes = pad_rows(storage, in.first_moment_modes, 3, in.modes, p);
  double* lever = allocate<double>(storage, 3 * p);
  double* lever_modes = allocate<double>(storage, size_t(3) * p * p);
  for (size_t axis = 0; axis < 3; ++axis) {
    const size_t ij = 3 * ((axis + 1) % 3) + (axis + 2) % 3, ji = 3 * ((axis + 2) % 3) + (axis + 1) % 3;
    const double *first = in.second_moment_mode_pairs + ij * m * m, *second = in.second_moment_mode_pairs + ji * m * m;
    for (size_t a = 0; a < m; ++a) {
      lever[axis * p + a] = in.second_moment_modes[ij * m + a] - in.second_moment_modes[ji * m + a];
      for (size_t b = 0; b < m; ++b) lever_modes[(axis * p + b) * p + a] = first[b * m + a] - second[b * m + a];
    }
  }
  double* linear = allocate<double>(storage, 6 * p);
  double* quadratic = allocate<double>(storage, size_t(6) * p * p);
  for (int i = 0, entry = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j, ++entry) {
      part.second_moment[entry] = 0.5 * (in.second_moment[3 * i + j] + in.second_moment[3 * j + i]);
      const double* matrix = in.second_moment_mode_pairs + (3 * i + j) * m * m;
      for (size_t a = 0; a < m; ++a)
        linear[entry * p + a] = in.second_moment_modes[(3 * i + j) * m + a] + in.second_moment_modes[(3 * j + i) * m + a];
      for (size_t b = 0; b < m; ++b)
        for (size_t a = 0; a < m; ++a)
          quadratic[(size_t(entry) * p + b) * p + a] = matrix[b * m + a] + matrix[a * m + b];
    }
  part.lever = lever;
  part.lever_modes = lever_modes;
  part.second_moment_modes = linear;
  part.second_moment_matrices = quadratic;
}

// Points of contact, and all their modes once more in single precision with lanes over points.
template <class Real>
void pad_contacts(std::vector<AlignedArray>& storage, const PartInput& in, int p, Part<Real>& part) {
  const int m = in.modes;
  part.contact_count = in.contacts;
  part.contact_points = copy(storage, in.contact_points, size_t(in.contacts) * 3);
  part.contact_modes = pad_rows(storage, in.contact_modes, size_t(in.contacts) * 3, m, p);
  if (in.contact_flexibility)
    part.contact_flexibility = copy(storage, in.contact_flexibility, size_t(in.contacts) * in.contacts);
  const size_t blocks = (in.contacts + kLane - 1) / kLane;
  float* points = allocate<float>(storage, blocks * 3 * kLane + 1);
  float* modes = allocate<float>(storage, blocks * p * 3 * kLane + 1);
  for (int c = 0; c < in.contacts; ++c)
    for (int i = 0; i < 3; ++i) {
      const size_t block = c / kLane, lane = c % kLane;
      points[(block * 3 + i) * kLane + lane] = float(in.contact_points[3 * c + i]);
      for (int a = 0; a < m; ++a)
        modes[((block * p + a) * 3 + i) * kLane + lane] = float(in.contact_modes[(size_t(c) * 3 + i) * m + a]);
    }
  double* reach = allocate<double>(storage, p);
  for (int i = 0; i < 3; ++i) {
    double low = 0, high = 0;
    for (int c = 0; c < in.contacts; ++c) {
      const double value = in.contact_points[3 * c + i];
      low = c == 0 || value < low ? value : low, high = c == 0 || value > high ? value : high;
    }
    part.contact_centre[i] = 0.5 * (low + high), part.contact_half[i] = 0.5 * (high - low);
  }
  for (int c = 0; c < in.contacts; ++c)
    for (int a = 0; a < m; ++a) {
      const double* of = in.contact_modes + size_t(c) * 3 * m + a;
      reach[a] = std::fmax(reach[a], std::sqrt(of[0] * of[0] + of[m] * of[m] + of[2 * m] * of[2 * m]));
    }
  part.contact_reach = reach;
  part.contact_point_lanes = points;
  part.contact_mode_lanes = modes;
}

}  // namespace

template <class Real>
Part<Real> pad_part(std::vector<AlignedArray>& storage, const PartInput& in, int padded) {
  const int m = in.modes, p = padded;
  check_count(in.cavities, kMaximumRegulators, "cavities");
  check_count(in.pressures, kMaximumPressures, "pressures");
  check_count(in.stretches, kMaximumStretches, "stretches of a sheet");
  check_count(in.branches, kMaximumBranches, "branches");
  Part<Real> part;
  part.tetrahedra = pad_family<Real>(storage, 3, in.tetrahedron_law, in.tetrahedra, in.tetrahedron_rest,
                                     in.tetrahedron_gradient, in.tetrahedron_lambda, in.tetrahedron_mu, m, p);
  part.membranes = pad_family<Real>(storage, 2, in.membrane_law, in.membranes, in.membrane_rest,
                                    in.membrane_gradient, in.membrane_lambda, in.membrane_mu, m, p);
  part.constant_stiffness = constant_stiffness<Real>(storage, in, p);
  double* square = allocate<double>(storage, size_t(p) * p);
  for (int a = 0; a < m; ++a)
    for (int b = 0; b < m; ++b) {
      square[a * p + b] = in.linear_stiffness[a * m + b];
      part.has_linear_stiffness |= square[a * p + b] != 0.0;
    }
  part.linear_stiffness = square;
  pad_volumes(storage, in, p, part);
  pad_walls(storage, in, p, part);
  pad_moments(storage, in, p, part);
  pad_contacts(storage, in, p, part);
  return part;
}

template Part<float> pad_part<float>(std::vector<AlignedArray>&, const PartInput&, int);
template Part<double> pad_part<double>(std::vector<AlignedArray>&, const PartInput&, int);

}  // namespace pneumorph
