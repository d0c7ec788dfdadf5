// The Python module `pneumorph._engine`.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>

#include "batch.hpp"
#include "numpy_arrays.hpp"

using Array = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using Mask = nb::ndarray<const bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// Reads named arrays of one part, checking every shape; keeps them alive while the batch copies them.
class PartReader {
 public:
  explicit PartReader(nb::dict arrays) : arrays_(arrays) {}

  const double* read(const char* name, std::vector<size_t> shape) {
    Array array = nb::cast<Array>(arrays_[name]);
    bool same = array.ndim() == shape.size();
    std::string expected, got;
    for (size_t size : shape) expected += (expected.empty() ? "" : ", ") + std::to_string(size);
    for (size_t i = 0; i < array.ndim(); ++i) {
      got += (i ? ", " : "") + std::to_string(array.shape(i));
      same = same && array.shape(i) == shape[i];
    }
    if (!same)
      throw std::invalid_argument(std::string("part array ") + name + " has shape (" + got + "), expected (" +
                                  expected + ")");
    kept_.push_back(array);
    return array.data();
  }
  size_t length(const char* name) { return nb::cast<Array>(arrays_[name]).shape(0); }
  double number(const char* name) { return nb::cast<double>(arrays_[name]); }

 private:
  nb::dict arrays_;
  std::vector<Array> kept_;
};

static pneumorph::PartInput read_part(PartReader& reader, size_t m) {
  pneumorph::PartInput part;
  const size_t e = reader.length("tetrahedron_lambda"), t = reader.length("membrane_lambda");
  const size_t c = reader.length("cavity_volume_1"), p = reader.length("contact_points");
  part.modes = int(m), part.tetrahedra = int(e), part.membranes = int(t);
  part.cavities = int(c), part.contacts = int(p);
  part.tetrahedron_law = int(reader.number("tetrahedron_law"));
  part.membrane_law = int(reader.number("membrane_law"));
  part.tetrahedron_rest = reader.read("tetrahedron_rest", {e, 3, 3});
  part.tetrahedron_gradient = reader.read("tetrahedron_mode_gradient", {e, 3, 3, m});
  part.tetrahedron_lambda = reader.read("tetrahedron_lambda", {e});
  part.tetrahedron_mu = reader.read("tetrahedron_mu", {e});
  part.membrane_rest = reader.read("membrane_rest", {t, 3, 2});
  part.membrane_gradient = reader.read("membrane_mode_gradient", {t, 3, 2, m});
  part.membrane_lambda = reader.read("membrane_lambda", {t});
  part.membrane_mu = reader.read("membrane_mu", {t});
  part.yeoh_c2 = reader.number("yeoh_c2_over_c1"), part.yeoh_c3 = reader.number("yeoh_c3_over_c1");
  const size_t k = reader.length("dilatation_1"), s = reader.length("stretch_1"), b = reader.length("branch_ratio");
  part.pressures = int(k), part.stretches = int(s), part.branches = int(b);
  part.dilatation_lambda = reader.number("dilatation_lambda");
  part.dilatation_1 = reader.read("dilatation_1", {k, m});
  part.dilatation_2 = reader.read("dilatation_2", {k, m, m});
  part.dilatation_3 = reader.read("dilatation_3", {k, m, m, m});
  part.stretch_modulus = reader.number("stretch_modulus");
  part.stretch_1 = reader.read("stretch_1", {s, m});
  part.stretch_2 = reader.read("stretch_2", {s, m, m});
  const size_t g = reader.length("wall_axis"), w = reader.length("wall_pair");
  part.wall_gaps = int(g), part.wall_pairs = int(w);
  part.wall_axis = reader.read("wall_axis", {g, 3});
  part.wall_axis_modes = reader.read("wall_axis_modes", {g, 3, m});
  part.wall_pair_gap = reader.read("wall_pair_gap", {w});
  part.wall_pair = reader.read("wall_pair", {w, 3});
  part.wall_pair_modes = reader.read("wall_pair_modes", {w, 3, m});
  part.wall_pair_stiffness = reader.read("wall_pair_stiffness", {w});
  part.branch_ratio = reader.read("branch_ratio", {b});
  part.branch_time = reader.read("branch_time", {b});
  part.linear_stiffness = reader.read("linear_stiffness", {m, m});
  part.volume_1 = reader.read("cavity_volume_1", {c, m});
  part.volume_2 = reader.read("cavity_volume_2", {c, m, m});
  part.volume_3 = reader.read("cavity_volume_3", {c, m, m, m});
  part.mass = reader.number("mass");
  part.first_moment = reader.read("first_moment", {3});
  part.first_moment_modes = reader.read("first_moment_modes", {3, m});
  part.second_moment = reader.read("second_moment", {3, 3});
  part.second_moment_modes = reader.read("second_moment_modes", {3, 3, m});
  part.second_moment_mode_pairs = reader.read("second_moment_mode_pairs", {3, 3, m, m});
  part.contact_points = reader.read("contact_points", {p, 3});
  part.contact_modes = reader.read("contact_modes", {p, 3, m});
  if (reader.length("contact_flexibility") > 0) part.contact_flexibility = reader.read("contact_flexibility", {p, p});
  if (reader.length("snapshot_range") > 0) part.snapshot_range = reader.read("snapshot_range", {m, m});
  return part;
}

static pneumorph::Settings read_settings(nb::dict d) {
  pneumorph::Settings s;
  auto number = [&](const char* name) { return nb::cast<double>(d[name]); };
  s.time_step = number("time_step");
  auto gravity = nb::cast<Vector>(d["gravity"]);
  for (int i = 0; i < 3; ++i) s.gravity[i] = gravity.data()[i];
  s.mass_damping = number("mass_damping"), s.stiffness_damping = number("stiffness_damping");
  s.published_damping = nb::cast<bool>(d["published_damping"]), s.edge_rotations = nb::cast<bool>(d["edge_rotations"]);
  s.friction_exponent = number("friction_exponent"), s.friction_least = number("friction_least");
  s.friction_most = number("friction_most"), s.floor_height = number("floor_height");
  s.contact_margin = number("contact_margin"), s.contact_tolerance = number("contact_tolerance");
  s.contact_sweeps = nb::cast<int>(d["contact_sweeps"]);
  s.pressure_rate = number("pressure_rate"), s.pressure_cell = number("pressure_cell");
  s.pressure_cells = nb::cast<int>(d["pressure_cells"]), s.pressure_slope = number("pressure_slope");
  s.pressure_intercept = number("pressure_intercept"), s.speed_limit = number("speed_limit");
  s.tangent_tolerance = number("tangent_tolerance"), s.foreseen = nb::cast<bool>(d["foreseen"]);
  s.regulator_count = nb::cast<int>(d["regulator_count"]);
  return s;
}

static pneumorph::Conditions read_conditions(const Vector& values) {
  if (values.shape(0) != size_t(pneumorph::Conditions::kCount))
    throw std::invalid_argument("conditions have " + std::to_string(values.shape(0)) + " numbers, expected " +
                                std::to_string(pneumorph::Conditions::kCount));
  const double* from = values.data();
  pneumorph::Conditions own;
  for (int i = 0; i < 3; ++i) own.gravity[i] = from[i];
  own.stiffness_damping = from[3];
  own.modulus_factor = from[4], own.mass_factor = from[5], own.damping_factor = from[6];
  own.floor_height = from[7];
  return own;
}

// (corner (2,), spacing, nodes (x, y, 4), steepest slope, cells along a tile, ceilings (x tile, y tile)).
static pneumorph::GroundInput read_ground(nb::handle item) {
  auto [corner, spacing, nodes, steepest, tile_cells, ceilings] =
      nb::cast<std::tuple<Vector, double, Array, double, int, Matrix>>(item);
  pneumorph::GroundInput in;
  if (corner.shape(0) != 2 || nodes.ndim() != 3 || nodes.shape(2) != 4 || tile_cells < 1)
    throw std::invalid_argument("a ground has a corner (2,) and nodes (x, y, 4)");
  for (size_t i = 0; i < 2; ++i) {
    in.corner[i] = corner.data()[i], in.count[i] = int(nodes.shape(i)), in.tiles[i] = int(ceilings.shape(i));
    if (in.count[i] < 2 || in.tiles[i] != (in.count[i] - 2) / tile_cells + 1)
      throw std::invalid_argument("a ground of " + std::to_string(in.count[i]) + " nodes has " + std::to_string(in.tiles[i]) +
                                  " tiles of " + std::to_string(tile_cells) + " cells along an axis");
  }
  in.spacing = spacing, in.steepest = steepest, in.tile_cells = tile_cells;
  in.nodes.assign(nodes.data(), nodes.data() + nodes.size());
  in.ceilings.assign(ceilings.data(), ceilings.data() + ceilings.size());
  return in;
}

class PythonBatch {
 public:
  PythonBatch(nb::list parts, nb::dict settings, bool single_precision, std::string instruction_set)
      : batch_(make(parts, settings, single_precision, instruction_set)) {}

  // hubs: list of (mass, first_moment (3,), second_moment (3,3), contact_points (p,3)).
  // robots: list of (hub index, [(part, rotation (3,3), translation (3,), [regulators])],
  // rates of pressure (regulator x rising and falling x cell,), friction (contact point, 2), conditions (8,): gravity,
  // stiffness damping, factors of modulus, mass and what relaxes, floor height; ground index, -1 for a plane).
  void set_robots(nb::list hubs, nb::list robots, nb::list grounds) {
    std::vector<pneumorph::HubInput> hub_inputs;
    for (nb::handle item : hubs) {
      auto [mass, first, second, points] = nb::cast<std::tuple<double, Vector, Matrix, Matrix>>(item);
      pneumorph::HubInput hub;
      hub.mass = mass;
      for (int i = 0; i < 3; ++i) hub.first_moment[i] = first.data()[i];
      for (int i = 0; i < 9; ++i) hub.second_moment[i] = second.data()[i];
      hub.contact_points.assign(points.data(), points.data() + points.size());
      hub_inputs.push_back(hub);
    }
    std::vector<int> hub_of_robot;
    std::vector<std::vector<pneumorph::MountInput>> mounts;
    std::vector<std::vector<double>> pressure_rates, frictions;
    std::vector<pneumorph::Conditions> conditions;
    std::vector<pneumorph::GroundInput> ground_inputs;
    std::vector<int> ground_of_robot;
    for (nb::handle item : grounds) ground_inputs.push_back(read_ground(item));
    for (nb::handle item : robots) {
      auto [hub, list, rates, friction, own, ground] =
          nb::cast<std::tuple<int, nb::list, Vector, Matrix, Vector, int>>(item);
      ground_of_robot.push_back(ground);
      conditions.push_back(read_conditions(own));
      hub_of_robot.push_back(hub);
      pressure_rates.emplace_back(rates.data(), rates.data() + rates.shape(0));
      frictions.emplace_back(friction.data(), friction.data() + friction.size());
      std::vector<pneumorph::MountInput> of_robot;
      for (nb::handle entry : list) {
        auto [part, rotation, translation, regulators] =
            nb::cast<std::tuple<int, Matrix, Vector, std::vector<int>>>(entry);
        pneumorph::MountInput mount;
        mount.part = part;
        for (int i = 0; i < 9; ++i) mount.rotation[i] = rotation.data()[i];
        for (int i = 0; i < 3; ++i) mount.translation[i] = translation.data()[i];
        mount.regulators = regulators;
        of_robot.push_back(mount);
      }
      mounts.push_back(of_robot);
    }
    batch_.set_robots(hub_inputs, hub_of_robot, mounts, pressure_rates, frictions, conditions, std::move(ground_inputs),
                      ground_of_robot);
  }

  void advance(Matrix command, long long steps, Mask active, int threads, bool profile) {
    const size_t robots = batch_.robot_count(), regulators = batch_.settings().regulator_count;
    if (command.shape(0) != robots || command.shape(1) != regulators || active.shape(0) != robots)
      throw std::invalid_argument("command must be (robot, regulator) and active (robot,)");
    nb::gil_scoped_release release;
    batch_.advance(command.data(), steps, reinterpret_cast<const unsigned char*>(active.data()), threads, profile);
  }

  // One quantity of every robot; modal ones are padded with zeros to the most mounts and modes.
  NewArray read(std::string name) {
    const size_t robots = batch_.robot_count();
    std::vector<double> values;
    auto gather = [&](size_t width, auto&& value) {
      values.reserve(robots * width);
      for (size_t r = 0; r < robots; ++r)
        for (size_t i = 0; i < width; ++i) values.push_back(value(batch_.state(int(r)), i));
    };
    using State = pneumorph::RobotState;
    if (name == "position") return gather(3, [](State& s, size_t i) { return s.position[i]; }), to_numpy(values, {robots, 3});
    if (name == "rotation") return gather(9, [](State& s, size_t i) { return s.rotation[i]; }), to_numpy(values, {robots, 3, 3});
    if (name == "velocity") return gather(3, [](State& s, size_t i) { return s.velocity[i]; }), to_numpy(values, {robots, 3});
    if (name == "angular_velocity") return gather(3, [](State& s, size_t i) { return s.angular_velocity[i]; }), to_numpy(values, {robots, 3});
    if (name == "regulated") {
      const size_t n = batch_.settings().regulator_count;
      return gather(n, [](State& s, size_t i) { return s.regulated[i]; }), to_numpy(values, {robots, n});
    }
    struct { const char* name; double (*of)(const State&); } const scalars[] = {
        {"status", [](const State& s) { return double(s.status); }},
        {"active_contacts", [](const State& s) { return double(s.active_contacts); }},
        {"sweeps", [](const State& s) { return double(s.sweeps); }},
        {"contact_residual", [](const State& s) { return double(s.contact_residual); }},
        {"step_count", [](const State& s) { return double(s.step_count); }},
        {"contact_total", [](const State& s) { return double(s.contact_total); }},
        {"sweep_total", [](const State& s) { return double(s.sweep_total); }},
        {"worst_penetration", [](const State& s) { return double(s.worst_penetration); }},
        {"unconverged_total", [](const State& s) { return double(s.unconverged_total); }},
        {"worst_residual", [](const State& s) { return double(s.worst_residual); }},
        {"newton_steps", [](const State& s) { return double(s.newton_steps); }},
        {"newton_total", [](const State& s) { return double(s.newton_total); }},
        {"tangent_total", [](const State& s) { return double(s.tangent_total); }},
        {"tangent_error_total", [](const State& s) { return double(s.tangent_error_total); }},
        {"worst_tangent_error", [](const State& s) { return double(s.worst_tangent_error); }},
    };
    for (const auto& scalar : scalars)
      if (name == scalar.name)
        return gather(1, [&](State& s, size_t) { return scalar.of(s); }), to_numpy(values, {robots});
    if (name == "range_ratio") {
      for (size_t r = 0; r < robots; ++r) values.push_back(batch_.range_ratio(int(r)));
      return to_numpy(values, {robots});
    }
    if (name == "modes" || name == "mode_rates" || name == "impulses") {
      const bool impulses = name == "impulses";
      size_t rows = 0, width = impulses ? 3 : batch_.padded_modes();
      for (size_t r = 0; r < robots; ++r)
        rows = std::max(rows, size_t(impulses ? batch_.robot(int(r)).contact_count : batch_.robot(int(r)).mount_count));
      for (size_t r = 0; r < robots; ++r) {
        const auto& model = batch_.robot(int(r));
        auto& s = batch_.state(int(r));
        const double* data = impulses ? s.impulses : (name == "modes" ? s.modes : s.mode_rates);
        const size_t own = (impulses ? model.contact_count : model.mount_count) * width;
        const double unit = impulses ? batch_.mass_factor(int(r)) : 1.0;
        for (size_t i = 0; i < rows * width; ++i) values.push_back(i < own ? unit * data[i] : 0.0);
      }
      return to_numpy(values, {robots, rows, width});
    }
    if (name == "springs") {
      size_t mounts = 0;
      for (size_t r = 0; r < robots; ++r) mounts = std::max(mounts, size_t(batch_.robot(int(r)).mount_count));
      const size_t branches = batch_.spring_branches(), points = batch_.spring_points();
      values.assign(robots * mounts * branches * points * 6, 0.0);
      for (size_t r = 0; r < robots; ++r) batch_.read_springs(int(r), values.data() + r * mounts * branches * points * 6);
      return to_numpy(values, {robots, mounts, branches, points, 6});
    }
    throw std::invalid_argument("unknown quantity '" + name + "'");
  }

  // Overwrites one quantity of one robot: position, rotation, velocity, angular_velocity, regulated,
  // modes, mode_rates, impulses or, after the modes, springs, with the robot's own number of entries.
  void write(int robot, std::string name, Vector values) {
    auto& s = batch_.state(checked(robot));
    const auto& model = batch_.robot(robot);
    const size_t modal = size_t(model.mount_count) * batch_.padded_modes();
    struct { const char* name; double* data; size_t count; } const fields[] = {
        {"position", s.position, 3}, {"rotation", s.rotation, 9}, {"velocity", s.velocity, 3},
        {"angular_velocity", s.angular_velocity, 3}, {"modes", s.modes, modal}, {"mode_rates", s.mode_rates, modal},
        {"regulated", s.regulated, size_t(batch_.settings().regulator_count)},
        {"impulses", s.impulses, 3 * size_t(model.contact_count)}};
    for (const auto& field : fields)
      if (name == field.name) {
        if (values.shape(0) != field.count)
          throw std::invalid_argument(name + " has " + std::to_string(values.shape(0)) + " numbers, expected " +
                                      std::to_string(field.count));
        const double unit = name == "impulses" ? batch_.mass_factor(robot) : 1.0;
        for (size_t i = 0; i < field.count; ++i) field.data[i] = values.data()[i] / unit;
        s.has_memory = false;
        return;
      }
    if (name == "springs") {
      const size_t count = size_t(model.mount_count) * batch_.spring_branches() * batch_.spring_points() * 6;
      if (values.shape(0) != count)
        throw std::invalid_argument("springs has " + std::to_string(values.shape(0)) + " numbers, expected " +
                                    std::to_string(count));
      batch_.write_springs(robot, values.data());
      s.has_memory = false;
      return;
    }
    throw std::invalid_argument("unknown quantity '" + name + "'");
  }

  void reset(int robot) { batch_.reset(checked(robot)); }
  void forget_range(int robot) { batch_.forget_range(checked(robot)); }
  nb::bytes memory(int robot) const {
    const std::string kept = batch_.memory(checked(robot));
    return nb::bytes(kept.data(), kept.size());
  }
  void set_memory(int robot, nb::bytes memory) {
    batch_.set_memory(checked(robot), std::string(static_cast<const char*>(memory.data()), memory.size()));
  }
  std::vector<double> stages() const {
    return {batch_.stages().seconds, batch_.stages().seconds + pneumorph::kStageCount};
  }
  void clear_counters() { batch_.clear_counters(); }
  std::string instruction_set() const { return batch_.instruction_set(); }

 private:
  static pneumorph::Batch make(nb::list parts, nb::dict settings, bool single_precision, const std::string& set) {
    std::vector<PartReader> readers;
    std::vector<pneumorph::PartInput> inputs;
    readers.reserve(nb::len(parts));
    for (nb::handle item : parts) {
      readers.emplace_back(nb::cast<nb::dict>(item));
      const size_t modes = nb::cast<Array>(nb::cast<nb::dict>(item)["linear_stiffness"]).shape(0);
      inputs.push_back(read_part(readers.back(), modes));
    }
    return pneumorph::Batch(inputs, read_settings(settings), single_precision, set);
  }
  int checked(int robot) const {
    if (robot < 0 || robot >= batch_.robot_count())
      throw std::invalid_argument("robot " + std::to_string(robot) + " of " + std::to_string(batch_.robot_count()));
    return robot;
  }
  pneumorph::Batch batch_;
};

void bind_element_sums(nb::module_& module);
void bind_friction(nb::module_& module);
void bind_frontal_cholesky(nb::module_& module);

NB_MODULE(_engine, module) {
  module.doc() = "Batched reduced-order stepper; contact solver and sparse factors of full robots.";
  bind_element_sums(module);
  bind_frontal_cholesky(module);
  bind_friction(module);
  module.attr("LAWS") = nb::make_tuple("corotational", "st_venant_kirchhoff", "stable_neo_hookean", "yeoh");  // enum Law
  nb::class_<PythonBatch>(module, "Batch")
      .def(nb::init<nb::list, nb::dict, bool, std::string>(), nb::arg("parts"), nb::arg("settings"),
           nb::arg("single_precision"), nb::arg("instruction_set"))
      .def("set_robots", &PythonBatch::set_robots, nb::arg("hubs"), nb::arg("robots"), nb::arg("grounds"))
      .def("advance", &PythonBatch::advance, nb::arg("command"), nb::arg("steps"), nb::arg("active"),
           nb::arg("threads"), nb::arg("profile"))
      .def("read", &PythonBatch::read, nb::arg("name"))
      .def("write", &PythonBatch::write, nb::arg("robot"), nb::arg("name"), nb::arg("values"))
      .def("reset", &PythonBatch::reset, nb::arg("robot"))
      .def("forget_range", &PythonBatch::forget_range, nb::arg("robot"))
      .def("memory", &PythonBatch::memory, nb::arg("robot"))
      .def("set_memory", &PythonBatch::set_memory, nb::arg("robot"), nb::arg("memory"))
      .def("stages", &PythonBatch::stages)
      .def("clear_counters", &PythonBatch::clear_counters)
      .def_prop_ro("instruction_set", &PythonBatch::instruction_set);
}
