// Elements of measured silicone: Yeoh's law and branches that relax. Equations (14) to (16), (36) and (37) of
// docs/physics.md; pneumorph/reduction/sampled_branches.py is the same in NumPy.
//
// A spring has Q of the strain at each sampled point. What a step keeps of it is left over from the step's start,
//   left = e^-a Q - c E,   so that Q' = left + c E'   with the strain E' that the next step finds in any case:
// six numbers a branch and point, no deformation gradient beside that of the elastic forces.
//
// Compiled beside the stepper and not in it: what the compiler fuses there stays as it is.
#pragma once
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

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
