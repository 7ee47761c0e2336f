/// report.html of a cell: one file that needs nothing else; and its result in short.
#pragma once

#include <string>
#include <vector>

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

/// The result in one line, for the terminal. @throws InputError where a file of the last stage is malformed
std::string result_line(const Path& cell);
/// The same as the members of a JSON object, for programs.
std::string result_event(const Path& cell, const Path& report);

/// For each frame that was fitted a drawing (SVG), all of one size: the cell's images with the fibres in the colours of
/// their tensions and the displacement of the beads, beside the total force over time. Empty for a cell of one frame.
/// @throws InputError where a file that the stages write lacks or is malformed
std::vector<std::string> drawings_of_series(const Path& cell);

}  // namespace mbtfm::report
