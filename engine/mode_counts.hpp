// The number of modes as a constant of the compiler: kernels are compiled for every multiple of eight up to kMaximumModes.
#pragma once
#include <type_traits>

#include "model.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// What `use` returns, given std::integral_constant<int, modes>{}.
template <int M = 8, class Use>
inline auto with_modes(int modes, const Use& use) {
  if constexpr (M < kMaximumModes)
    if (modes != M) return with_modes<M + 8>(modes, use);
  return use(std::integral_constant<int, M>{});
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
