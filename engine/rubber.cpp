// Mounted parts of measured silicone in a step, for each number of modes and precision. Once per instruction set, in a
// namespace of its own, so that the stepper's copies of the same templates stay the stepper's: what a compiler inlines and
// fuses there depends on what else is there.
#include "add_part.hpp"
#include "mode_counts.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

// The workspace is of the same structures as the stepper's, of this namespace.
template <class Real>
void begin_parts(int modes, const Part<Real>* parts, const RobotModel& robot, const Settings& settings, RobotState& state,
                 void* work) {
  with_modes(modes, [&](auto count) {
    constexpr int M = decltype(count)::value;
    begin_rubber_parts<M, Real>(parts, robot, settings, state, *static_cast<Workspace<M, Real>*>(work));
  });
}

template <class Real>
bool add_rubber_part(int modes, const Part<Real>* parts, const RobotModel& robot, int k, const Settings& settings,
                     RobotState& state, void* work, void* clock) {
  return with_modes(modes, [&](auto count) {
    constexpr int M = decltype(count)::value;
    return add_part<M, Real>(parts, robot, k, settings, state, *static_cast<Workspace<M, Real>*>(work),
                             *static_cast<Clock*>(clock));
  });
}

}  // namespace PNEUMORPH_INSTRUCTION_SET

void PNEUMORPH_BEGIN_NAME(int modes, const Part<float>* parts, const RobotModel& robot, const Settings& settings,
                          RobotState& state, void* work) {
  PNEUMORPH_INSTRUCTION_SET::begin_parts(modes, parts, robot, settings, state, work);
}

void PNEUMORPH_BEGIN_NAME(int modes, const Part<double>* parts, const RobotModel& robot, const Settings& settings,
                          RobotState& state, void* work) {
  PNEUMORPH_INSTRUCTION_SET::begin_parts(modes, parts, robot, settings, state, work);
}

bool PNEUMORPH_RUBBER_NAME(int modes, const Part<float>* parts, const RobotModel& robot, int k, const Settings& settings,
                           RobotState& state, void* work, void* clock) {
  return PNEUMORPH_INSTRUCTION_SET::add_rubber_part(modes, parts, robot, k, settings, state, work, clock);
}

bool PNEUMORPH_RUBBER_NAME(int modes, const Part<double>* parts, const RobotModel& robot, int k, const Settings& settings,
                           RobotState& state, void* work, void* clock) {
  return PNEUMORPH_INSTRUCTION_SET::add_rubber_part(modes, parts, robot, k, settings, state, work, clock);
}

}  // namespace pneumorph
