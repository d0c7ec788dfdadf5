// Scratch of one thread while it steps a robot, and the clock of the stages.
#pragma once
#include <ctime>

#include "friction.hpp"
#include "leg_system.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

template <int M>
struct ContactRow {
  alignas(64) double response[3][M + 8];  // rows: normal, x, y; columns: modes of its part, hub (6, padded)
  PointOperator point;
  double free_velocity[3];
  double* impulse;
  int mount;                              // -1: on the hub
};

template <int M>
struct ContactAccumulator {
  alignas(64) double modes[kMaximumMounts + 1][M];  // last: stands for the hub's own points
  alignas(64) double hub[8];
};

// The hub's six unknowns: velocity of its origin and turning rate, along its own axes.
struct HubSystem {
  double velocity[6];       // before the step
  double gravity[3];
  double matrix[36];        // with every part eliminated onto it
  double right[6];
  double factor[36];        // inverse of the matrix's Cholesky factor
  double free_velocity[6];  // after the step if nothing touched
};

template <int M, class Real>
struct Workspace {
  HubSystem hub;
  double pressure[kMaximumRegulators];   // simulated
  ElementSystem<M, Real> elements;
  LegSystem<M> legs[kMaximumMounts];
  double transform[kMaximumMounts][36];  // hub unknowns (hub axes) to part unknowns (part axes)
  double world[kMaximumMounts][9];       // part frame to world
  alignas(64) double rates[kMaximumMounts][M];
  ContactAccumulator<M> sum;
  ContactRow<M> rows[1];                 // as many as the robot has contact points
};

struct Clock {
  explicit Clock(StageSeconds* s) : stages(s) {
    if (stages) last = now();
  }
  void lap(int stage) {
    if (!stages) return;
    const double time = now();
    stages->seconds[stage] += time - last;
    last = time;
  }
  static double now() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);  // not what other programs take from this thread
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
  }
  StageSeconds* stages;
  double last = 0;
};

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
