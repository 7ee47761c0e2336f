/// What a reader should know first: what was found, how good it is, what to distrust.
#pragma once

#include <string>
#include <vector>

#include "pipeline/report/provenance.h"

namespace mbtfm::report {

struct CellResults;

/// The section of a cell's report: sentences on what was found, the open findings with their remedies, a tick where
/// none is open, and the notes.
std::string findings_section(const std::vector<std::string>& facts, const Provenance& provenance);

/// The same of what one program found: these sentences, its open findings with their remedies or a tick, its notes.
std::string list_of(const std::vector<std::string>& facts, const std::vector<Finding>& findings);

/// What was found, and how well the model explains it.
std::vector<std::string> facts_of(const CellResults& results);

}  // namespace mbtfm::report
