// Scratch of one thread while it steps a robot, and the clock of the stages.
#pragma once
#include <ctime>

#include "friction_newton.hpp"
#include "kept_tangent.hpp"
#include "rubber_system.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

constexpr int kNewtonPoints = 512;  // most points of Newton's method, of legs that lie flat; more are left to sweeps,
constexpr int kGroupPoints = 128;   // and more than so many of one part or of the hub, whose elimination costs their cube
constexpr int kFrictionRows = 3 * kNewtonPoints;

// A point near the floor at the start of a step.
struct Candidate {
  double gap;    // mm
  double lowest; // where it would be at the end of the step if it went on as it came, or is now [mm]
  int mount;     // -1: on the hub
  int point;     // of the mount's part, or of the hub
  bool working;  // has a row
};

// The same on a ground.
struct UnevenCandidate : Candidate {
  double place[3];   // in the world at the start of the step [mm]
  double way[3];     // by the last solve's motion [mm]
  double normal[3];  // of the plane that the row sees
  int row;
};

// A point the friction is solved for.
template <int M>
struct ContactRow {
  alignas(64) double response[3][M + 8];  // rows: normal, x, y; columns: modes of its part, hub (6, padded)
  PointOperator point;
  double free_velocity[3];                // with gap over time step in the normal one
  double impulse[3];
  double friction;                        // mu of this step
  int mount, contact;                     // which: its place in the state's impulses
  int point_number;                       // of the mount's part, or of the hub
  const double* flexibility;              // row of the part's contact_flexibility; null for none
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
  double next_velocity[6];  // after the step
};

// How contact points of a mounted part see it.
template <int M>
struct MountView {
  double transform[36];                  // hub unknowns (hub axes) to part unknowns (part axes)
  double world[9];                       // part frame to world
  double origin[3], turning[3];          // of the part's frame from the hub's, and the hub's turning rate before the step; part axes
  double free_velocity[6];               // of the part's frame, if nothing touched
  double next_speed, next_lever[3];      // after the step: upward speed of the part's origin, and up x W
  int pressed_count, pressed[kNewtonPoints];  // points of a flexible part that carried something in the last step
  alignas(64) double free_rates[M];
  alignas(64) double hub_response[M][8]; // D^-1 C^T
  alignas(64) double to_factor[6][8];    // part unknowns to the hub's factored ones
};

template <int M, class Real>
struct Workspace {
  HubSystem hub;
  double pressure[kMaximumRegulators];   // simulated
  MountMemory<M, Real>* mounts;          // of the robot that is stepped
  MountView<M> views[kMaximumMounts];
  RubberSystem<M, Real> rubber[kMaximumMounts];
  alignas(64) double rates[kMaximumMounts][M];  // after the step
  ContactAccumulator<M> sum;
  FrictionProblem friction;
  ContactRow<M> rows[1];                 // as many as the robot has contact points; behind them as many candidates

  Candidate* candidates(const RobotModel& robot) { return reinterpret_cast<Candidate*>(rows + robot.contact_count); }
  UnevenCandidate* uneven_candidates(const RobotModel& robot) {
    return reinterpret_cast<UnevenCandidate*>(rows + robot.contact_count);
  }
  // And behind those the friction's arrays, on a boundary of 64 bytes.
  void place_friction(const RobotModel& robot) {
    const auto behind = reinterpret_cast<unsigned long long>(uneven_candidates(robot) + robot.contact_count);
    friction.place(reinterpret_cast<char*>((behind + 63) / 64 * 64), kNewtonPoints);
  }
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
#if defined(_WIN32)
    timespec_get(&t, TIME_UTC);
#else
    clock_gettime(CLOCK_MONOTONIC, &t);
#endif
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
  }
  StageSeconds* stages;
  double last = 0;
};

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
