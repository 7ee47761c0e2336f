/// What is asked of a plan.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::plan {

struct Parameters {
  std::string scenario = "u2os";
  std::uint64_t seed = 1;
  // lists of numbers, as "0.02,0.05"; the first noise and the cell's own gel are what the answer speaks of
  std::string noise_um = "0.05";
  std::string beads_per_um2 = "0.25,0.5,1";
  std::string beads_per_um3{};       ///< of a cell in space; empty: half, once and twice its own
  double axial_noise = 3;            ///< of a cell in space: what confocal microscopes have
  std::string youngs_modulus_kPa{};  ///< empty: half, once and twice the cell's own
  std::optional<double> tension_nN;  ///< unset: 1, or the middle force of a cell in space
  std::string within = "20%";
  int drawn = 2;  ///< some forty tensions: their errors' root mean square is then known to a tenth
  // how many cells
  double between_cells = 0.3;  ///< relative to a type's mean tension
  double difference = 0.5;     ///< likewise
  double power = 0.8;
};
void declare(stage::ParameterList& list, Parameters& parameters);

/// The lists as numbers.
struct Asked {
  std::vector<double> noise_um, densities, youngs_modulus_kPa;  ///< beads by area, or by volume if that is asked for
  double tension_nN = 0;                                        ///< that is to be seen
  double target_nN = 0;                                         ///< the standard error that it may have
  double within = 0;
};
/// @param own_kPa  the cell's own gel
/// @throws UsageError where a list has something else than numbers in their range
Asked asked_by(const Parameters& parameters, double own_kPa);

}  // namespace mbtfm::plan
