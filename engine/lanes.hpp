// A 64-byte vector of numbers, as the compiler's own vector type: one register with AVX-512, two
// with AVX2, four with the baseline. Sums over lanes are taken in a fixed order.
#pragma once
#include <cmath>

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

template <class Real, int Bytes = 64>
struct Lanes {
  static constexpr int count = Bytes / sizeof(Real);
  typedef Real type __attribute__((vector_size(Bytes)));
  typedef Real unaligned __attribute__((vector_size(Bytes), aligned(sizeof(Real)), may_alias));
  static type load(const Real* from) { return *reinterpret_cast<const unaligned*>(from); }
  static void store(Real* to, type value) { *reinterpret_cast<unaligned*>(to) = value; }
};

template <class Real>
inline typename Lanes<Real>::type load(const Real* from) {
  return *reinterpret_cast<const typename Lanes<Real>::type*>(from);
}
template <class Real>
inline void store(Real* to, typename Lanes<Real>::type value) {
  *reinterpret_cast<typename Lanes<Real>::type*>(to) = value;
}
template <class Real>
inline typename Lanes<Real>::type broadcast(Real value) {
  return typename Lanes<Real>::type{} + value;
}

// Square roots lane by lane.
template <class Real, class V>
inline V root_lanes(V value) {
  alignas(64) Real lanes[Lanes<Real>::count];
  store(lanes, value);
#pragma omp simd
  for (int i = 0; i < Lanes<Real>::count; ++i) lanes[i] = std::sqrt(lanes[i]);
  return load(lanes);
}

inline double sum_lanes(Lanes<double>::type v) {
#if defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
#define PNEUMORPH_SHUFFLE
#endif
#endif
#ifdef PNEUMORPH_SHUFFLE
  typedef double half __attribute__((vector_size(32)));
  typedef double quarter __attribute__((vector_size(16)));
  const half low = __builtin_shufflevector(v, v, 0, 1, 2, 3), high = __builtin_shufflevector(v, v, 4, 5, 6, 7);
  const half h = low + high;
  const quarter q = __builtin_shufflevector(h, h, 0, 1) + __builtin_shufflevector(h, h, 2, 3);
  return q[0] + q[1];
#else  // GCC before 12: the same sums in the same order
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
#endif
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
