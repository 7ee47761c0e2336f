/// What a paper says of how the results were made.
#pragma once

#include <string>

#include "pipeline/report/provenance.h"
#include "pipeline/report/results.h"

namespace mbtfm::report {

/// A paragraph with the numbers of this cell, as HTML.
std::string methods_paragraph(const CellResults& results, const Provenance& provenance);

}  // namespace mbtfm::report
