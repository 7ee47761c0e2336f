/// The elastic gel under the cell.
#pragma once

#include <memory>
#include <optional>

#include "pipeline/contract/words.h"

namespace mbtfm {

struct HeightMap;  // surface.h

struct Gel {
  double youngs_modulus_kPa = 0;
  double poisson_ratio = 0.49;
  double thickness_um = 60;  ///< from z = 0 to the rigid base
  // standard errors, where the user knows them: the error budget then has a part for the gel
  std::optional<double> youngs_modulus_sigma_kPa{}, poisson_ratio_sigma{}, thickness_sigma_um{};
  std::shared_ptr<const HeightMap> surface{};  ///< null: flat, at z = 0
  std::optional<double> shear_modulus_kPa{};   ///< as given; youngs_modulus_kPa follows from it
};

/// What is taken for the gel: a layer on a rigid base, or so thick that the base does not matter.
enum class GelModel { layer, half_space };
constexpr auto words(GelModel) { return std::array{"layer", "half-space"}; }

/// What relates stress to strain.
enum class MaterialLaw {
  linear,    ///< small strains
  neo_hooke  ///< large ones, too, where a load calls for it
};
constexpr auto words(MaterialLaw) { return std::array{"linear", "neo-hooke"}; }

/// State what must hold of a value. @throws InvalidData naming the element and the finding.
void check(const Gel& gel);

}  // namespace mbtfm
