/// What the pages of all plans are made of, whether the cell is flat or in space.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mbtfm/plan/parameters.h"
#include "mbtfm/plan/plan.h"
#include "pipeline/charts/chart.h"
#include "pipeline/report/page.h"

namespace mbtfm::plan {

using report::number;

/// A point of a curve of standard errors.
struct ErrorDot {
  double density = 0, standard_error_nN = 0, from_beads_nN = 0;
  std::string further = {};  ///< said after its numbers
};

/// Standard error over density at one noise, a curve for each gel, the target as a line.
/// @param density     "beads per µm²"
/// @param what        whose standard error: "middle fibre"
/// @param all_errors  of all noises, so that the axes are alike
charts::Chart error_chart(const Asked& asked, double noise_um, const std::string& density,
                          const std::vector<double>& densities, const std::string& what, std::vector<double> all_errors,
                          const std::function<std::vector<ErrorDot>(double youngs_modulus_kPa)>& dots_of);
/// Side by side, with the line below that says what they are and where the target is.
std::string svg_of(const std::vector<charts::Chart>& charts, const std::string& what, const Asked& asked);
/// One below the other, in a page.
std::string figures_of(const std::vector<charts::Chart>& charts, const Asked& asked);

/// A number as a drawn experiment found it.
struct DrawnDot {
  double true_nN = 0, found_nN = 0, predicted_error_nN = 0;
  int experiment = 0;
  std::string name;  ///< "fibre 3"
};
/// @param what  "tension"
charts::Chart drawn_chart(const std::string& what, const std::vector<DrawnDot>& dots);

/// By gel and noise, of a plan's `needed`. @param text_of  its field, HTML
report::Table needed_rows(const Asked& asked, const std::vector<Needed>& needed,
                          const std::function<std::string(const Needed&)>& text_of);

std::string paragraphs(const std::vector<std::string>& texts);
/// Name, version, and the answer before all else.
std::string head_of(const std::string& name, const std::string& answer, const std::vector<std::string>& further);

}  // namespace mbtfm::plan
