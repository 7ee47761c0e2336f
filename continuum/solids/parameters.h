/// What a user asks of mbtfm-indent.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "continuum/solids/indent.h"
#include "pipeline/contract/gel.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::solids {

struct Parameters {
  Gel gel;
  double radius_um = 100;  ///< of the gel: twice and more what the optimum depends on
  std::optional<double> volume_um3;
  double height_um = 0;
  double youngs_modulus_kPa = 10;
  double poisson_ratio = 0.49;
  double contraction_kPa = 30;
  Strain strain = Strain::small;
  std::string depths_um = "0, 5";
  std::string sweep = {};
  std::optional<int> order, towards_rim;
};

void declare(stage::ParameterList& list, Parameters& parameters);

/// @param fineness  of what is not given
Setting setting_of(const Parameters& parameters, const Fineness& fineness);
/// The one that is not swept.
Case case_of(const Parameters& parameters);

/// @throws UsageError where a value leaves the model
void expect_sense(const Parameters& parameters, const Setting& setting, const std::vector<Case>& cases);
/// @throws UsageError of what only round cells have
void expect_outline_sense(const Parameters& parameters);

}  // namespace mbtfm::solids
