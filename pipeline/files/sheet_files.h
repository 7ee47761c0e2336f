/// Files of a contracting sheet: 3_sheet/.
#pragma once

#include "pipeline/contract/path.h"
#include "pipeline/contract/sheet_results.h"
#include "pipeline/files/columns.h"

namespace mbtfm::files {

Table<SheetEstimate> sheet_estimate_table();

/// sheet_fit.csv and sheet.json of a fit. @throws InputError where one of them lacks or is malformed
SheetSummary read_sheet_summary(const Path& folder);

}  // namespace mbtfm::files
