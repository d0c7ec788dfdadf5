// Vectors of numbers, as the compiler's own vector types where the processor has registers of that size and as pairs
// of halves where it has not (one vector type over two registers would be spilled to memory by every operation).
// Sums over lanes are taken in a fixed order, halves on halves.
#pragma once
#include <cmath>
#include <type_traits>
#if defined(__AVX512F__)
#include <immintrin.h>
#endif

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

#if defined(__AVX512F__)
constexpr int kRegisterBytes = 64;
#elif defined(__AVX__)
constexpr int kRegisterBytes = 32;
#else
constexpr int kRegisterBytes = 16;
#endif

// Two vectors side by side, with the arithmetic of one.
template <class Real, class Half>
struct Joined {
  Half low, high;

  Real operator[](int i) const {
    constexpr int count = sizeof(Half) / sizeof(Real);
    return i < count ? low[i] : high[i - count];
  }
  friend Joined operator-(Joined a) { return {-a.low, -a.high}; }
#define PNEUMORPH_OPERATOR(sign)                                                                        \
  friend Joined operator sign(Joined a, Joined b) { return {a.low sign b.low, a.high sign b.high}; }    \
  friend Joined operator sign(Joined a, Real b) { return {a.low sign b, a.high sign b}; }               \
  friend Joined operator sign(Real a, Joined b) { return {a sign b.low, a sign b.high}; }               \
  friend Joined& operator sign##=(Joined& a, Joined b) { return a = a sign b; }                         \
  friend Joined& operator sign##=(Joined& a, Real b) { return a = a sign b; }
  PNEUMORPH_OPERATOR(+)
  PNEUMORPH_OPERATOR(-)
  PNEUMORPH_OPERATOR(*)
  PNEUMORPH_OPERATOR(/)
#undef PNEUMORPH_OPERATOR
};

// `Bytes` of numbers: loads, stores and their type.
template <class Real, int Bytes, bool OneRegister = Bytes <= kRegisterBytes>
struct Lanes {
  static constexpr int count = Bytes / sizeof(Real);
  typedef Real type __attribute__((vector_size(Bytes)));
  typedef Real unaligned __attribute__((vector_size(Bytes), aligned(sizeof(Real)), may_alias));
  static type load(const Real* from) { return *reinterpret_cast<const unaligned*>(from); }
  static void store(Real* to, type value) { *reinterpret_cast<unaligned*>(to) = value; }
};
template <class Real, int Bytes>
struct Lanes<Real, Bytes, false> {
  static constexpr int count = Bytes / sizeof(Real);
  using Half = Lanes<Real, Bytes / 2>;
  using type = Joined<Real, typename Half::type>;
  static type load(const Real* from) { return {Half::load(from), Half::load(from + count / 2)}; }
  static void store(Real* to, type value) {
    Half::store(to, value.low);
    Half::store(to + count / 2, value.high);
  }
};

// As many numbers as a register holds: for work that streams over elements or modes.
template <class Real>
using RegisterLanes = Lanes<Real, kRegisterBytes>;

// Eight numbers: for rows of modes, whose count is a multiple of eight.
using DoubleLanes = Lanes<double, 64>::type;
inline DoubleLanes load(const double* from) { return Lanes<double, 64>::load(from); }
inline void store(double* to, DoubleLanes value) { Lanes<double, 64>::store(to, value); }

// Eight numbers of either precision, as double.
template <class V>
struct Widened {
  static V load(const float* from) { return __builtin_convertvector(Lanes<float, sizeof(V) / 2>::load(from), V); }
};
template <class Half>
struct Widened<Joined<double, Half>> {
  static Joined<double, Half> load(const float* from) {
    return {Widened<Half>::load(from), Widened<Half>::load(from + sizeof(Half) / sizeof(double))};
  }
};
#if defined(__AVX512F__)
template <>
struct Widened<DoubleLanes> {
  // In one instruction, where GCC 12 makes two halves of __builtin_convertvector. Unmasked, its header warns.
  static DoubleLanes load(const float* from) { return DoubleLanes(_mm512_maskz_cvtps_pd(0xff, _mm256_loadu_ps(from))); }
};
#endif
inline DoubleLanes load_doubles(const double* from) { return load(from); }
inline DoubleLanes load_doubles(const float* from) { return Widened<DoubleLanes>::load(from); }

// Square roots lane by lane.
template <class Real, class V>
inline V root_lanes(V value) {
  using L = Lanes<Real, sizeof(V)>;
  alignas(64) Real lanes[L::count];
  L::store(lanes, value);
#pragma omp simd
  for (int i = 0; i < L::count; ++i) lanes[i] = std::sqrt(lanes[i]);
  return L::load(lanes);
}

// The lanes of `kept` where `value` is negative, of `other` elsewhere.
template <class V>
inline V where_negative(V value, V kept, V other) {
  return value < 0 ? kept : other;
}
template <class Real, class Half>
inline Joined<Real, Half> where_negative(Joined<Real, Half> value, Joined<Real, Half> kept, Joined<Real, Half> other) {
  return {where_negative(value.low, kept.low, other.low), where_negative(value.high, kept.high, other.high)};
}

// Sum of all lanes.
template <class V>
inline auto sum_lanes(V v) {
  using Real = std::decay_t<decltype(v[0])>;
  constexpr int count = sizeof(V) / sizeof(Real);
  if constexpr (count == 2) {
    return v[0] + v[1];
  } else if constexpr (count == 4) {
    return (v[0] + v[2]) + (v[1] + v[3]);
  } else {
    typename Lanes<Real, sizeof(V) / 2>::type half[2];
    __builtin_memcpy(half, &v, sizeof(V));
    return sum_lanes(half[0] + half[1]);
  }
}
template <class Real, class Half>
inline Real sum_lanes(Joined<Real, Half> v) {
  return sum_lanes(v.low + v.high);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
