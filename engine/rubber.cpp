// Forces and stiffness of parts of measured silicone, for each number of modes and precision; once per instruction set, in
// a namespace of its own, so that the stepper's own copies of the same templates stay the stepper's.
#include "rubber.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

template <class Real>
void rubber_system_of(const Part<Real>& part, int modes, const double* alpha, const Settings& settings, Real* left,
                      void* system) {
  if (modes == 8) rubber_system<8, Real>(part, alpha, settings, left, *static_cast<ElementSystem<8, Real>*>(system));
  if (modes == 16) rubber_system<16, Real>(part, alpha, settings, left, *static_cast<ElementSystem<16, Real>*>(system));
  if (modes == 24) rubber_system<24, Real>(part, alpha, settings, left, *static_cast<ElementSystem<24, Real>*>(system));
  if (modes == 32) rubber_system<32, Real>(part, alpha, settings, left, *static_cast<ElementSystem<32, Real>*>(system));
}

}  // namespace PNEUMORPH_INSTRUCTION_SET

void PNEUMORPH_RUBBER_NAME(const Part<float>& part, int modes, const double* alpha, const Settings& settings, float* left,
                           void* system) {
  PNEUMORPH_INSTRUCTION_SET::rubber_system_of(part, modes, alpha, settings, left, system);
}

void PNEUMORPH_RUBBER_NAME(const Part<double>& part, int modes, const double* alpha, const Settings& settings, double* left,
                           void* system) {
  PNEUMORPH_INSTRUCTION_SET::rubber_system_of(part, modes, alpha, settings, left, system);
}

}  // namespace pneumorph
