/// The report of each kind of cell: what is on its page, and its result in short.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/path.h"
#include "pipeline/report/provenance.h"

namespace mbtfm::report {

/// What the kinds' pages have in common is around it: the open findings, how all was computed.
struct CellPage {
  std::string name;
  std::string what, sub;  ///< below the title
  std::vector<std::string> facts;
  std::string body;     ///< sections
  std::string methods;  ///< a paragraph for a paper
  std::string figures;  ///< HTML, of the last stage
};
/// @throws InputError where a file that the stages write lacks or is malformed
CellPage page_in_plane(const Path& cell, const Provenance& provenance);
CellPage page_in_space(const Path& cell, const Provenance& provenance);
CellPage page_of_sheet(const Path& cell, const Provenance& provenance);

/// The section of a cell's report: sentences on what was found, the open findings with their remedies, a tick where
/// none is open, and the notes.
std::string findings_section(const std::vector<std::string>& facts, const Provenance& provenance);
struct CellResults;
/// What was found of a cell with fibres, and how well the model explains it.
std::vector<std::string> facts_of(const CellResults& results);

/// In one line, and as the members of a JSON object (docs/formats/json.md).
struct Result {
  std::string line, event;
};
/// "total force 412 ± 21 nN; mean tension: ventral 4.1 nN (8), …; 3 of 20 uncertain": by type, how many
Result result_in_plane(const Path& cell, const Path& report);
/// "total force 820 nN; net force 12 ± 30 nN; strain energy 160 fJ"
Result result_in_space(const Path& cell, const Path& report);
/// "contraction 1.8 nN/µm (1.7 to 1.9); stiffness 3.1 nN/µm (2.6 to 3.8); mean tension 1.1 nN/µm; total force 540 nN"
Result result_of_sheet(const Path& cell, const Path& report);

}  // namespace mbtfm::report
