/// Files of a contracting sheet: 3_sheet/.
#pragma once

#include "pipeline/contract/path.h"
#include "pipeline/contract/sheet_results.h"
#include "pipeline/files/columns.h"

namespace mbtfm::files {

Table<SheetEstimate> sheet_estimate_table();

/// sheet_fit.csv and sheet.json of a fit. @throws InputError where one of them lacks or is malformed
SheetSummary read_sheet_summary(const Path& folder);

/// Who drew an outline.
enum class OutlineSource {
  found,  ///< mbtfm-segment in an image, or unknown
  mask,   ///< another program
  drawn   ///< a hand
};
/// Of an outline.csv, by the record of the stage segment beside it. @throws InputError if that is malformed
OutlineSource source_of_outline(const Path& table);

}  // namespace mbtfm::files
