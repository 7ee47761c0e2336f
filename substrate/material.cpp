#include "substrate/material.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "pipeline/contract/errors.h"

namespace mbtfm::substrate {

ModulusProfile profile_of(const std::string& text) {
  const auto fail = [&] {
    throw UsageError(
        "substrate.modulus_profile: expected depths (um) and moduli (kPa) by rising depth, like '0:16, 10:16, 10:8.4', "
        "found '" +
        text + "'");
  };
  ModulusProfile profile;
  std::istringstream rows(text);
  for (std::string row; std::getline(rows, row, ',');) {
    std::istringstream numbers(row);
    ModulusAtDepth at;
    char colon = 0;
    if (!(numbers >> at.depth_um >> colon >> at.youngs_modulus_kPa) || colon != ':') fail();
    if (!(numbers >> std::ws).eof()) fail();
    const bool rises = profile.empty() || at.depth_um >= profile.back().depth_um;
    if (!rises || !(at.depth_um >= 0) || !(at.youngs_modulus_kPa > 0) || !std::isfinite(at.youngs_modulus_kPa)) fail();
    profile.push_back(at);
  }
  return profile;
}

double relative_modulus(const Material& material, double depth_um, double towards_um) {
  const ModulusProfile& profile = material.profile;
  if (profile.empty()) return 1;
  const auto is_before = [&](const ModulusAtDepth& at) {
    return towards_um > depth_um ? at.depth_um <= depth_um : at.depth_um < depth_um;
  };
  const auto after = std::partition_point(profile.begin(), profile.end(), is_before);
  double modulus = 0;
  if (after == profile.begin()) {
    modulus = after->youngs_modulus_kPa;
  } else if (after == profile.end()) {
    modulus = profile.back().youngs_modulus_kPa;
  } else {
    const ModulusAtDepth& low = *(after - 1);
    const double share = (depth_um - low.depth_um) / (after->depth_um - low.depth_um);
    modulus = low.youngs_modulus_kPa + share * (after->youngs_modulus_kPa - low.youngs_modulus_kPa);
  }
  return modulus / material.gel.youngs_modulus_kPa;
}

std::optional<double> even_modulus(const Material& material, double low_um, double high_um) {
  const double modulus = relative_modulus(material, low_um, high_um);
  if (relative_modulus(material, high_um, low_um) != modulus) return std::nullopt;
  for (const ModulusAtDepth& at : material.profile) {
    const bool is_within = at.depth_um > low_um && at.depth_um < high_um;
    if (is_within && at.youngs_modulus_kPa != modulus * material.gel.youngs_modulus_kPa) return std::nullopt;
  }
  return modulus;
}

std::vector<double> steps_um(const Material& material) {
  std::vector<double> steps;
  const ModulusProfile& profile = material.profile;
  for (std::size_t k = 1; k < profile.size(); ++k) {
    const double depth = profile[k].depth_um;
    const bool is_step =
        depth == profile[k - 1].depth_um && profile[k].youngs_modulus_kPa != profile[k - 1].youngs_modulus_kPa;
    if (is_step && depth > 0 && depth < material.gel.thickness_um) steps.push_back(depth);
  }
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  return steps;
}

}  // namespace mbtfm::substrate
