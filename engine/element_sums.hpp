// What the elements of one kind add to the forces and the tangent of a part at full order: equations (2), (36) and (37) of
// docs/physics.md in double precision. pneumorph/fem/element_group.py, element_stiffness.py, volume_group.py and
// maxwell_group.py are the same in NumPy.
#pragma once
#include <vector>

namespace pneumorph {

constexpr int kPack = 8;  // elements side by side

// P = (a) F + (b) cof F of laws of solids; P = F S of the sheet's and of the stress that relaxes.
enum class FullLaw { kYeoh, kStableNeoHookean, kStVenantKirchhoff };

// Elements of one kind, eight to a pack; the last pack is filled up with elements of no measure.
struct ElementPacks {
  int element_count = 0, corner_count = 0, dimension = 0, point_count = 0;
  int node_count = 0, data_count = 0;
  FullLaw law = FullLaw::kYeoh;
  double constants[4] = {};         // Yeoh: C1, C2, C3, K; stable neo-Hookean: mu, lambda; St. Venant-Kirchhoff: the same
  std::vector<int> nodes;           // (pack, corner, 8)
  std::vector<double> gradients;    // (pack, point, corner, dimension, 8)
  std::vector<double> measures;     // (pack, point, 8)
  std::vector<int> places;          // (element, corner a, corner b): where the block of rows a and columns b begins
  std::vector<int> strides;         // (node,): from a column of its block to the next
  // Mean dilatation: lambda / V of each element and the tensor T of its volume; empty without.
  std::vector<double> volumes;      // V, (pack, 8)
  double lame_lambda = 0.0;
  std::vector<int> pairs;           // n < m, (pair, 2)
  std::vector<double> tensor;       // T_nmk, (pair, corner)

  int pack_count() const { return (element_count + kPack - 1) / kPack; }
};

// Positions (node, 3); adds forces (node, 3) and, unless null, h^2 or any other factor times -d(force)/dx to `data`.
// The change (node, 3) that led to these positions, unless null: the tangent has the stress that it foresaw
// (pneumorph/fem/foreseen_stress.py).
// Stress that relaxes, unless null: S = base + 2 gain E, base (6: xx xy xz yy yz zz, point), element by element.
using AddElements = void (*)(const ElementPacks& packs, const double* positions, const double* change,
                             const double* relaxing_base, double relaxing_gain, double factor, double* forces, double* data);

void add_elements_baseline(const ElementPacks&, const double*, const double*, const double*, double, double, double*,
                           double*);
void add_elements_avx2(const ElementPacks&, const double*, const double*, const double*, double, double, double*,
                           double*);
void add_elements_avx512(const ElementPacks&, const double*, const double*, const double*, double, double, double*,
                           double*);

}  // namespace pneumorph
