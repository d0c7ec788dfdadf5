// `ElementSums` and `CavitySums` of the Python module; pneumorph/fem/compiled_elements.py wraps it.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "element_sums.hpp"

namespace nb = nanobind;
using pneumorph::ElementPacks;
using pneumorph::FullLaw;
using pneumorph::kPack;
using Doubles = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using Integers = nb::ndarray<const int, nb::c_contig, nb::device::cpu>;
using Target = nb::ndarray<double, nb::c_contig, nb::device::cpu>;

static void require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument("element sums: " + what);
}

using NamedInstructions = std::vector<std::pair<std::string, pneumorph::AddElements>>;

// Instruction sets that this machine has, the best one first.
static const NamedInstructions& instruction_sets() {
  static const NamedInstructions found = [] {
    NamedInstructions sets;
#if defined(PNEUMORPH_X86)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512bw"))
      sets.emplace_back("avx512", pneumorph::add_elements_avx512);
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
      sets.emplace_back("avx2", pneumorph::add_elements_avx2);
#endif
    sets.emplace_back("baseline", pneumorph::add_elements_baseline);
    return sets;
  }();
  return found;
}

static FullLaw law_named(const std::string& name, size_t dimension) {
  if (name == "st_venant_kirchhoff") return FullLaw::kStVenantKirchhoff;
  require(dimension == 3, "law " + name + " is of solids only here");
  if (name == "yeoh") return FullLaw::kYeoh;
  require(name == "stable_neo_hookean", "no law " + name);
  return FullLaw::kStableNeoHookean;
}

// Where the 3 x 3 blocks of pairs of nodes lie in the data of a sparse matrix by columns.
struct NodeBlocks {
  NodeBlocks(Integers indptr, Integers indices)
      : data_count(indices.size()),
        starts(indptr.data(), indptr.data() + indptr.size()),
        rows(indices.data(), indices.data() + indices.size()) {
    require(starts.size() % 3 == 1, "indptr must have a column for each unknown");
    node_count = int(starts.size() / 3);
    for (size_t i = 0; i + 1 < starts.size(); ++i)
      require(0 <= starts[i] && starts[i] <= starts[i + 1] && size_t(starts[i + 1]) <= data_count, "indptr must ascend");
    for (int node = 0; node < node_count; ++node) {
      strides.push_back(starts[3 * node + 1] - starts[3 * node]);
      for (int j = 1; j < 3; ++j)
        require(starts[3 * node + j + 1] - starts[3 * node + j] == strides[node],
                "columns of a node must have the same rows");
    }
  }

  // Place of the first entry of the block of row node a and column node b.
  int find(int a, int b) const {
    const auto first = rows.begin() + starts[3 * b], last = rows.begin() + starts[3 * b + 1];
    for (int j = 0; j < 3; ++j) {
      const auto begin = first + j * strides[b], found = std::lower_bound(begin, last + j * strides[b], 3 * a);
      const auto left = last + j * strides[b] - found;
      require(left >= 3 && found[0] == 3 * a && found[1] == 3 * a + 1 && found[2] == 3 * a + 2 &&
                  found - begin == std::lower_bound(first, last, 3 * a) - first,
              "the pattern lacks a block of an element");
    }
    return int(std::lower_bound(first, last, 3 * a) - rows.begin());
  }

  size_t data_count = 0;
  int node_count = 0;
  std::vector<int> starts, rows, strides;  // strides: (node,) from a column of a node's blocks to the next
};

class PythonElementSums {
 public:
  PythonElementSums(const std::string& law, Doubles constants, Integers connectivity, Doubles gradients, Doubles measures,
                    Integers indptr, Integers indices) {
    require(connectivity.ndim() == 2 && gradients.ndim() == 4 && measures.ndim() == 2, "wrong number of axes");
    const size_t elements = connectivity.shape(0), corners = connectivity.shape(1);
    const size_t points = measures.shape(1), dimension = gradients.shape(3);
    require(gradients.shape(0) == elements && gradients.shape(1) == points && gradients.shape(2) == corners &&
                measures.shape(0) == elements,
            "connectivity (e, k), gradients (e, p, k, d) and measures (e, p) must agree");
    require((dimension == 3 && (corners == 4 || corners == 10)) || (dimension == 2 && (corners == 3 || corners == 6)),
            "expected tetrahedra of 4 or 10 nodes or triangles of 3 or 6");
    require(constants.size() == 4, "expected four constants");
    packs_.law = law_named(law, dimension);
    std::copy_n(constants.data(), 4, packs_.constants);
    packs_.element_count = int(elements), packs_.corner_count = int(corners), packs_.dimension = int(dimension);
    const NodeBlocks blocks(indptr, indices);
    packs_.point_count = int(points), packs_.data_count = int(indices.size()), packs_.node_count = blocks.node_count;
    for (size_t i = 0; i < connectivity.size(); ++i)
      require(connectivity.data()[i] >= 0 && connectivity.data()[i] < packs_.node_count, "a node does not exist");
    pack(connectivity, gradients, measures);
    find_places(connectivity, blocks);
  }

  void set_volumes(double lame_lambda, Doubles volumes, Integers pairs, Doubles tensor) {
    const size_t corners = size_t(packs_.corner_count);
    require(packs_.dimension == 3, "sheets have no volume");
    require(volumes.size() == size_t(packs_.element_count), "one volume for each element");
    require(pairs.ndim() == 2 && pairs.shape(1) == 2 && pairs.shape(0) <= corners * (corners - 1) / 2 &&
                tensor.size() == pairs.shape(0) * corners,
            "pairs (pair, 2) and tensor (pair, k) must agree");
    for (size_t p = 0; p < pairs.shape(0); ++p)
      require(0 <= pairs.data()[2 * p] && pairs.data()[2 * p] < pairs.data()[2 * p + 1] &&
                  pairs.data()[2 * p + 1] < packs_.corner_count,
              "pairs must ascend");
    packs_.lame_lambda = lame_lambda;
    packs_.volumes.assign(size_t(packs_.pack_count()) * kPack, 1.0);
    // What fills up the last pack is a copy of its first element, whose sums are not taken.
    for (size_t e = 0; e < packs_.volumes.size(); ++e)
      packs_.volumes[e] = volumes.data()[std::min(e, volumes.size() - 1)];
    packs_.pairs.assign(pairs.data(), pairs.data() + pairs.size());
    packs_.tensor.assign(tensor.data(), tensor.data() + tensor.size());
  }

  void use(const std::string& name) {
    for (const auto& [known, function] : instruction_sets())
      if (known == name) {
        add_elements_ = function;
        return;
      }
    require(false, "no instruction set " + name + " on this machine");
  }

  void add(Doubles positions, std::optional<Doubles> change, std::optional<Doubles> relaxing_base,
           double relaxing_gain, Target forces, std::optional<Target> data, double factor) const {
    const size_t nodes = size_t(packs_.node_count);
    require(positions.size() == 3 * nodes && forces.size() == 3 * nodes, "positions and forces must be (node, 3)");
    require(!change || change->size() == 3 * nodes, "change must be (node, 3)");
    require(!data || data->size() == size_t(packs_.data_count), "data must be those of the assembly");
    const size_t points = size_t(packs_.element_count) * size_t(packs_.point_count);
    require(!relaxing_base || (relaxing_base->size() == 6 * points && packs_.dimension == 3),
            "relaxing_base must be (6, point), of a solid");
    nb::gil_scoped_release release;
    add_elements_(packs_, positions.data(), change ? change->data() : nullptr,
                  relaxing_base ? relaxing_base->data() : nullptr, relaxing_gain, factor,
                  forces.data(), data ? data->data() : nullptr);
  }

 private:
  void pack(const Integers& connectivity, const Doubles& gradients, const Doubles& measures) {
    const long k = packs_.corner_count, d = packs_.dimension, points = packs_.point_count, count = packs_.pack_count();
    packs_.nodes.resize(count * k * kPack);
    packs_.gradients.resize(count * points * k * d * kPack);
    packs_.measures.resize(count * points * kPack);
    for (long slot = 0; slot < count * kPack; ++slot) {
      const long pack = slot / kPack, lane = slot % kPack, element = std::min(slot, long(packs_.element_count) - 1);
      for (long n = 0; n < k; ++n) packs_.nodes[(pack * k + n) * kPack + lane] = connectivity.data()[element * k + n];
      for (long p = 0; p < points; ++p) {
        packs_.measures[(pack * points + p) * kPack + lane] = measures.data()[element * points + p];
        for (long c = 0; c < k * d; ++c)
          packs_.gradients[((pack * points + p) * k * d + c) * kPack + lane] =
              gradients.data()[(element * points + p) * k * d + c];
      }
    }
  }

  void find_places(const Integers& connectivity, const NodeBlocks& blocks) {
    const int k = packs_.corner_count;
    packs_.strides = blocks.strides;
    packs_.places.resize(size_t(packs_.element_count) * k * k);
    for (long e = 0; e < packs_.element_count; ++e)
      for (int a = 0; a < k; ++a)
        for (int b = 0; b < k; ++b)
          packs_.places[(e * k + a) * k + b] = blocks.find(connectivity.data()[e * k + a], connectivity.data()[e * k + b]);
  }

  ElementPacks packs_;
  pneumorph::AddElements add_elements_ = instruction_sets().front().second;
};

// Load of a cavity of the volume sum w x_0 . (x_1 x x_2): equation (7) of docs/physics.md.
class PythonCavitySums {
 public:
  PythonCavitySums(Integers terms, Doubles weights, Integers indptr, Integers indices)
      : terms_(terms.data(), terms.data() + terms.size()),
        weights_(weights.data(), weights.data() + weights.size()),
        blocks_(indptr, indices) {
    require(terms.size() == 3 * weights.size(), "three nodes for each weight");
    for (int node : terms_) require(node >= 0 && node < blocks_.node_count, "a node does not exist");
    for (size_t t = 0; t < weights_.size(); ++t)
      for (int c = 0; c < 3; ++c) {
        const int a = terms_[3 * t + c], b = terms_[3 * t + (c + 1) % 3];
        places_.push_back(blocks_.find(a, b));
        places_.push_back(blocks_.find(b, a));
      }
  }

  void add(Doubles positions, double pressure, Target forces, std::optional<Target> data, double factor) const {
    const size_t count = 3 * size_t(blocks_.node_count);
    require(positions.size() == count && forces.size() == count, "positions and forces must be (node, 3)");
    require(!data || data->size() == blocks_.data_count, "data must be those of the assembly");
    nb::gil_scoped_release release;
    const double* x = positions.data();
    double* f = forces.data();
    for (size_t t = 0; t < weights_.size(); ++t)
      for (int c = 0; c < 3; ++c) {
        const int a = terms_[3 * t + c], b = terms_[3 * t + (c + 1) % 3];
        const double *second = x + 3 * b, *third = x + 3 * terms_[3 * t + (c + 2) % 3];
        const double scale = pressure * weights_[t];
        for (int k = 0; k < 3; ++k) {
          const int i = (k + 1) % 3, j = (k + 2) % 3;
          f[3 * a + k] += scale * (second[i] * third[j] - second[j] * third[i]);
          if (!data) continue;
          // -p d2V / dx_a dx_b = p w [x_c], whose entry (i, j) is minus, (j, i) plus the component k.
          const double value = factor * scale * third[k];
          double *forward = data->data() + places_[6 * t + 2 * c], *back = data->data() + places_[6 * t + 2 * c + 1];
          const long to_b = blocks_.strides[b], to_a = blocks_.strides[a];
          forward[i + j * to_b] -= value, forward[j + i * to_b] += value;
          back[j + i * to_a] -= value, back[i + j * to_a] += value;
        }
      }
  }

 private:
  std::vector<int> terms_;
  std::vector<double> weights_;
  NodeBlocks blocks_;
  std::vector<int> places_;
};

void bind_element_sums(nb::module_& module) {
  nb::list names;
  for (const auto& [name, function] : instruction_sets()) names.append(name);
  module.attr("ELEMENT_INSTRUCTION_SETS") = nb::tuple(names);
  nb::class_<PythonCavitySums>(module, "CavitySums")
      .def(nb::init<Integers, Doubles, Integers, Integers>(), nb::arg("terms"), nb::arg("weights"), nb::arg("indptr"),
           nb::arg("indices"))
      .def("add", &PythonCavitySums::add, nb::arg("positions"), nb::arg("pressure"), nb::arg("forces").noconvert(),
           nb::arg("data").noconvert().none(), nb::arg("factor"));
  nb::class_<PythonElementSums>(module, "ElementSums")
      .def(nb::init<const std::string&, Doubles, Integers, Doubles, Doubles, Integers, Integers>(), nb::arg("law"),
           nb::arg("constants"), nb::arg("connectivity"), nb::arg("gradients"), nb::arg("measures"), nb::arg("indptr"),
           nb::arg("indices"))
      .def("use", &PythonElementSums::use, nb::arg("instruction_set"))
      .def("set_volumes", &PythonElementSums::set_volumes, nb::arg("lame_lambda"), nb::arg("volumes"), nb::arg("pairs"),
           nb::arg("tensor"))
      .def("add", &PythonElementSums::add, nb::arg("positions"), nb::arg("change").none(),
           nb::arg("relaxing_base").none(), nb::arg("relaxing_gain"), nb::arg("forces").noconvert(),
           nb::arg("data").noconvert().none(), nb::arg("factor"));
}
