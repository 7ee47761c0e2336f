/// Which regularisation gives FTTC the total forces of the model-based fit (thesis fig. 3.8, 3.9).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/tractions/fttc.h"

namespace mbtfm::tractions {

struct FittedCell {
  std::string name;
  TractionInputs inputs;
  double fitted_force_nN = 0;
};

/// The comparison over all cells, for one lambda.
struct Comparison {
  double length_um = 0;
  std::vector<double> fttc_nN;        ///< by cell
  double slope = 0, correlation = 0;  ///< of FTTC's forces over the fit's: y = slope x
};

/// Compare all cells for each length lambda E (um).
std::vector<Comparison> compared(const std::vector<FittedCell>& cells, const std::vector<double>& lengths_um,
                                 const TractionParameters& parameters, int threads);

/// The length with slope one, between two of the series; the slope grows as lambda falls.
std::optional<double> length_of_slope_one_um(const std::vector<Comparison>& series);

/// FTTC's forces over the fit's, and slope and correlation by lambda (SVG).
std::string charts_of(const std::vector<FittedCell>& cells, const std::vector<Comparison>& series);

}  // namespace mbtfm::tractions
