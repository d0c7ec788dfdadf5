// Mounted parts of measured silicone in a step, for each number of modes and precision. Once per instruction set, in a
// namespace of its own, so that the stepper's copies of the same templates stay the stepper's: what a compiler inlines and
// fuses there depends on what else is there.
#include "add_part.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

template <int M, class Real>
bool add_rubber_part(const Part<Real>* parts, const RobotModel& robot, int k, const Settings& settings, RobotState& state,
                     void* work, void* clock) {
  // The same structures as the stepper's, of this namespace.
  return add_part<M, Real>(parts, robot, k, settings, state, *static_cast<Workspace<M, Real>*>(work),
                           *static_cast<Clock*>(clock));
}

template <int M, class Real>
void find_stiff_parts(const Part<Real>* parts, const RobotModel& robot, const Settings& settings, const RobotState& state,
                      void* work) {
  auto& own = *static_cast<Workspace<M, Real>*>(work);
  for (int k = 0; k < robot.mount_count; ++k) {
    const Part<Real>& part = parts[robot.mounts[k].part];
    if (part.is_rubber())
      find_stiff<M, Real>(part, state.modes + k * M, state.mode_rates + k * M, settings, state.has_memory, own.mounts[k],
                          own.stiff[k]);
  }
}

template <class Real>
void find_stiff_parts_of(int modes, const Part<Real>* parts, const RobotModel& robot, const Settings& settings,
                         const RobotState& state, void* work) {
  if (modes == 8) return find_stiff_parts<8, Real>(parts, robot, settings, state, work);
  if (modes == 16) return find_stiff_parts<16, Real>(parts, robot, settings, state, work);
  if (modes == 24) return find_stiff_parts<24, Real>(parts, robot, settings, state, work);
  if (modes == 32) return find_stiff_parts<32, Real>(parts, robot, settings, state, work);
  return find_stiff_parts<40, Real>(parts, robot, settings, state, work);
}

template <class Real>
bool add_rubber_part_of(int modes, const Part<Real>* parts, const RobotModel& robot, int k, const Settings& settings,
                        RobotState& state, void* work, void* clock) {
  if (modes == 8) return add_rubber_part<8, Real>(parts, robot, k, settings, state, work, clock);
  if (modes == 16) return add_rubber_part<16, Real>(parts, robot, k, settings, state, work, clock);
  if (modes == 24) return add_rubber_part<24, Real>(parts, robot, k, settings, state, work, clock);
  if (modes == 32) return add_rubber_part<32, Real>(parts, robot, k, settings, state, work, clock);
  return add_rubber_part<40, Real>(parts, robot, k, settings, state, work, clock);
}

}  // namespace PNEUMORPH_INSTRUCTION_SET

void PNEUMORPH_STIFF_NAME(int modes, const Part<float>* parts, const RobotModel& robot, const Settings& settings,
                          const RobotState& state, void* work) {
  PNEUMORPH_INSTRUCTION_SET::find_stiff_parts_of(modes, parts, robot, settings, state, work);
}

void PNEUMORPH_STIFF_NAME(int modes, const Part<double>* parts, const RobotModel& robot, const Settings& settings,
                          const RobotState& state, void* work) {
  PNEUMORPH_INSTRUCTION_SET::find_stiff_parts_of(modes, parts, robot, settings, state, work);
}

bool PNEUMORPH_RUBBER_NAME(int modes, const Part<float>* parts, const RobotModel& robot, int k, const Settings& settings,
                           RobotState& state, void* work, void* clock) {
  return PNEUMORPH_INSTRUCTION_SET::add_rubber_part_of(modes, parts, robot, k, settings, state, work, clock);
}

bool PNEUMORPH_RUBBER_NAME(int modes, const Part<double>* parts, const RobotModel& robot, int k, const Settings& settings,
                           RobotState& state, void* work, void* clock) {
  return PNEUMORPH_INSTRUCTION_SET::add_rubber_part_of(modes, parts, robot, k, settings, state, work, clock);
}

}  // namespace pneumorph
