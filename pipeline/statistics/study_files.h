/// The tables, figures and report of a study, as text.
#pragma once

#include <string>

#include "pipeline/statistics/study.h"

namespace mbtfm::statistics {

std::string cells_csv(const Study& study);
std::string adhesions_csv(const Study& study);
std::string fibres_csv(const Study& study);
std::string types_csv(const Study& study, const StudyParameters& parameters);
std::string tests_csv(const Study& study);

/// Every fibre's tension by type with the median, as one <svg> element.
std::string tensions_by_type_svg(const Study& study);
/// Total force of each cell, the strongest first: the share of the fibres and of the network.
std::string forces_by_cell_svg(const Study& study);
/// Force of each adhesion against its area; filled: a fibre ends on it.
std::string adhesion_forces_svg(const Study& study);

std::string study_html(const Study& study, const StudyParameters& parameters);

}  // namespace mbtfm::statistics
