/// report.html of a cell: one file that needs nothing else.
#pragma once

#include <string>

#include "pipeline/contract/cell_kind.h"
#include "pipeline/contract/path.h"

namespace mbtfm::report {

/// As run.json says. @throws InputError where it is malformed
CellKind kind_of(const fs::path& cell);
/// The last stage of the cell has written: fit; traction where the beads are in space; sheet.
bool has_results(const fs::path& cell);
/// The page, from the files of a cell folder whose stages are done. @throws InputError
std::string report_html(const fs::path& cell);
/// Write it as report.html into the cell folder, beside view_in_paraview.py, unless the one there was made by this
/// version of the program from the same files. @throws InputError, OutputError
void update_report(const fs::path& cell);

}  // namespace mbtfm::report
