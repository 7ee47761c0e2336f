/// Maps of tractions in space, and how far two of them differ.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::report {

/// On an even lattice of x and y, some of whose places may lack.
struct SpaceMap {
  std::vector<Vec3> at_um, traction_kPa;
  std::vector<double> area_um2;             ///< of the surface around each
  double total_force_nN = 0;                ///< sum of the sizes
  std::optional<double> stated_error = {};  ///< root mean square of the standard errors over that of the tractions
};

/// What the stage found. @throws InputError where a file that the stages write lacks or is malformed
SpaceMap read_space_map(const std::filesystem::path& cell);

/// Of a simulated cell.
bool has_space_truth(const std::filesystem::path& cell);
/// @throws InputError
SpaceMap true_space_map(const std::filesystem::path& cell);

/// sqrt(∫ |t − t_reference|² dA / ∫ |t_reference|² dA) over the places of the reference, between whose neighbours
/// tractions are bilinear; where the map has none they are zero.
double difference(const SpaceMap& map, const SpaceMap& reference);

}  // namespace mbtfm::report
