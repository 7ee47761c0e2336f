/// What a reader should know first: what was found, how good it is, what to distrust.
#pragma once

#include <string>
#include <vector>

#include "pipeline/report/results.h"

namespace mbtfm::report {

enum class Level { fact, good, caution, bad };

struct Finding {
  Level level = Level::fact;
  std::string text;
};

/// @param not_converged  names of the stages that did not converge
/// @param by_hand  sentences on outputs that mbtfm did not make
std::vector<Finding> findings_of(const CellResults& results, const std::vector<std::string>& not_converged,
                                 const std::vector<std::string>& by_hand);

/// |sum of forces| and |sum of torques about the centre of the adhesions|, relative to the sum of the magnitudes.
struct Balance {
  double net_force = 0, net_torque = 0;
  bool has_moments = false;  ///< those of single adhesions are in the table, and counted
};
Balance balance_of(const CellResults& results);

}  // namespace mbtfm::report
