// Elements of measured silicone: Yeoh's law, branches that relax, and volumes of whole elements. Equations (14) to (16),
// (36) and (37) of docs/physics.md; pneumorph/reduction/mixed_dilatation.py and sampled_branches.py are the same in NumPy.
//
// A spring has Q of the strain at each sampled point. What a step keeps of it is left over from the step's start,
//   left = e^-a Q - c E,   so that Q' = left + c E'   with the strain E' that the next step finds in any case:
// six numbers a branch and point, no deformation gradient beside that of the elastic forces.
//
// Compiled beside the stepper and not in it: what the compiler fuses there stays as it is.
#pragma once
#include "facing_walls.hpp"
#include "leg_system.hpp"
#include "yeoh.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// Branches over one step.
template <class Real>
struct StepBranches {
  int count = 0;
  Real gain[kMaximumBranches], decay[kMaximumBranches];  // c and e^-a
  Real stress[kMaximumBranches];                         // 2 k e^-a: second stress over mu of a spring at the step's start
  Real modulus[kMaximumBranches];                        // 2 k: of one at its end
  Real resistance = 0;  // stiffness over that of the shear modulus, as the step scales the latter

  StepBranches(const Part<Real>& part, const Settings& settings) : count(part.branch_count) {
    double sum = 0;
    for (int b = 0; b < count; ++b) {
      const double a = settings.time_step / part.branch_time[b], c = -std::expm1(-a) / a;
      gain[b] = Real(c);
      decay[b] = Real(std::exp(-a));
      const double ratio = settings.branch_factor * part.branch_ratio[b];
      stress[b] = Real(2 * ratio * std::exp(-a));
      modulus[b] = Real(2 * ratio);
      sum += c * ratio;
    }
    resistance = Real(sum * settings.time_step / (settings.time_step + settings.stiffness_damping));
  }
};

// Green's strain of a gradient: 00, 11, 22, 01, 02, 12.
template <class Real, class V>
inline void green_strain(const V f[9], V strain[6]) {
  constexpr int kFirst[6] = {0, 1, 2, 0, 0, 1}, kSecond[6] = {0, 1, 2, 1, 2, 2};
  for (int i = 0; i < 6; ++i) {
    const int a = kFirst[i], b = kSecond[i];
    strain[i] = Real(0.5) * (f[a] * f[b] + f[3 + a] * f[3 + b] + f[6 + a] * f[6 + b] - Real(a == b));
  }
}

// Adds the branches' stress, over mu, to p, and takes their springs from the gradient `f` to the step's end; `left`:
// (branch, 6, kLane). The stress is that of a step in which nothing moves, or with `Ahead` of one that ends at `end`.
template <bool Ahead, class Real, class V>
inline void relax(const StepBranches<Real>& branches, const V f[9], const V end[9], Real* left, V p[9]) {
  using L = RegisterLanes<Real>;
  V strain[6], end_strain[6], stress[6] = {};
  green_strain<Real>(f, strain);
  if constexpr (Ahead) green_strain<Real>(end, end_strain);
  for (int branch = 0; branch < branches.count; ++branch)
    for (int i = 0; i < 6; ++i) {
      Real* at = left + (branch * 6 + i) * kLane;
      const V moved = branches.gain[branch] * strain[i], spring = L::load(at) + moved;
      const V next = branches.decay[branch] * spring - moved;
      if constexpr (Ahead)
        stress[i] += branches.modulus[branch] * (next + branches.gain[branch] * end_strain[i]);
      else
        stress[i] += branches.stress[branch] * spring;
      L::store(at, next);
    }
  constexpr int kEntry[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
  const V* now = Ahead ? end : f;
  for (int k = 0; k < 3; ++k)
    for (int b = 0; b < 3; ++b)
      for (int a = 0; a < 3; ++a) p[3 * k + b] += now[3 * k + a] * stress[kEntry[a][b]];
}

// As deform_hyperelastic_block, with branches; `end` with `Ahead`: coordinates where the forces are.
template <bool Published, bool Ahead, class Law, class Real>
__attribute__((noinline)) void deform_rubber_block(const ElementFamily<Real>& family, const Law& law,
                                                   const StepBranches<Real>& branches, Real* left, int number, int modes,
                                                   const Real* alpha, const Real* end,
                                                   HyperelasticBlock<3, Published, Real>& block,
                                                   typename RegisterLanes<Real>::type turn_turn[6]) {
  using L = RegisterLanes<Real>;
  using V = typename L::type;
  for (int lane = 0; lane < kLane; lane += L::count) {
    V f[9], p[9];
    deformation_gradient<3, Real>(family, number, lane, modes, Ahead ? end : alpha, f);
    const V mu = L::load(family.mu + number * kLane + lane);
    law.stress(f, p);
    if (branches.count > 0) {
      Real* own = left + long(number) * branches.count * 6 * kLane + lane;
      if constexpr (Ahead) {
        V start[9];
        deformation_gradient<3, Real>(family, number, lane, modes, alpha, start);
        relax<true, Real>(branches, start, f, own, p);
      } else {
        relax<false, Real>(branches, f, f, own, p);
      }
    }
    for (int row = 0; row < 9; ++row) L::store(&block.stress[0][row][lane], mu * p[row]);
    if constexpr (Published) {
      store_published_factor<3, Law, Real>(law, f, mu, lane, block, turn_turn);
    } else {
      const Real stiffer = 1 + branches.resistance;
      store_objective_factor<3, Real>(f, family.lambda_over_mu / stiffer, stiffer * mu, lane, block);
    }
  }
}

template <int M, bool Published, bool Ahead, class Law, class Real>
inline void add_rubber(const Part<Real>& part, const Law& law, const StepBranches<Real>& branches, Real* left,
                       const Real* alpha, const Real* end, Real (*work)[M], ElementSystem<M, Real>& system) {
  const auto deform = [&](int number, HyperelasticBlock<3, Published, Real>& block, auto* turns) {
    deform_rubber_block<Published, Ahead, Law, Real>(part.tetrahedra, law, branches, left, number, M, alpha, end, block, turns);
  };
  add_blocks<M, 3, Published, Real>(part.tetrahedra, deform, work, system.stiffness, system.turn_turn_stiffness);
}

// Calls `use(law)` with the law of a part's tetrahedra.
template <class Real, class Use>
inline void with_law_of(const Part<Real>& part, const Use& use) {
  const Real ratio = part.tetrahedra.lambda_over_mu;
  if (part.tetrahedra.law == kYeoh)
    use(Yeoh<Real>{part.yeoh_c2, part.yeoh_c3, ratio + Real(2.0 / 3)});
  else if (part.tetrahedra.law == kStableNeoHookean)
    use(StableNeoHookean<3, Real>(ratio));
  else
    use(StVenantKirchhoff<3, Real>(ratio));
}

template <int M, bool Published, bool Ahead, class Real>
inline void add_rubber_of_law(const Part<Real>& part, const StepBranches<Real>& branches, Real* left, const Real* alpha,
                              const Real* end, Real (*work)[M], ElementSystem<M, Real>& system) {
  with_law_of(part, [&](const auto& law) {
    add_rubber<M, Published, Ahead>(part, law, branches, left, alpha, end, work, system);
  });
}

// Gradients by the modes of the changes of volume's cubic terms, sum over b <= c <= a of t alpha_b alpha_c alpha_a; lanes over
// pressures, of two modes a side by side. The gradients of a block of modes a stay in registers while all pairs b <= c stream by.
template <int M, class Real>
inline void cubic_gradients(const Part<Real>& part, const double* alpha, double third[kMaximumPressures][M]) {
  using L = Lanes<Real, 2 * kPressureLane * sizeof(Real)>;
  using V = typename L::type;
  const Real* terms = part.dilatation_3;
  Real coordinates[M];
  V two_coordinates[M / 2];
  for (int a = 0; a < M; ++a) coordinates[a] = Real(alpha[a]);
  for (int a = 0; a < M; a += 2) {
    Real lanes[2 * kPressureLane];
    for (int lane = 0; lane < 2 * kPressureLane; ++lane) lanes[lane] = coordinates[a + lane / kPressureLane];
    two_coordinates[a / 2] = L::load(lanes);
  }
  for (int first = 0; first < part.pressure_count; first += kPressureLane) {
    V by_pair_mode[M] = {};  // of b and c, over the two modes a
    alignas(64) Real gradient[kPressureLane][M] = {};
    for (int block = 0; block < M; block += kCubicModes) {
      V by_mode[kCubicModes / 2] = {};
      for (int c = 0; c < block + kCubicModes; ++c) {
        V by_c = {};
        for (int b = 0; b <= c; ++b, terms += kCubicModes * kPressureLane) {
          const Real pair = coordinates[b] * coordinates[c];
          V sum[2] = {};
#pragma GCC unroll 4
          for (int i = 0; i < kCubicModes / 2; ++i) {
            const V term = L::load(terms + i * 2 * kPressureLane);
            by_mode[i] += pair * term;
            sum[i % 2] += two_coordinates[block / 2 + i] * term;
          }
          const V both = sum[0] + sum[1];
          by_c += coordinates[b] * both;
          by_pair_mode[b] += coordinates[c] * both;
        }
        by_pair_mode[c] += by_c;
      }
      for (int i = 0; i < kCubicModes / 2; ++i)
        for (int lane = 0; lane < 2 * kPressureLane; ++lane)
          gradient[lane % kPressureLane][block + 2 * i + lane / kPressureLane] = by_mode[i][lane];
    }
    for (int lane = 0; lane < kPressureLane; ++lane)
      for (int a = 0; a < M; ++a)
        third[first + lane][a] = gradient[lane][a] + by_pair_mode[a][lane] + by_pair_mode[a][kPressureLane + lane];
  }
}

// A polynomial c of the modes with the energy root^2 / 2 c^2: its `row` root dc, and the work of root c on it.
template <int M, class Real>
inline void add_mixed(const double* alpha, const double* first, const Real* quadratic, const double* third, double root,
                      Real row[M], Real work[M]) {
  constexpr int kVectors = M / 8;
  DoubleLanes sum[2][kVectors] = {}, products = {};  // two chains, to hide the latency of sums
  for (int b = 0; b < M; b += 2)
    for (int chain = 0; chain < 2; ++chain)
      for (int v = 0; v < kVectors; ++v)
        sum[chain][v] += alpha[b + chain] * load_doubles(quadratic + (b + chain) * M + 8 * v);
  alignas(64) double derivative[M];
  for (int v = 0; v < kVectors; ++v) {
    const DoubleLanes one = load(first + 8 * v), two = sum[0][v] + sum[1][v], three = load(third + 8 * v);
    products += load(alpha + 8 * v) * (one + 0.5 * two + (1.0 / 3) * three);
    store(derivative + 8 * v, root * (one + two + three));
  }
  const Real stress = Real(root * sum_lanes(products));
  for (int a = 0; a < M; ++a) {
    row[a] = Real(derivative[a]);
    work[a] += stress * row[a];
  }
}

// Changes of volume, cubic polynomials of the modes, and stretches of a stiff sheet, quadratic ones: with modulus k of each
// c the force -k c dc and the stiffness k dc (x) dc.
template <int M, class Real>
void add_mixed_energies(const Part<Real>& part, const double* alpha, Real work[M], Real stiffness[M][M]) {
  alignas(64) Real rows[kMaximumPressures + kMaximumStretches][kRowStride<M>];
  alignas(64) double third[kMaximumPressures][M];
  alignas(64) const double none[M] = {};
  cubic_gradients<M, Real>(part, alpha, third);
  const double of_volume = std::sqrt(part.dilatation_lambda), of_sheet = std::sqrt(part.stretch_modulus);
  Real(*row)[kRowStride<M>] = rows;
  for (int k = 0; k < part.pressure_count; ++k)
    add_mixed<M, Real>(alpha, part.dilatation_1 + k * M, part.dilatation_2 + long(k) * M * M, third[k], of_volume, *row++, work);
  for (int k = 0; k < part.stretch_count; ++k)
    add_mixed<M, Real>(alpha, part.stretch_1 + k * M, part.stretch_2 + long(k) * M * M, none, of_sheet, *row++, work);
  add_outer_products<true, M>(rows, int(row - rows), stiffness);
}

// Adds what is stiff in a part, the sheet, the changes of volume and walls that meet: `work` of its stress on every mode and,
// under published damping, of the stresses of three turns, and its stiffness.
template <int M, class Real>
void add_stiff(const Part<Real>& part, const double* alpha, const Real* coordinates, const Settings& settings,
               Real (*work)[M], ElementSystem<M, Real>& system) {
  const bool edges = settings.edge_rotations != 0;
  if (settings.published_damping)
    add_elements<M, 2, 4, Real>(part.membranes, coordinates, edges, work, system);
  else
    add_elements<M, 2, 1, Real>(part.membranes, coordinates, edges, work, system);
  if (part.pressure_count + part.stretch_count > 0) add_mixed_energies<M, Real>(part, alpha, work[0], system.stiffness);
  if (part.wall_gap_count > 0) add_facing_walls<M, Real>(part, alpha, work[0], system.stiffness);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
