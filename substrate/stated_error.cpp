#include "substrate/stated_error.h"

#include <algorithm>
#include <cmath>

namespace mbtfm::substrate {

double stated_error(const SubstrateParameters& parameters, const Figures& figures) {
  const auto find = [&](const char* name) {
    return std::find_if(figures.begin(), figures.end(), [&](const auto& figure) { return figure.first == name; });
  };
  const auto model = find("substrate_model");
  if (model == figures.end()) return 0;
  const auto kind = named<ModelKind>(std::get<std::string>(model->second));
  if (kind == ModelKind::split) return kSplitErrorOfTwoCells * std::pow(2.0 / parameters.cells_per_thickness, 3);
  if (kind != ModelKind::refined) return 0;  // closed forms
  const auto estimated = find("substrate_estimated_error");
  if (estimated != figures.end()) return std::get<double>(estimated->second);
  // docs/accuracy.md: 2.3 % with 1.4 elements across, 1.3 % with 2; that is, falling as their number to the power 1.6
  return 0.023 * std::pow(1.4 / parameters.elements_across_adhesion, 1.6);
}

}  // namespace mbtfm::substrate
