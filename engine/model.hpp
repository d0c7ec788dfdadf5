// What the stepper reads: reduced parts, robots made of them, settings; and what it writes: states.
//
// Everything here is plain data behind raw pointers, so that the kernels, which are compiled once
// per instruction set, share no inline code of the standard library with the rest of the program.
// Units: mm, kg, s, mN, kPa.
#pragma once

namespace pneumorph {

constexpr int kLane = 16;             // elements treated side by side in the deformation stage
constexpr int kMaximumMounts = 16;    // legs of one robot
constexpr int kMaximumRegulators = 16;
constexpr int kMaximumModes = 40;
constexpr int kMaximumBranches = 8;
constexpr int kMaximumPressures = 32;
constexpr int kMaximumStretches = 32;
constexpr int kPressureLane = 8;      // pressures treated side by side
constexpr int kCubicModes = 4;        // modes in a block of their cubic terms
static_assert(kCubicModes % 2 == 0 && 8 % kCubicModes == 0, "two modes stand side by side, and parts have multiples of eight");

enum Status : unsigned char { kRunning = 0, kDiverged = 1, kSingular = 2 };

// Pairs of modes (b, c), b <= c, in rows of b; a vector's worth of zeros behind.
constexpr int pair_index(int b, int c, int modes) { return b * modes - b * (b - 1) / 2 + c - b; }
constexpr int pair_count(int modes) { return (modes * (modes + 1) / 2 + 15) / 8 * 8; }

// Elastic laws, numbered as `LAWS` of bindings.cpp names them.
enum Law : int { kCorotational = 0, kStVenantKirchhoff = 1, kStableNeoHookean = 2, kYeoh = 3 };

// Sampled elements of one family: D = 3 for tetrahedra, D = 2 for membrane triangles.
// The deformation gradient of an element, 3 x D in its own material frame, is affine in the modes.
template <class Real>
struct ElementFamily {
  int law = kCorotational;
  Real lambda_over_mu = 0;          // Lame coefficients, lambda of plane stress in membranes; one material a family
  int block_count = 0;              // elements padded to a multiple of kLane
  int last_count = 0;               // of the last block, without the padding
  const Real* rest = nullptr;       // (block, 3 D, lane)
  const Real* gradient_lanes = nullptr;  // (block, mode, 3 D, lane)
  // Columns of 64 bytes of modes while they last, then one of the 8 left: (block, column, lane, 3 D, mode of the column).
  const Real* gradient_modes = nullptr;
  const Real* lambda = nullptr;     // (block, lane) weight x measure x first Lame coefficient
  const Real* mu = nullptr;         // (block, lane) weight x measure x shear modulus
  // Elasticity is D = S^2 on normal strains, S = s (I + q 1 1^T), with s^2 = 2 mu. Tetrahedra need less (see
  // elements.hpp): row_scale^2 = mu and trace_scale^2 = lambda / mu. Membranes: row_scale = s, trace_scale = q.
  const Real* row_scale = nullptr;       // (element)
  const Real* inverse_scale = nullptr;   // (element) 1 / row_scale, 0 without stiffness
  const Real* trace_scale = nullptr;     // (element)
};

template <class Real>
struct Part {
  ElementFamily<Real> tetrahedra;   // D = 3
  ElementFamily<Real> membranes;    // D = 2
  const Real* constant_stiffness = nullptr;  // (mode, mode) sum over corotational tetrahedra of 2 mu G_a : G_b
  const double* linear_stiffness = nullptr;  // (mode, mode) of the mount
  int has_linear_stiffness = 0;
  // What parts of measured silicone have besides (rubber.hpp, mixed_energies.hpp).
  Real yeoh_c2 = 0, yeoh_c3 = 0;  // over C1
  int pressure_count = 0;         // changes of volume of whole elements
  double dilatation_lambda = 0;   // kPa
  const double* dilatation_1 = nullptr;  // (pressure, mode)
  const Real* dilatation_2 = nullptr;    // (pressure, mode, mode)
  const Real* dilatation_3 = nullptr;    // (block of pressures, block of modes a, pair b <= c, a, lane)
  int stretch_count = 0;                 // of a stiff sheet seen by fields of stress
  double stretch_modulus = 0;            // kPa
  const double* stretch_1 = nullptr;     // (stretch, mode)
  const Real* stretch_2 = nullptr;       // (stretch, mode, mode)
  // Walls that face each other across gaps (facing_walls.hpp).
  int wall_gap_count = 0;
  const double* wall_axis = nullptr;        // (gap, 3) from the middle of one side to that of the other
  const double* wall_axis_modes = nullptr;  // (gap, 3, mode)
  const int* wall_pair_first = nullptr;     // (gap + 1) first pair of each gap
  const double* wall_pair = nullptr;        // (pair, 3) from a point of one wall to one of the other
  const double* wall_pair_modes = nullptr;  // (pair, 3, mode)
  const double* wall_pair_stiffness = nullptr;  // (pair) mN/mm
  int branch_count = 0;                  // of the solid, with shear moduli over its own and times
  double branch_ratio[kMaximumBranches] = {0}, branch_time[kMaximumBranches] = {0};
  bool is_rubber() const {
    return tetrahedra.law == kYeoh || pressure_count > 0 || branch_count > 0 || stretch_count > 0 ||
           wall_gap_count > 0;
  }
  // Numbers that its springs take: (block, branch, 6, lane).
  long spring_numbers() const { return long(tetrahedra.block_count) * branch_count * 6 * kLane; }
  int cavity_count = 0;
  const double* volume_1 = nullptr;  // (cavity, mode)
  const double* volume_2 = nullptr;  // (cavity, mode, mode)
  const Real* volume_3 = nullptr;    // (cavity, pair, mode)
  double mass = 0;
  double first_moment[3] = {0, 0, 0};
  double second_moment[6] = {0};                // xx, xy, xz, yy, yz, zz
  const double* first_moment_modes = nullptr;   // (3, mode)
  const double* lever = nullptr;                // (axis, mode)  sum m (Y x Phi)
  const double* lever_modes = nullptr;          // (axis, mode b, mode)  sum m (Phi^b x Phi)
  const double* second_moment_modes = nullptr;  // (6, mode)  sum m (Y_i Phi_j + Y_j Phi_i)
  const double* second_moment_matrices = nullptr;  // (6, mode b, mode)  sum m (Phi_i^b Phi_j + Phi_j^b Phi_i)
  int contact_count = 0;
  const double* contact_points = nullptr;  // (point, 3)
  const double* contact_modes = nullptr;   // (point, 3, mode)
  const float* contact_point_lanes = nullptr;  // (block, 3, lane): to find the few points near the floor
  const float* contact_mode_lanes = nullptr;   // (block, mode, 3, lane)
  const double* contact_flexibility = nullptr;  // (point, point) mm/mN that points give way beyond the modes; null: not at all
  double contact_centre[3] = {0, 0, 0}, contact_half[3] = {0, 0, 0};  // of the box around them at rest
  const double* contact_reach = nullptr;       // (mode) how far it takes any of them
};

struct Mount {
  int part = 0;
  double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // part frame to hub frame
  double translation[3] = {0, 0, 0};
  const int* regulators = nullptr;                   // (cavity)
  int contact_offset = 0;                            // first impulse of this mount in the state
  long spring_offset = 0;                            // first number of its springs in the state
};

// Heights over the floor's base: bicubic between nodes, level beyond the edges; see ground.hpp.
struct Ground {
  double corner[2] = {0, 0};       // first node, x and y [mm]
  double spacing = 1;              // mm
  int count[2] = {0, 0};           // nodes along x and y
  const double* nodes = nullptr;   // (x, y, 4) H, d H_x, d H_y, d^2 H_xy, d the spacing [mm]
  double steepest = 0;             // no slope is above this
  int tile_cells = 1;              // along the side of a tile
  int tiles[2] = {0, 0};           // along x and y
  const double* ceilings = nullptr;  // (x, y) heights that the surface of a tile does not pass [mm]
};

struct RobotModel {
  double hub_mass = 0;
  double hub_first_moment[3] = {0, 0, 0};    // about the hub frame's origin
  double hub_second_moment[9] = {0};         // sum m r r^T about the origin
  int hub_contact_count = 0;
  const double* hub_contact_points = nullptr;  // (point, 3)
  double hub_contact_reach = 0;              // how far the farthest of them is from the origin [mm]
  int mount_count = 0;
  const Mount* mounts = nullptr;
  int contact_count = 0;                     // hub and legs together
  const double* friction = nullptr;          // (contact point, 2) mu, and the normal impulse of a step at which it is so [mN s]
  const Ground* ground = nullptr;            // null: the plane at the floor's height
  const double* pressure_rates = nullptr;    // (regulator, rising and falling, cell) kPa/s, where there are cells
};

struct Settings {
  double time_step = 0.01;           // s
  double gravity[3] = {0, 0, -9800}; // mm/s^2, world axes
  double mass_damping = 0.1;         // 1/s
  double stiffness_damping = 0.1;    // s
  int published_damping = 1;         // else objective: acts on modal rates alone
  int edge_rotations = 1;            // else polar
  int foreseen = 0;                  // silicone that branches alone damp is linearised where smooth motion leads
  double friction_exponent = 0;      // of the normal impulse of the step before; 0: mu stays as it is
  double friction_least = 1, friction_most = 1;  // factors that mu is kept between
  double floor_height = 0;           // mm, where contact points rest
  double contact_margin = 1;         // mm, points nearer than this take part in the contact solve
  double contact_tolerance = 1e-3;   // mm/s
  int contact_sweeps = 100;
  double pressure_rate = 150;        // kPa/s, where there are no cells
  int pressure_cells = 0;            // cells of pressure with rates of their own, see regulators.hpp; 0 for none
  double pressure_cell = 1;          // width of each, kPa
  double pressure_slope = 1;         // real to simulated pressure
  double pressure_intercept = 0;     // kPa
  double speed_limit = 1e4;          // mm/s, above it a robot counts as diverged
  double tangent_tolerance = 0;      // mm/s, how far a kept tangent's two predictions may part; 0: a fresh one in every step
  int regulator_count = 0;
  // Of a robot whose material is another than its parts' (conditions.hpp); forces are over its mass factor.
  double elasticity = 1;             // factor of the elements' forces
  double mount_elasticity = 1;       // of the mounts'
  double branch_factor = 1;          // of what relaxes, beside the elements'
};

struct RobotState {
  double position[3];          // hub origin in the world, mm
  double rotation[9];          // hub frame to world
  double velocity[3];          // of the hub origin, world axes, mm/s
  double angular_velocity[3];  // world axes, rad/s
  double regulated[kMaximumRegulators];  // real kPa
  double* modes;               // (mount, mode)
  double* mode_rates;          // (mount, mode)
  double* impulses;            // (contact point, 3) normal, x, y; mN s, also the warm start
  void* memory;                // (mount) MountMemory
  void* springs;               // (mount) what is left over of its springs, see rubber.hpp; in the elements' precision
  bool has_memory;             // of a step before, whose stiffness may be kept
  unsigned char status;
  int active_contacts;         // points the last step's friction was solved for
  int sweeps;                  // Gauss-Seidel sweeps and
  int newton_steps;            // Newton steps of the last step's friction
  double contact_residual;     // mm/s, of the last step
  // Since the counters were cleared:
  long long step_count, contact_total, sweep_total, newton_total;
  long long tangent_total;      // fresh tangents, of all mounts
  long long unconverged_total;  // steps whose friction ended above the tolerance
  double worst_penetration;     // mm
  double worst_residual;        // mm/s
  long long tangent_error_total;  // predictions of kept tangents that were wrong by more than the tolerance, of all mounts
  double worst_tangent_error;     // mm/s
};

constexpr int kStageCount = 6;
// element forces and tangents, inertia and cavity, factorisation, contact set-up, friction, integration
struct StageSeconds {
  double seconds[kStageCount];
};

// How a step's contacts were solved.
struct FrictionReport {
  int sweeps = 0, newton_steps = 0;
  double residual = 0;  // mm/s
};

// What is found of all mounted parts of measured silicone in a step before any is added (rubber.cpp), and then mounted part k,
// with `modes` padded modes; false if its system is not definite. One pair of each per instruction set. In the stepper's eyes
// seldom called, so that it inlines and fuses there what it does without the call.
#if defined(PNEUMORPH_KERNEL_NAME)
#define PNEUMORPH_SELDOM __attribute__((cold))
#else
#define PNEUMORPH_SELDOM
#endif
#define PNEUMORPH_DECLARE_RUBBER(begin, rubber)                                                                       \
  PNEUMORPH_SELDOM void begin(int modes, const Part<float>* parts, const RobotModel& robot, const Settings& settings, \
                              RobotState& state, void* work);                                                         \
  PNEUMORPH_SELDOM void begin(int modes, const Part<double>* parts, const RobotModel& robot,                          \
                              const Settings& settings, RobotState& state, void* work);                               \
  PNEUMORPH_SELDOM bool rubber(int modes, const Part<float>* parts, const RobotModel& robot, int k,                   \
                               const Settings& settings, RobotState& state, void* work, void* clock);                 \
  PNEUMORPH_SELDOM bool rubber(int modes, const Part<double>* parts, const RobotModel& robot, int k,                  \
                               const Settings& settings, RobotState& state, void* work, void* clock);
PNEUMORPH_DECLARE_RUBBER(begin_rubber_baseline, rubber_baseline)
PNEUMORPH_DECLARE_RUBBER(begin_rubber_avx2, rubber_avx2)
PNEUMORPH_DECLARE_RUBBER(begin_rubber_avx512, rubber_avx512)
#undef PNEUMORPH_DECLARE_RUBBER

// The contacts of a robot on a ground (uneven.cpp); the points solved for, or -1 if the motion is not sound. `deepest` is the
// worst penetration at the step's start [mm].
#define PNEUMORPH_DECLARE_UNEVEN(name)                                                                                  \
  PNEUMORPH_SELDOM int name(int modes, const Part<float>* parts, const RobotModel& robot, const Settings& settings,   \
                            const RobotState& state, void* work, void* clock, FrictionReport& report, double& deepest); \
  PNEUMORPH_SELDOM int name(int modes, const Part<double>* parts, const RobotModel& robot, const Settings& settings,  \
                            const RobotState& state, void* work, void* clock, FrictionReport& report, double& deepest);
PNEUMORPH_DECLARE_UNEVEN(uneven_baseline)
PNEUMORPH_DECLARE_UNEVEN(uneven_avx2)
PNEUMORPH_DECLARE_UNEVEN(uneven_avx512)
#undef PNEUMORPH_DECLARE_UNEVEN
#undef PNEUMORPH_SELDOM

// Bytes of scratch one thread needs, and the stepping of one robot; one pair per instruction set,
// mode count and precision.
using AdvanceFunction = void (*)(const void* parts, const RobotModel& robot, const Settings& settings,
                                 const double* command, long long steps, RobotState& state,
                                 void* workspace, StageSeconds* stages);

struct Kernel {
  AdvanceFunction advance = nullptr;
  unsigned long workspace_bytes = 0;
  unsigned long mount_bytes = 0;    // of one mount in RobotState::memory
};

// `modes` is the padded count: a multiple of eight up to kMaximumModes.
Kernel kernel_baseline(int modes, int single_precision, int contact_capacity);
Kernel kernel_avx2(int modes, int single_precision, int contact_capacity);
Kernel kernel_avx512(int modes, int single_precision, int contact_capacity);

}  // namespace pneumorph
